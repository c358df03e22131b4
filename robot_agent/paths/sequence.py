"""A sequence of moves, one after the other."""

from collections.abc import Iterable

from robot_agent.paths.arc import Arc
from robot_agent.paths.joint_move import JointMove
from robot_agent.paths.line import Line
from robot_agent.paths.spline import Spline

Block = JointMove | Line | Arc | Spline


class Sequence:
    """The blocks of one motion, in order; each starts where the one before it ends."""

    __slots__ = ("blocks",)

    def __init__(self, blocks: Iterable[Block]) -> None:
        self.blocks: tuple[Block, ...] = tuple(blocks)
        if not self.blocks:
            raise ValueError("a sequence needs at least one block, none found")

    def __len__(self) -> int:
        return len(self.blocks)
