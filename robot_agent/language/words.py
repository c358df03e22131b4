"""The words of a statement, and what is wrong with one."""

import math
import re
from collections.abc import Collection
from dataclasses import dataclass
from difflib import get_close_matches
from itertools import islice

_WORD = re.compile(r"[^\s=]+(?:\s*=\s*[^\s=]+)?")
_LABEL = re.compile(r"\s*([A-Za-z_][A-Za-z0-9_]*)\s*:(?!\S)")
COMMENT = re.compile(r";|//")
"""From here to the end of its line."""
_SHORT = re.compile(r"(FC|FA|FJ|F|R|H)([+-]?[0-9.]+)\Z", re.IGNORECASE)
_BY_LETTER = re.compile(r"([TZ])(?:[0-9]+|\s*=.*)\Z", re.IGNORECASE)
_FLAG = re.compile(r"(M)([0-9]+)\Z", re.IGNORECASE)
_MOVES = frozenset({"MJ", "ML", "MC", "MS", "HOME"})


@dataclass(frozen=True, slots=True)
class Word:
    """A word, or NAME=value, and the column where it begins."""

    text: str
    column: int

    @property
    def pair(self) -> tuple[str, str] | None:
        """Name in upper case and value, of `F=100` and of `F100`; None for a plain word."""
        name, equals, value = self.text.partition("=")
        if equals:
            return name.strip().upper(), value.strip()
        short = _SHORT.match(self.text)
        return None if short is None else (short[1].upper(), short[2])

    @property
    def statement(self) -> str:
        """As what a statement that begins so is registered: `T=` for `T=name` and `T1`."""
        letter = _BY_LETTER.match(self.text)
        return f"{letter[1].upper()}=" if letter else self.text.upper()


def statements_in(written: str) -> list[list[Word]]:
    """The words of each statement on a line without its comment: each `name:` in front of one is a label of its own."""
    found, begin = list[list[Word]](), 0
    while label := _LABEL.match(written, begin):
        begin = label.end()
        found.append([Word("LABEL", label.start(1) + 1), Word(label.group(1), label.start(1) + 1)])
    words = [Word(match.group(), match.start() + 1) for match in _WORD.finditer(written, begin)]
    return [*found, _numbered(words)] if words else found


def _numbered(words: list[Word]) -> list[Word]:
    """With `M5` as `M 5`, and `T 1` as `T1`."""
    head, *others = words
    if flag := _FLAG.match(head.text):
        return [Word(flag[1], head.column), Word(flag[2], head.column), *others]
    if head.text.upper() == "T" and others and others[0].text.isdecimal():
        return [Word(f"{head.text}{others[0].text}", head.column), *others[1:]]
    return words


def tool_first(words: list[Word], joints: Collection[str]) -> list[list[Word]]:
    """The statements that the words of one are: a tool on the line of a move is the `T` before it."""
    tool = next((word for word in words[1:] if word.statement == "T="), None)
    if tool is None or words[0].text.upper() not in _MOVES or "T" in {joint.upper() for joint in joints}:
        return [words]
    return [[tool], [word for word in words if word is not tool]]


_MOST_NAMED, _MOST_COMPARED = 30, 500
"""Names that one mistake lists, and among which the nearest is looked for: a long program may have one in each line."""


class Mistake(Exception):
    """What was found at a column of the present line, and what is allowed."""

    def __init__(self, column: int, found: str, allowed: str) -> None:
        super().__init__(found)
        self.column, self.found, self.allowed = column, found, allowed


def nearest(text: str, known: Collection[str]) -> str:
    """The name that was meant, as the end of a sentence; empty when none is near."""
    near = get_close_matches(text, known, n=1) if len(known) <= _MOST_COMPARED else []
    return f"; nearest: {near[0]}" if near else ""


def unknown(word: Word, kind: str, known: Collection[str], allowed: str, none: str) -> Mistake:
    """That nothing of this kind has this name, and which there are; `none` says so of none."""
    more = f", and {len(known) - _MOST_NAMED} more" if len(known) > _MOST_NAMED else ""
    names = ", ".join(islice(sorted(known), _MOST_NAMED)) + more or none
    return Mistake(word.column, f"unknown {kind} `{word.text}`", f"{allowed}: {names}{nearest(word.text, known)}")


SLOWEST = 0.01
"""Percent and deg/s: a slower motion would take days, and nobody means one."""

FARTHEST_MM, MOST_DEG = 100_000.0, 36_000.0
"""No coordinate is 100 m away and nothing turns a hundred rounds; what is named beyond is a mistake in typing."""

Named = dict[str, tuple[float, Word]]
"""Values by name, each with its word."""


def number(text: str, word: Word) -> float:
    """A finite number, or Mistake."""
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise Mistake(word.column, f"`{text}`", "a finite number")
    return value


def signal_name(words: list[Word], at: int, letters: str) -> tuple[Word, int] | None:
    """The name of an input (DI) or output (DO) that begins with the word `at`, and the index of the word after it.

    A number stands for the letters and it: `DO 3` and `DO3` name do3. None where there is no such name.
    """
    if at < len(words) and re.fullmatch(rf"{letters}[0-9]+", words[at].text, re.IGNORECASE):
        return Word(words[at].text.lower(), words[at].column), at + 1
    if at + 1 >= len(words) or words[at].text.upper() != letters:
        return None
    word = words[at + 1]
    return (Word(f"{letters.lower()}{word.text}", word.column) if re.fullmatch("[0-9]+", word.text) else word), at + 2


def named_numbers(words: list[Word], allowed: tuple[str, ...]) -> Named:
    """The `NAME=value` words after the first by name, each name once and out of `allowed`."""
    named: Named = {}
    for word in words[1:]:
        if word.pair is None or word.pair[0] not in {name.upper() for name in allowed}:
            raise Mistake(word.column, f"`{word.text}`", f"NAME=value with a name out of {', '.join(allowed)}")
        name, value = word.pair
        if name in named:
            raise Mistake(word.column, f"{name} a second time", "each name once")
        named[name] = (number(value, word), word)
    return named


def check_size(named: Named, names: Collection[str], largest: float, unit: str) -> None:
    """Whether the values named by these names are between `largest` and its negative; or Mistake."""
    for name in names:
        if name in named and abs(named[name][0]) > largest:
            word = named[name][1]
            raise Mistake(word.column, f"`{word.text}`", f"-{largest:g} to {largest:g} {unit}")


def percent(feed: tuple[float, Word], head: Word) -> float:
    """A speed in percent as a fraction."""
    value, word = feed
    if not SLOWEST <= value <= 100:
        raise Mistake(
            word.column,
            f"{head.text.upper()} {value:g}" if word.pair is None else f"F={value:g}",
            f"{SLOWEST:g} to 100 percent for {head.text.upper()}",
        )
    return value / 100.0
