"""What the joints feel where two paths meet, in numbers and for people."""

import math
from dataclasses import dataclass

import numpy as np

from robot_agent.kinematics import Model
from robot_agent.paths.junction import SHARPEST_RAD, TANGENT_RAD, edge_text, rate_text
from robot_agent.paths.transition import Continuity, Passing, Transition
from robot_agent.trajectory.joints.joint_path import JointPath, Numbers

STEP_OF_CURVATURE = 1e-6
_STANDS = 1e-6
"""Way of the TCP by the parameter [m/s] below which it turns on the spot."""
_SAME_RATE_RAD_M = 2e-3


@dataclass(frozen=True, slots=True)
class JointJunction:
    """Two joint paths at their border."""

    before: int
    move: int
    kink: float
    """By how much the joints' direction steps, each joint weighted by its speed limit: 2 sin of half the angle."""
    step: float
    """The same for the curvature by the parameter."""
    turn_rad: float
    """By how much the TCP's direction turns, 0 where it stands on one side."""
    reason: str
    """What steps, for people."""

    @classmethod
    def of(cls, model: Model, velocity: Numbers, first: JointPath, second: JointPath) -> "JointJunction":
        """Where `second` begins where `first` ends; `velocity` `(n,)` are the joints' speed limits."""
        states = first.state(first.length), second.state(0.0)
        kink, step = (float(np.linalg.norm((states[1][k] - states[0][k]) / velocity)) for k in (1, 2))
        edge, after = first.stretches[-1], second.stretches[0]
        jacobian = model.jacobian(first.end())
        twists = [jacobian @ state[1] for state in states]
        ways = [float(np.linalg.norm(twist[:3])) for twist in twists]
        turn = _angle(*twists) if min(ways) > _STANDS else 0.0
        reason = _reason(
            2.0 * float(np.arcsin(min(1.0, kink / 2.0))), turn, twists, ways, edge.on_path or after.on_path
        )
        if kink <= TANGENT_RAD:
            reason = "the curvature steps" if step > STEP_OF_CURVATURE else ""
        return cls(edge.move, after.first_move, kink, step, turn, reason)

    @property
    def tangential(self) -> bool:
        return self.kink <= TANGENT_RAD

    @property
    def smooth(self) -> bool:
        """Nothing steps at all."""
        return self.kink <= 1e-9 and self.step <= STEP_OF_CURVATURE

    @property
    def sharp(self) -> bool:
        """No round edge follows it."""
        return self.turn_rad > SHARPEST_RAD or self.kink > 2.0 * math.sin(SHARPEST_RAD / 2.0)

    def stop(self, why: str) -> Transition:
        """The robot stops, and why beyond what steps."""
        reason = f"{self.reason}; {why}" if self.reason else why
        return Transition(self.before, self.move, self._continuity, Passing.STOPS, reason)

    def passed(self, deviation_m: float | None) -> Transition:
        """Without a stop: as it is (None), or blended and at most so far away from both."""
        passing = Passing.THROUGH if deviation_m is None else Passing.BLENDED
        return Transition(self.before, self.move, self._continuity, passing, self.reason, deviation_m or 0.0)

    def rounded(self, round_m: float, cut_m: float, deviation_m: float) -> Transition:
        """With a round edge, see `paths.junction`."""
        reason = f"{self.reason}; {edge_text(round_m, cut_m)}"
        return Transition(self.before, self.move, self._continuity, Passing.ROUNDED, reason, deviation_m, cut_m=cut_m)

    @property
    def _continuity(self) -> Continuity:
        if not self.tangential:
            return Continuity.C0
        return Continuity.C1 if self.step > STEP_OF_CURVATURE else Continuity.C2


def _angle(before: Numbers, after: Numbers) -> float:
    """Between the directions of two twists `(6,)`, exact for small angles and for those near pi."""
    first, second = (twist[:3] / np.linalg.norm(twist[:3]) for twist in (before, after))
    return float(2.0 * np.arctan2(np.linalg.norm(second - first), np.linalg.norm(second + first)))


def _reason(joints_rad: float, turn_rad: float, twists: list[Numbers], ways: list[float], on_path: bool) -> str:
    joints = f"the joints' direction turns by {np.degrees(joints_rad):.1f} deg"
    if not on_path:
        return joints
    if min(ways) <= _STANDS:
        return "the TCP turns on the spot there"
    if turn_rad > TANGENT_RAD:
        return f"the path turns by {np.degrees(turn_rad):.1f} deg"
    rate = float(np.linalg.norm(twists[1][3:] / ways[1] - twists[0][3:] / ways[0]))
    return f"the orientation would turn at another rate, by {rate_text(rate)}" if rate > _SAME_RATE_RAD_M else joints
