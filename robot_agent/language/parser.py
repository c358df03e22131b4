"""Program text to statements. All mistakes are found in one pass and reported together."""

import math
import re
from collections.abc import Callable, Collection

from robot_agent.language.moves import pace_of, parse_move
from robot_agent.language.program import (
    End,
    Goto,
    Home,
    Label,
    Program,
    ProgramError,
    ProgramProblem,
    SetOutput,
    Statement,
    Tangent,
    Track,
    Wait,
)
from robot_agent.language.words import MOST_DEG, Mistake, Word, check_size, named_numbers, number, percent

_WORD = re.compile(r"[^\s=]+(?:\s*=\s*[^\s=]+)?")
_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]*\Z")
_MAX_WAIT_S = 3600.0
_MAX_JUMPS = 1_000_000


def parse_program(
    text: str,
    name: str,
    joint_names: tuple[str, ...],
    linear: Collection[str] = frozenset(),
    corrections: Collection[str] | None = None,
    outputs: Collection[str] | None = None,
) -> Program:
    """Parse a program.

    `joint_names` are the joints that `MJ` may name; joint values are degrees, or millimetres for the joints in
    `linear`, lengths millimetres, speeds percent of the joint limits (`MJ`, `HOME`) or mm/s (`ML`, `MC`, `MS`).
    `corrections` are the names that `TRACK` may use, `outputs` those of `SET DO` and `RESET DO`, `None` for any.
    Raises `ProgramError` with every mistake.
    """
    return _Parser(name, joint_names, linear, corrections, outputs).parse(text)


def _visible(text: str) -> str:
    """Characters that nobody sees by their number, as an editor for programs shows them."""
    return "".join(each if each.isprintable() else f"<U+{ord(each):04X}>" for each in text)


