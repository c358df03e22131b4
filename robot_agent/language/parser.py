"""Program text to statements. All mistakes are found in one pass and reported together."""

import math
import re
from collections.abc import Callable, Collection
from dataclasses import dataclass

from robot_agent.language.program import (
    End,
    Goto,
    Home,
    Label,
    MoveJoints,
    MoveLine,
    Program,
    ProgramError,
    ProgramProblem,
    Statement,
    Wait,
)

_WORD = re.compile(r"[^\s=]+(?:\s*=\s*[^\s=]+)?")
_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]*\Z")
_MAX_WAIT_S = 3600.0
_MAX_JUMPS = 1_000_000
_COORDINATES = ("X", "Y", "Z", "A", "B", "C")


@dataclass(frozen=True, slots=True)
class _Word:
    text: str
    column: int

    @property
    def pair(self) -> tuple[str, str] | None:
        name, equals, value = self.text.partition("=")
        return (name.strip().upper(), value.strip()) if equals else None


class _Mistake(Exception):
    def __init__(self, column: int, found: str, allowed: str) -> None:
        super().__init__(found)
        self.column, self.found, self.allowed = column, found, allowed


def parse_program(text: str, name: str, joint_names: tuple[str, ...], linear: Collection[str] = frozenset()) -> Program:
    """Parse a program.

    `joint_names` are the joints that `MJ` may name; joint values are degrees, or millimetres for the joints in
    `linear`, lengths millimetres, speeds percent of the joint limits (`MJ`, `HOME`) or mm/s (`ML`). Raises
    `ProgramError` with every mistake.
    """
    return _Parser(name, joint_names, linear).parse(text)


