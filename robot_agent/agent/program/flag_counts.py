"""The flags of `M n ASYNC`: counted where the robot passes the end of the move before, without a stop."""

from collections.abc import Iterable

from robot_agent.agent.planning.plans import Planned
from robot_agent.language import FlagMark, Mark

_AT_S = 1e-5
"""The robot stands at the end of a move when it is this much planned time in front of it."""


class FlagCounts:
    """Of one run of a program. A mark counts once, however often the robot passes its place."""

    def __init__(self) -> None:
        self.raised: dict[int, int] = {}
        """By flag, how often it was raised."""
        self._counted = 0
        """The highest number of a mark that was."""
        self._ahead: tuple[FlagMark, ...] = ()
        """On the motion that the robot was seen on last."""

    def drop(self) -> None:
        """A run begins."""
        self.raised, self._counted, self._ahead = {}, 0, ()

    def count(self, marks: Iterable[Mark]) -> None:
        """The robot has come to these places."""
        for mark in marks:
            if isinstance(mark, FlagMark) and mark.number > self._counted:
                self._counted = mark.number
                self.raised[mark.flag] = self.raised.get(mark.flag, 0) + 1

    def follow(self, path: Planned, tau: float) -> None:
        """The robot is at path time `tau` [s] of this motion, and has passed all of those before it."""
        places = [(place, mark) for place, mark in path.places if isinstance(mark, FlagMark)]
        here = tuple(mark for _, mark in places)
        self.count(mark for mark in self._ahead if mark not in here)
        self.count(mark for place, mark in places if place <= tau + _AT_S)
        self._ahead = here
