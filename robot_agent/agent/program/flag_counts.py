"""What happens where the robot passes the end of a move, without a stop: `M n ASYNC` counts, LET sets for the cell."""

from collections.abc import Iterable

from robot_agent.agent.planning.plans import Planned
from robot_agent.agent.program.shared_variables import SharedVariables
from robot_agent.language import FlagMark, LetMark, Mark

_AT_S = 1e-5
"""The robot stands at the end of a move when it is this much planned time in front of it."""


class FlagCounts:
    """Of one run of a program. A mark counts once, however often the robot passes its place."""

    def __init__(self, program: str, variables: SharedVariables) -> None:
        self.program = program
        """Its name."""
        self._variables = variables
        self.raised: dict[int, int] = {}
        """By flag, how often it was raised."""
        self._counted = 0
        """The highest number of a mark that was."""
        self._ahead: tuple[FlagMark | LetMark, ...] = ()
        """On the motion that the robot was seen on last."""

    def drop(self) -> None:
        """A run begins."""
        self.raised, self._counted, self._ahead = {}, 0, ()

    def count(self, marks: Iterable[Mark]) -> None:
        """The robot has come to these places."""
        for mark in marks:
            if isinstance(mark, FlagMark | LetMark) and mark.number > self._counted:
                self._counted = mark.number
                if isinstance(mark, LetMark):
                    self._variables.set(mark.name, mark.value, self.program, int(mark.line))
                else:
                    self.raised[mark.flag] = self.raised.get(mark.flag, 0) + 1

    def follow(self, path: Planned, tau: float) -> None:
        """The robot is at path time `tau` [s] of this motion, and has passed all of those before it."""
        places = [(place, mark) for place, mark in path.places if isinstance(mark, FlagMark | LetMark)]
        here = tuple(mark for _, mark in places)
        self.count(mark for mark in self._ahead if mark not in here)
        self.count(mark for place, mark in places if place <= tau + _AT_S)
        self._ahead = here
