"""A sequence of moves, one after the other."""

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from robot_agent.paths.arc import Arc
from robot_agent.paths.joint_move import JointMove
from robot_agent.paths.line import Line
from robot_agent.paths.spline import Spline

Move = JointMove | Line | Arc | Spline


class Sequence:
    """The moves of one motion, in order; each starts where the one before it ends.

    `beyond` are moves that come after it: they are not planned, but lines within a tolerance are led towards them, and
    a spline at its end arrives in the direction in which it goes on to the first of them.
    `aimed` `(4, 4)` is the pose to which the move before led; None: where the robot is.
    """

    __slots__ = ("aimed", "beyond", "moves")

    def __init__(
        self, moves: Iterable[Move], beyond: Iterable[Move] = (), aimed: NDArray[np.float64] | None = None
    ) -> None:
        self.moves: tuple[Move, ...] = tuple(moves)
        self.beyond: tuple[Move, ...] = tuple(beyond)
        self.aimed = aimed
        if not self.moves:
            raise ValueError("a sequence needs at least one move, none found")

    def __len__(self) -> int:
        return len(self.moves)
