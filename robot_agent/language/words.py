"""The words of a statement, and what is wrong with one."""

import math
import re
from collections.abc import Collection
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Word:
    """A word, or NAME=value, and the column where it begins."""

    text: str
    column: int

    @property
    def pair(self) -> tuple[str, str] | None:
        """Name in upper case and value; None for a plain word."""
        name, equals, value = self.text.partition("=")
        return (name.strip().upper(), value.strip()) if equals else None


class Mistake(Exception):
    """What was found at a column of the present line, and what is allowed."""

    def __init__(self, column: int, found: str, allowed: str) -> None:
        super().__init__(found)
        self.column, self.found, self.allowed = column, found, allowed


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

    A number stands for the letters and it: `DO 3` and `DO3` name DO3. None where there is no such name.
    """
    if at < len(words) and re.fullmatch(rf"{letters}[0-9]+", words[at].text, re.IGNORECASE):
        return Word(words[at].text.upper(), words[at].column), at + 1
    if at + 1 >= len(words) or words[at].text.upper() != letters:
        return None
    word = words[at + 1]
    return (Word(f"{letters}{word.text}", word.column) if re.fullmatch("[0-9]+", word.text) else word), at + 2


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


def percent(feed: tuple[float, Word] | None, head: Word) -> float:
    """A speed in percent as a fraction; 1 when none is given."""
    if feed is None:
        return 1.0
    value, word = feed
    if not SLOWEST <= value <= 100:
        raise Mistake(word.column, f"F={value:g}", f"{SLOWEST:g} to 100 percent for {head.text.upper()}")
    return value / 100.0
