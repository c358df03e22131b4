"""A sequence of moves, one after the other."""

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from robot_agent.paths.arc import Arc
from robot_agent.paths.joint_move import JointMove
from robot_agent.paths.line import Line
from robot_agent.paths.spline import Spline

Block = JointMove | Line | Arc | Spline


class Sequence:
    """The blocks of one motion, in order; each starts where the one before it ends.

    `beyond` are blocks that come after it: they are not planned, but lines within a tolerance are led towards them, and
    a spline at its end arrives in the direction in which it goes on to the first of them.
    `aimed` `(4, 4)` is the pose to which the block before led; None: where the robot is.
    """

    __slots__ = ("aimed", "beyond", "blocks")

    def __init__(
        self, blocks: Iterable[Block], beyond: Iterable[Block] = (), aimed: NDArray[np.float64] | None = None
    ) -> None:
        self.blocks: tuple[Block, ...] = tuple(blocks)
        self.beyond: tuple[Block, ...] = tuple(beyond)
        self.aimed = aimed
        if not self.blocks:
            raise ValueError("a sequence needs at least one block, none found")

    def __len__(self) -> int:
        return len(self.blocks)
