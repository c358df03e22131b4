"""Which moves of a program are planned as one motion."""

import numpy as np
from numpy.typing import NDArray

from robot_agent.agent.planning.targets import joint_target
from robot_agent.language import JointStep, MotionStep, SplineStep

_NEARLY_STRAIGHT = 1e-2
"""What nearly goes straight on is planned together; planning then tells exactly."""


def why_apart(step: MotionStep, following: MotionStep) -> str:
    """Why the robot stops between two moves whatever their directions are, for people; empty where it may go on.

    A joint move after a move of the TCP needs all its joints named: where the TCP move leaves the others is not
    known before it is planned. A spline takes its direction from a joint move next to it. Where TANG changes, the tool
    may have to turn before the robot goes on. Where SPACE changes, other spaces hold from the rest on.
    """
    if step.spaces_off != following.spaces_off:
        return f"SPACE changes before line {following.line}"
    if step.pace.round_m == 0.0:
        return "R=0 asks for a stop"
    if isinstance(step, JointStep) or isinstance(following, JointStep):
        return _why_joints_apart(step, following)
    return "" if step.tangential_rad == following.tangential_rad else f"TANG changes before line {following.line}"


def _why_joints_apart(step: MotionStep, following: MotionStep) -> str:
    if any(isinstance(move, JointStep) and not move.synchronised for move in (step, following)):
        return "with SYNC=0 each joint arrives by itself"
    if isinstance(following, JointStep) and not isinstance(step, JointStep):
        if following.goal is not None:
            return f"the move in line {following.line} leads to a pose, whose branch is chosen at rest"
        if following.joints is not None and None in following.joints:
            return f"the MJ in line {following.line} does not name all joints"
    takes_over = any(isinstance(move, SplineStep) and move.tangential_rad is None for move in (step, following))
    return "" if step.pace.round_m is not None or takes_over else "next to a joint move it takes an R"


class StraightOn:
    """Which joint moves go on in the direction of the one before them, which then needs no round edge.

    After a move of the TCP and after HOME the joints are not known until all of them are named again.
    """

    def __init__(self, start: NDArray[np.float64] | None) -> None:
        """`start` `(n,)` are the joints before the first step, None where nobody knows them."""
        self._before: NDArray[np.float64] | None = None
        self._here = start
        self._rounded = True
        self._spaces_off = frozenset[str]()

    def take(self, step: MotionStep) -> None:
        """The step is the next one of the chain."""
        self._before, self._here = self._here, _after(step, self._here)
        self._rounded = step.pace.round_m is not None
        self._spaces_off = step.spaces_off

    def goes_on(self, following: MotionStep) -> bool:
        """Whether `following` is a joint move in the direction of the newest step."""
        if self._rounded or self._before is None or self._here is None or following.spaces_off != self._spaces_off:
            return False
        after = _after(following, self._here)
        if after is None:
            return False
        ways = self._here - self._before, after - self._here
        lengths = [float(np.linalg.norm(way)) for way in ways]
        if min(lengths) == 0.0:
            return False
        return bool(np.linalg.norm(ways[0] / lengths[0] - ways[1] / lengths[1]) < _NEARLY_STRAIGHT)


def _after(step: MotionStep, q: NDArray[np.float64] | None) -> NDArray[np.float64] | None:
    if not isinstance(step, JointStep) or step.joints is None or step.goal is not None or not step.synchronised:
        return None
    if q is None:
        return None if None in step.joints else np.array(step.joints, dtype=np.float64)
    return joint_target(step, q, q)