class _Parser:
    def __init__(
        self,
        name: str,
        joint_names: tuple[str, ...],
        linear: Collection[str],
        corrections: Collection[str] | None,
        outputs: Collection[str] | None,
    ) -> None:
        self._name = name
        self._joints = joint_names
        self._linear = linear
        self._corrections = corrections
        self._outputs = outputs
        self._problems: list[ProgramProblem] = []
        self._labels: dict[str, int] = {}
        self._jumps: list[tuple[int, int, Word, int | None]] = []
        self._statements: list[Statement] = []
        self._kinds: dict[str, Callable[[int, list[Word]], None]] = {
            "MJ": self._move,
            "ML": self._move,
            "MC": self._move,
            "MS": self._move,
            "HOME": self._home,
            "TANG": self._tangent,
            "TRACK": self._track,
            "SET": self._switch,
            "RESET": self._switch,
            "WAIT": self._wait,
            "LABEL": self._label,
            "GOTO": self._goto,
            "END": self._end,
        }

    def parse(self, text: str) -> Program:
        lines = text.splitlines()
        for place, line in enumerate(lines, 1):
            words = [Word(m.group(), m.start() + 1) for m in _WORD.finditer(line.split(";")[0])]
            if not words:
                continue
            try:
                self._statement(place, words)
            except Mistake as mistake:
                self._problems.append(ProgramProblem(place, mistake.column, _visible(mistake.found), mistake.allowed))
        self._resolve_jumps()
        if not self._statements and not self._problems:
            self._problems.append(ProgramProblem(1, 1, "a program without statements", "at least one statement"))
        if self._problems:
            problems = sorted(self._problems, key=lambda p: (p.line, p.column))
            raise ProgramError(self._name, tuple(problems))
        return Program(self._name, tuple(self._statements), tuple(lines))

    def _statement(self, line: int, words: list[Word]) -> None:
        head = words[0]
        kind = self._kinds.get(head.text.upper())
        if kind is None:
            raise Mistake(head.column, f"`{head.text}`", f"one of {', '.join(self._kinds)}")
        kind(line, words)

    def _move(self, line: int, words: list[Word]) -> None:
        self._statements.append(parse_move(line, words, self._joints, self._linear))

    def _home(self, line: int, words: list[Word]) -> None:
        named = named_numbers(words, ("F", "FC", "FA", "FJ", "R"))
        speed = percent(named.pop("F", None), words[0])
        self._statements.append(Home(line, speed, pace_of(named)))

    def _tangent(self, line: int, words: list[Word]) -> None:
        allowed = "TANG 1, with H=degrees if wanted, or TANG 0"
        switch = words[1].text if len(words) > 1 else ""
        if switch not in ("0", "1"):
            raise Mistake(words[min(1, len(words) - 1)].column, f"`{' '.join(w.text for w in words)}`", allowed)
        named = named_numbers(words[1:], ("H",))
        if named and switch == "0":
            raise Mistake(named["H"][1].column, f"`{named['H'][1].text}` behind TANG 0", allowed)
        check_size(named, "H", MOST_DEG, "degrees")
        angle = math.radians(named["H"][0]) if named else 0.0
        self._statements.append(Tangent(line, angle if switch == "1" else None))

    def _track(self, line: int, words: list[Word]) -> None:
        word = self._only_argument(words, "the name of a correction, or OFF")
        if word.text.upper() == "OFF":
            self._statements.append(Track(line, None))
            return
        if self._corrections is not None and word.text not in self._corrections:
            known = ", ".join(sorted(self._corrections)) or "this robot has none in the cell file"
            raise Mistake(word.column, f"unknown correction `{word.text}`", f"OFF or a name of corrections: {known}")
        self._statements.append(Track(line, word.text))

    def _switch(self, line: int, words: list[Word]) -> None:
        if len(words) != 3 or words[1].text.upper() != "DO":
            found = f"`{' '.join(word.text for word in words)}`"
            raise Mistake(words[0].column, found, f"{words[0].text.upper()} DO and the name of an output")
        word = words[2]
        if self._outputs is not None and word.text not in self._outputs:
            known = ", ".join(sorted(self._outputs)) or "this robot has none in its drives file"
            raise Mistake(word.column, f"unknown output `{word.text}`", f"a name of outputs: {known}")
        self._statements.append(SetOutput(line, word.text, words[0].text.upper() == "SET"))

    def _wait(self, line: int, words: list[Word]) -> None:
        word = self._only_argument(words, "a time in seconds")
        duration_s = number(word.text, word)
        if not 0 <= duration_s <= _MAX_WAIT_S:
            raise Mistake(word.column, f"WAIT {word.text}", f"0 to {_MAX_WAIT_S:g} s")
        self._statements.append(Wait(line, duration_s))

    def _label(self, line: int, words: list[Word]) -> None:
        word = self._only_argument(words, "a name")
        if not _NAME.match(word.text):
            raise Mistake(word.column, f"`{word.text}`", "a name of letters, digits and _, starting with a letter")
        if word.text in self._labels:
            raise Mistake(word.column, f"label `{word.text}` a second time", "each label once")
        self._statements.append(Label(line, word.text))
        self._labels[word.text] = len(self._statements)

    def _goto(self, line: int, words: list[Word]) -> None:
        if len(words) not in (2, 3):
            raise Mistake(words[0].column, f"{len(words) - 1} words behind GOTO", "a label and, if wanted, a count")
        count = None
        if len(words) == 3:
            value = number(words[2].text, words[2])
            if value != int(value) or not 1 <= value <= _MAX_JUMPS:
                raise Mistake(words[2].column, f"count {words[2].text}", f"a whole number, 1 to {_MAX_JUMPS}")
            count = int(value)
        self._jumps.append((len(self._statements), line, words[1], count))
        self._statements.append(Goto(line, 0, count))

    def _end(self, line: int, words: list[Word]) -> None:
        if len(words) > 1:
            raise Mistake(words[1].column, f"`{words[1].text}` behind END", "nothing")
        self._statements.append(End(line))

    def _resolve_jumps(self) -> None:
        for index, line, word, count in self._jumps:
            target = self._labels.get(word.text)
            if target is None:
                allowed = f"a label of this program: {', '.join(sorted(self._labels)) or 'it has none'}"
                self._problems.append(ProgramProblem(line, word.column, f"unknown label `{word.text}`", allowed))
            else:
                self._statements[index] = Goto(line, target, count)

    @staticmethod
    def _only_argument(words: list[Word], what: str) -> Word:
        if len(words) != 2:
            raise Mistake(words[0].column, f"{len(words) - 1} words behind {words[0].text.upper()}", what)
        return words[1]
