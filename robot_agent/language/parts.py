"""The statements by which a robot takes a part and gives it away."""

from collections.abc import Collection
from dataclasses import dataclass
from typing import Self

from robot_agent.language.program import Program
from robot_agent.language.statement import Reading, Statement, Walk, statement
from robot_agent.language.steps import HoldParts, ProgramFault
from robot_agent.language.words import Mistake, Word, unknown


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
            raise unknown(word, "part", reading.names.parts, "a name of parts", "this robot has none in its robot file")
        return cls(line, word.text)

    def run(self, walk: Walk) -> HoldParts | ProgramFault:
        if walk.tracking:
            return _while_tracking(self.line, "ATTACH")
        if walk.held:
            held = " or ".join(walk.held)
            return ProgramFault(self.line, f"ATTACH {self.part} while the robot holds {held}: DETACH comes first")
        walk.held = (self.part,)
        return HoldParts(self.line, walk.held)


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

    def run(self, walk: Walk) -> HoldParts | ProgramFault:
        if walk.tracking:
            return _while_tracking(self.line, "DETACH")
        if walk.held == ():
            return ProgramFault(self.line, "DETACH while the robot holds no part: ATTACH comes first")
        walk.held = ()
        return HoldParts(self.line, walk.held)


def uses_parts(program: Program) -> bool:
    """Whether the program takes a part or gives one away."""
    return any(isinstance(each, Attach | Detach) for each in program.statements)


def held_before(program: Program, parts: Collection[str]) -> tuple[str, ...]:
    """What a robot with these parts holds before a program that is meant to run: any of them if DETACH comes first."""
    first = next((each for each in program.statements if isinstance(each, Attach | Detach)), None)
    return tuple(parts) if isinstance(first, Detach) else ()


def _while_tracking(line: int, word: str) -> ProgramFault:
    return ProgramFault(line, f"{word} while the robot follows a correction: TRACK OFF comes first")
