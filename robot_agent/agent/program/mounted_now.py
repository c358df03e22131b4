"""What the robot carries, tool and part: by its program, or by an operator's word.

Nothing measures it. After the agent's start nobody knows which part it holds, nor which tool is mounted where its
program changes tools, and the body has all of them until an operator says which one is there: they may have been
changed meanwhile. A program that changes no tool has the one of the robot file.

Where the cell file vouches for it (`mounted_at_start`), it is what the robot file says from the start on. That ends
when a program that changes it begins, until it has ended in order with the same on the robot, or an operator has said
that it is there; an agent that ends meanwhile finds a note of it at its next start, and the cell file counts no more.
"""

from dataclasses import dataclass, replace

from cell.config.settings import MountedAtStart
from cell.core import Effect
from robot_agent.model.description import NOTHING, Mounted, RobotDescription


@dataclass(frozen=True, slots=True)
class NoteDoubt(Effect):
    """Keep over the end of this agent whether the robot may carry something else than its robot file says."""

    doubtful: bool


class MountedNow:
    """One tool and one part at most, while they are known."""

    def __init__(self, at_start: MountedAtStart = MountedAtStart.ASK, *, doubtful: bool = False) -> None:
        """`doubtful`: an agent before this one has left that note."""
        self.present = NOTHING
        """All that it may carry."""
        self.tools: tuple[str, ...] | None = None
        """Names of all tools; None before the robot file is read."""
        self.parts: tuple[str, ...] = ()
        """Names of all parts."""
        self._described = NOTHING
        """The tool of the robot file."""
        self._tool_known = self._part_known = True
        self._vouched = at_start is MountedAtStart.AS_DESCRIBED
        self._doubts = {"tool", "part"} if doubtful else set[str]()
        """Which of both an operator has to look at before the cell file counts again."""
        self._noted = doubtful

    def declare(self, described: RobotDescription, *, changes_tools: bool) -> None:
        """The tools and parts of the robot file, once it is read; whether the program changes tools."""
        if self.tools is not None:
            return
        self.tools, self.parts = tuple(described.tools), tuple(described.parts)
        self._described = Mounted(described.mounted.tools, ())
        sure = self._vouched and not self._doubts
        self._tool_known = sure or not (changes_tools and self.tools)
        self._part_known = sure or not self.parts
        tools = described.mounted.tools if self._tool_known else self.tools
        self.present = Mounted(tools, () if self._part_known else self.parts)

    def follow(self, other: "MountedNow") -> None:
        """All that is known there."""
        self.present, self.tools, self.parts = other.present, other.tools, other.parts
        self._tool_known, self._part_known = other._tool_known, other._part_known

    def take(self, mounted: Mounted) -> None:
        """From here on it carries this, by a program, which runs only where all that it changes is known."""
        self.present = mounted

    def say_tool(self, tool: str | None) -> None:
        """An operator has looked: this tool is mounted, or none."""
        self.present = replace(self.present, tools=() if tool is None else (tool,))
        self._tool_known = True
        self._looked_at("tool", as_described=self.present.tools == self._described.tools)

    def say_part(self, part: str | None) -> None:
        """An operator has looked: it holds this part, or none."""
        self.present = replace(self.present, parts=() if part is None else (part,))
        self._part_known = True
        self._looked_at("part", as_described=part is None)

    def begin(self) -> None:
        """A program begins that changes tool or part."""
        self._doubts = {kind for kind, names in (("tool", self.tools), ("part", self.parts)) if names}

    def end(self) -> None:
        """It has ended in order."""
        if self.present == self._described:
            self._doubts = set()

    def note(self) -> NoteDoubt | None:
        """What is to be kept of it from here on, when that is another thing than before."""
        doubtful = bool(self._doubts)
        if not self._vouched or doubtful is self._noted:
            return None
        self._noted = doubtful
        return NoteDoubt(doubtful)

    @property
    def why_unknown(self) -> str:
        """Why the cell file does not say what is there, for people; empty where it never does."""
        return "the agent ended before a program that changes it had" if self._vouched and self._doubts else ""

    def _looked_at(self, kind: str, *, as_described: bool) -> None:
        self._doubts = self._doubts - {kind} if as_described else self._doubts | {kind}

    @property
    def tool(self) -> str | None:
        """The name of the mounted tool, empty for none; None where nobody knows."""
        return "".join(self.present.tools) if self._tool_known else None

    @property
    def part(self) -> str | None:
        """The name of the part, empty for none; None where nobody knows."""
        return "".join(self.present.parts) if self._part_known else None
