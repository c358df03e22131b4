"""Joint move: all joints in step along a straight line in joint space, or each of them at its own speed."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from robot_agent.paths.caps import Caps


@dataclass(frozen=True, slots=True, eq=False)
class JointMove(Caps):
    """Move all joints to `target` `(n,)` [rad or m] in step; a full turn is a real turn, nothing is wrapped.

    `speed` is the fraction (0 < speed <= 1) of every joint's speed limit, `line` the program line for error messages.
    A move that is not `synchronised` lets each joint go as fast as it can: all start together, each arrives when it
    does. Such a move has no round edge, the robot rests at both of its ends.
    """

    target: NDArray[np.float64]
    speed: float
    line: int
    speed_m_s: float | None = None
    synchronised: bool = True

    def __post_init__(self) -> None:
        self.check("joint", self.line, self.speed_m_s)
        if not 0.0 < self.speed <= 1.0:
            raise ValueError(f"joint move, line {self.line}: speed {self.speed} found, allowed above 0 up to 1")
        if not self.synchronised and self.round_m:
            raise ValueError(f"joint move, line {self.line}: a round edge found, allowed only where joints are in step")

    def joints(self, start: NDArray[np.float64], u: NDArray[np.float64]) -> NDArray[np.float64]:
        """Joints `(..., n)` at path parameters `u` `(...)` of the move from `start` `(n,)`."""
        return start + np.asarray(u)[..., None] * (self.target - start)