class _Parser:
    def __init__(self, name: str, joint_names: tuple[str, ...], linear: Collection[str]) -> None:
        self._name = name
        self._joints = joint_names
        self._linear = linear
        self._problems: list[ProgramProblem] = []
        self._labels: dict[str, int] = {}
        self._jumps: list[tuple[int, int, _Word, int | None]] = []
        self._statements: list[Statement] = []
        self._kinds: dict[str, Callable[[int, list[_Word]], None]] = {
            "MJ": self._move_joints,
            "ML": self._move_line,
            "HOME": self._home,
            "WAIT": self._wait,
            "LABEL": self._label,
            "GOTO": self._goto,
            "END": self._end,
        }

    def parse(self, text: str) -> Program:
        lines = text.splitlines()
        for number, line in enumerate(lines, 1):
            words = [_Word(m.group(), m.start() + 1) for m in _WORD.finditer(line.split(";")[0])]
            if not words:
                continue
            try:
                self._statement(number, words)
            except _Mistake as mistake:
                self._problems.append(ProgramProblem(number, mistake.column, mistake.found, mistake.allowed))
        self._resolve_jumps()
        if not self._statements and not self._problems:
            self._problems.append(ProgramProblem(1, 1, "a program without statements", "at least one statement"))
        if self._problems:
            problems = sorted(self._problems, key=lambda p: (p.line, p.column))
            raise ProgramError(self._name, tuple(problems))
        return Program(self._name, tuple(self._statements), tuple(lines))

    def _statement(self, line: int, words: list[_Word]) -> None:
        head = words[0]
        kind = self._kinds.get(head.text.upper())
        if kind is None:
            raise _Mistake(head.column, f"`{head.text}`", f"one of {', '.join(self._kinds)}")
        kind(line, words)

    def _move_joints(self, line: int, words: list[_Word]) -> None:
        named = self._numbers(words, (*self._joints, "F"))
        speed = self._percent(named.pop("F", None), words[0])
        if not named:
            raise _Mistake(words[0].column, "MJ without a joint", f"at least one of {', '.join(self._joints)}")
        joints = tuple(self._joint(joint, named[joint][0]) if joint in named else None for joint in self._joints)
        self._statements.append(MoveJoints(line, joints, speed))

    def _joint(self, name: str, value: float) -> float:
        return value / 1000.0 if name in self._linear else math.radians(value)

    def _move_line(self, line: int, words: list[_Word]) -> None:
        named = self._numbers(words, (*_COORDINATES, "F"))
        feed = named.pop("F", None)
        if feed is not None and feed[0] <= 0:
            raise _Mistake(feed[1].column, f"F={feed[0]:g}", "a speed above 0 in mm/s")
        if not named:
            raise _Mistake(words[0].column, "ML without a coordinate", f"at least one of {', '.join(_COORDINATES)}")
        angles = [axis for axis in "ABC" if axis in named]
        if angles and len(angles) < 3:
            word = named[angles[0]][1]
            raise _Mistake(word.column, f"only {' '.join(angles)}", "all of A, B, C, or none to keep the orientation")
        x, y, z = (named[axis][0] / 1000.0 if axis in named else None for axis in "XYZ")
        a, b, c = (math.radians(named[axis][0]) if angles else 0.0 for axis in "ABC")
        speed = feed[0] / 1000.0 if feed is not None else None
        self._statements.append(MoveLine(line, (x, y, z), (a, b, c) if angles else None, speed))

    def _home(self, line: int, words: list[_Word]) -> None:
        named = self._numbers(words, ("F",))
        self._statements.append(Home(line, self._percent(named.get("F"), words[0])))

    def _wait(self, line: int, words: list[_Word]) -> None:
        word = self._only_argument(words, "a time in seconds")
        duration_s = _number(word.text, word)
        if not 0 <= duration_s <= _MAX_WAIT_S:
            raise _Mistake(word.column, f"WAIT {word.text}", f"0 to {_MAX_WAIT_S:g} s")
        self._statements.append(Wait(line, duration_s))

    def _label(self, line: int, words: list[_Word]) -> None:
        word = self._only_argument(words, "a name")
        if not _NAME.match(word.text):
            raise _Mistake(word.column, f"`{word.text}`", "a name of letters, digits and _, starting with a letter")
        if word.text in self._labels:
            raise _Mistake(word.column, f"label `{word.text}` a second time", "each label once")
        self._statements.append(Label(line, word.text))
        self._labels[word.text] = len(self._statements)

    def _goto(self, line: int, words: list[_Word]) -> None:
        if len(words) not in (2, 3):
            raise _Mistake(words[0].column, f"{len(words) - 1} words behind GOTO", "a label and, if wanted, a count")
        count = None
        if len(words) == 3:
            number = _number(words[2].text, words[2])
            if number != int(number) or not 1 <= number <= _MAX_JUMPS:
                raise _Mistake(words[2].column, f"count {words[2].text}", f"a whole number, 1 to {_MAX_JUMPS}")
            count = int(number)
        self._jumps.append((len(self._statements), line, words[1], count))
        self._statements.append(Goto(line, 0, count))

    def _end(self, line: int, words: list[_Word]) -> None:
        if len(words) > 1:
            raise _Mistake(words[1].column, f"`{words[1].text}` behind END", "nothing")
        self._statements.append(End(line))

    def _resolve_jumps(self) -> None:
        for index, line, word, count in self._jumps:
            target = self._labels.get(word.text)
            if target is None:
                allowed = f"a label of this program: {', '.join(sorted(self._labels)) or 'it has none'}"
                self._problems.append(ProgramProblem(line, word.column, f"unknown label `{word.text}`", allowed))
            else:
                self._statements[index] = Goto(line, target, count)

    def _numbers(self, words: list[_Word], allowed: tuple[str, ...]) -> dict[str, tuple[float, _Word]]:
        """`NAME=value` words by name, each name once and out of `allowed`."""
        named: dict[str, tuple[float, _Word]] = {}
        for word in words[1:]:
            if word.pair is None or word.pair[0] not in {name.upper() for name in allowed}:
                raise _Mistake(word.column, f"`{word.text}`", f"NAME=value with a name out of {', '.join(allowed)}")
            name, value = word.pair
            if name in named:
                raise _Mistake(word.column, f"{name} a second time", "each name once")
            named[name] = (_number(value, word), word)
        return named

    @staticmethod
    def _percent(feed: tuple[float, _Word] | None, head: _Word) -> float:
        if feed is None:
            return 1.0
        percent, word = feed
        if not 0 < percent <= 100:
            raise _Mistake(word.column, f"F={percent:g}", f"above 0 to 100 percent for {head.text.upper()}")
        return percent / 100.0

    @staticmethod
    def _only_argument(words: list[_Word], what: str) -> _Word:
        if len(words) != 2:
            raise _Mistake(words[0].column, f"{len(words) - 1} words behind {words[0].text.upper()}", what)
        return words[1]


def _number(text: str, word: _Word) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise _Mistake(word.column, f"`{text}`", "a finite number")
    return value
