"""The statements by which a robot changes its tool, takes a part and gives it away."""

from dataclasses import dataclass
from typing import Self

from robot_agent.language.program import Program
from robot_agent.language.statement import Reading, Statement, Walk, statement
from robot_agent.language.steps import Mount, ProgramFault
from robot_agent.language.words import Mistake, Word, unknown
from robot_agent.model.description import Mounted, RobotDescription


@statement("T=")
@dataclass(frozen=True, slots=True)
class ChangeTool(Statement):
    """`T=name`, `T1` for the tool T1, `T0` or `T=NONE` for none: the robot comes to rest, and has it from here on."""

    tool: str | None

    @classmethod
    def read(cls, line: int, words: list[Word], reading: Reading) -> Self:
        if len(words) != 1:
            raise Mistake(
                words[1].column, f"`{words[1].text}` after {words[0].text}", "nothing: T is a line of its own"
            )
        word, known = words[0], reading.names.tools
        name = word.text.upper() if word.pair is None else word.pair[1]
        if name.upper() in ("T0", "NONE"):
            return cls(line, None)
        if "=" not in word.text and known is not None:
            name = next((each for each in known if each.upper() == name.upper()), name)
        if known is not None and name not in known:
            raise unknown(Word(name, word.column), "tool", {"T0", *known}, "")
        return cls(line, name)

    def run(self, walk: Walk) -> Mount | ProgramFault | None:
        tools = () if self.tool is None else (self.tool,)
        if walk.tools == tools:
            return None
        word = f"T={self.tool or 'NONE'}"
        if walk.tracking:
            return _while_tracking(self.line, word)
        if walk.held:
            return ProgramFault(self.line, f"{word} while the robot holds {_any_of(walk.held)}: DETACH comes first")
        walk.tools = tools
        return Mount(self.line, walk.mounted)


@statement("ATTACH")
@dataclass(frozen=True, slots=True)
class Attach(Statement):
    """`ATTACH name`: the robot comes to rest, and from here on this part belongs to its body."""

    part: str

    @classmethod
    def read(cls, line: int, words: list[Word], reading: Reading) -> Self:
        if len(words) != 2:
            found = f"`{' '.join(word.text for word in words)}`"
            raise Mistake(words[0].column, found, "ATTACH and the name of a part")
        word = words[1]
        if reading.names.parts is not None and word.text not in reading.names.parts:
            raise unknown(word, "part", reading.names.parts, "none: this robot has none in its robot file")
        return cls(line, word.text)

    def run(self, walk: Walk) -> Mount | ProgramFault:
        if walk.tracking:
            return _while_tracking(self.line, "ATTACH")
        if walk.held:
            held = _any_of(walk.held)
            return ProgramFault(self.line, f"ATTACH {self.part} while the robot holds {held}: DETACH comes first")
        walk.held = (self.part,)
        return Mount(self.line, walk.mounted)


@statement("DETACH")
@dataclass(frozen=True, slots=True)
class Detach(Statement):
    """`DETACH`: the robot comes to rest, and from here on the part that it held belongs to its body no more."""

    @classmethod
    def read(cls, line: int, words: list[Word], _reading: Reading) -> Self:
        if len(words) != 1:
            raise Mistake(
                words[1].column, f"`{words[1].text}` after DETACH", "nothing: the robot holds one part at most"
            )
        return cls(line)

    def run(self, walk: Walk) -> Mount | ProgramFault:
        if walk.tracking:
            return _while_tracking(self.line, "DETACH")
        if walk.held == ():
            return ProgramFault(self.line, "DETACH while the robot holds no part: ATTACH comes first")
        walk.held = ()
        return Mount(self.line, walk.mounted)


def changes_tools(program: Program) -> bool:
    """Whether the program says which tool is mounted."""
    return any(isinstance(each, ChangeTool) for each in program.statements)


def mounts(program: Program) -> bool:
    """Whether what the robot carries matters to the program: it changes the tool, takes a part or gives one away."""
    return any(isinstance(each, ChangeTool | Attach | Detach) for each in program.statements)


def mounted_before(program: Program, described: RobotDescription) -> Mounted:
    """What such a robot carries before a program that is meant to run: the tool of its file.

    Besides that any of its parts if DETACH comes first, and else none.
    """
    first = next((each for each in program.statements if isinstance(each, Attach | Detach)), None)
    return Mounted(described.mounted.tools, tuple(described.parts) if isinstance(first, Detach) else ())


def _any_of(held: tuple[str, ...]) -> str:
    return " or ".join(held)


def _while_tracking(line: int, word: str) -> ProgramFault:
    return ProgramFault(line, f"{word} while the robot follows a correction: TRACK OFF comes first")
