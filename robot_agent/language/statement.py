"""The register of statements: by which words each begins, how it is read, and what it does when a program comes to it.

`@statement` above the `@dataclass` of a statement is all that parser and interpreter ask for. What it does is a step
that the robot knows (`robot_agent.language.steps`, a move of the TCP), or a change of the walk through the program.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Self, TypeVar

from robot_agent.language.names import Names, Points
from robot_agent.language.steps import BASE
from robot_agent.language.words import Word
from robot_agent.model.description import Mounted

if TYPE_CHECKING:
    from robot_agent.language.conditions import Branches, Ways
    from robot_agent.language.interpreter import Step
    from robot_agent.language.steps import Mark, Question, Signal
    from robot_agent.paths.caps import Tolerance


@dataclass(slots=True)
class Reading:
    """What the statements of one text are read against, and what they tell one another."""

    names: Names
    begins: Mapping[str, int]
    """By file that is called, the index of its first statement; complete once all are read."""
    place: int = 0
    """Index of the statement that is being read."""
    labels: dict[str, int] = field(default_factory=dict)
    """Name: index of the statement after the label."""
    linked: list[tuple[int, Callable[[], "Statement"]]] = field(default_factory=list)
    """Statements to be made once all labels are known, by their index; making one may raise Mistake."""
    files: list[tuple[int, Word]] = field(default_factory=list)
    """Line and word of what CALL names."""
    has_feed: bool = False
    """Whether a path move has named its speed."""

    ifs: list["Branches"] = field(default_factory=list)
    """Those that are open, the innermost one last."""
    variables: set[str] = field(default_factory=set)
    """That some LET sets."""


@dataclass(slots=True)
class SubCall:
    """A subroutine that is running."""

    target: int
    """Index of its first statement."""
    back: int
    """Index of the statement after the call."""
    left: int
    """How often it runs again after this time."""
    jumps_left: dict[int, int]
    """Of those who called it."""


@dataclass(slots=True)
class Walk:
    """Where one run of a program is."""

    index: int = 0
    """Of the statement that comes next."""
    jumps_left: dict[int, int] = field(default_factory=dict)
    """By the index of a GOTO that counts, in this subroutine."""
    calls: list[SubCall] = field(default_factory=list)
    """The subroutines that are running, the newest one last."""
    joint_speed: float = 1.0
    """The newest F of joint moves, as a fraction of the limits."""
    path_speed_m_s: float | None = None
    """The newest F of path moves."""
    speed_share: float = 1.0
    """`SPEED`, of both."""
    tangential_rad: float | None = None
    """While TANG is on."""
    tolerance: "Tolerance | None" = None
    """`TOL`, of lines and arcs."""
    tracking: bool = False
    spaces_off: frozenset[str] = frozenset()
    """Spaces that are switched off."""
    tools: tuple[str, ...] | None = None
    """The mounted tool, or those that may be; None where nobody says."""
    held: tuple[str, ...] | None = None
    """Parts that the robot holds, or may hold; None where nobody says: then both ATTACH and DETACH may come first."""
    switched: int = 0
    """Outputs, since the program began."""
    frame: str = BASE
    """The one that is active."""
    points: Points = field(default_factory=Points)
    """As they are now."""

    raised: int = 0
    """Flags that nobody waits for, and LETs of variables of the cell, since the program began."""
    variables: dict[str, float] = field(default_factory=dict)
    """Those that are set."""
    ahead: bool = False
    """While LOOKAHEAD is on."""
    known: Callable[["Question"], bool | None] = lambda _: None
    """Whether an input or output is on now, or a comparison holds; None where nobody knows."""
    ways: "Ways | None" = None
    """For checks: which way a fork goes; variables have no values then."""

    @property
    def mounted(self) -> Mounted:
        return Mounted(self.tools or (), self.held or ())


@dataclass(frozen=True, slots=True)
class Statement(ABC):
    """One statement of a program, in SI units."""

    line: int
    """From 1."""

    @classmethod
    @abstractmethod
    def read(cls, line: int, words: list[Word], reading: Reading) -> "Statement":
        """The statement in these words, the first of which is one of its own. Raises Mistake."""

    @abstractmethod
    def run(self, walk: Walk) -> "Step | Mark | None":
        """What the robot does here; None: nothing, the walk goes on."""

    def leads_to(self, place: int) -> tuple[int, ...]:
        """Places of the statements that may come after this one, which is at `place`."""
        return (place + 1,)

    def moved(self, _places: Sequence[int]) -> Self:
        """The same in a program whose statements have these new places, by their old ones."""
        return self

    @property
    def idle(self) -> bool:
        """Whether no time passes here: in a loop of such statements the program would never come to anything."""
        return False

    @property
    def switched_outputs(self) -> tuple[str, ...]:
        """The digital outputs that it may switch; a robot that lacks one does not run the program."""
        return ()

    @property
    def frames(self) -> tuple[str, ...]:
        """The frames that it names."""
        return ()

    @property
    def signals(self) -> tuple["Signal", ...]:
        """The inputs and outputs that it asks for; a robot that lacks one does not run the program."""
        return ()

    @property
    def forks(self) -> bool:
        """Whether the program may go on in two places after it, by what is asked."""
        return False


S = TypeVar("S", bound=Statement)

STATEMENTS: dict[str, type[Statement]] = {}
"""By the words, in upper case, with which a statement may begin."""


def statement(*words: str) -> Callable[[type[S]], type[S]]:
    """Register a statement."""

    def register(kind: type[S]) -> type[S]:
        STATEMENTS.update(dict.fromkeys(words, kind))
        return kind

    return register
