"""A jog on a robot that plays what it is given: blocks joined every few ticks, some of them lost."""

from collections.abc import Callable

import numpy as np

from cell.messages import JogFrame
from robot_agent.kinematics import Model
from robot_agent.trajectory import Limits
from robot_agent.trajectory.sources import JogSource, JogWish, JointAxes, States, ToolAxes
from tests.unit.six_axis_arm import arm, description

CYCLE_S = 0.004
STEP = 5
NOMINAL = 30
ARM = arm()
LIMITS = Limits.of(description())
START = np.array([0.3, 0.2, 0.3, 0.1, 0.9, 0.2])


class Jogged:
    """Plays the blocks of jogs one after the other; `played` is every tick that was commanded."""

    def __init__(self, start: np.ndarray = START, model: Model = ARM, limits: Limits = LIMITS) -> None:
        self.model, self.limits = model, limits
        self.played = [start, start, start]
        self.way = States.standing(start)

    def press(
        self,
        axis: int | str,
        speed: float,
        step: float | None = None,
        frame: JogFrame = JogFrame.BASE,
        clear: Callable[[States], str] | None = None,
    ) -> JogSource:
        """`axis` is a joint's index or a letter of XYZABC."""
        if isinstance(axis, int):
            axes, wish = JointAxes(self.limits), JogWish(axis, speed, step)
            return JogSource(self.model, self.limits, CYCLE_S, axes, wish, clear)
        tool = ToolAxes(self.model, self.limits, frame, np.eye(4))
        wish = JogWish("XYZABC".index(axis), speed, step)
        return JogSource(self.model, self.limits, CYCLE_S, tool, wish, clear)

    def block(self, source: JogSource, lost: bool = False) -> None:
        """One block of the source, and the ticks until the next one; a lost one leaves the robot on its old way."""
        source.resume(self.way, np.array(self.played[-3:-1]))
        nominal = source.samples(NOMINAL)
        way = self.way.first(1).then(nominal).then(source.brake())
        if not lost:
            self.way = way
        played = self.way.after(1).first(STEP)
        self.played += list(played.q)
        self.way = self.way.after(STEP)

    def run(self, source: JogSource, blocks: int) -> None:
        for _ in range(blocks):
            self.block(source)

    def stop(self, source: JogSource) -> int:
        """Let the key go; returns the blocks until rest."""
        source.held = False
        for count in range(200):
            if not self.way.qd.any():
                return count
            self.block(source)
        raise AssertionError("does not come to rest")

    @property
    def q(self) -> np.ndarray:
        return self.played[-1]

    def tcp(self) -> np.ndarray:
        """`(m, 4, 4)` of everything played."""
        return self.model.forward(np.array(self.played))

    def shares(self) -> np.ndarray:
        """The largest shares of speed, ramp acceleration and ramp jerk in what was played and still will be."""
        q = np.concatenate([np.array(self.played), self.way.q[1:]])
        allowed = (self.limits.velocity, self.limits.ramp_acceleration_bounds[1], self.limits.ramp_jerk)
        return np.array(
            [
                (np.abs(np.diff(q, order, axis=0)) / CYCLE_S**order / limit).max()
                for order, limit in enumerate(allowed, 1)
            ]
        )
