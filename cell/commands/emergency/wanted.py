"""What the command line of `cell estop` asks for, whatever stands in it."""

import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from cell.commands.emergency.words import plain

_FILE, _REASON, _CONNECT, _STATE_DIR = "--file", "--reason", "--connect", "--state-dir"
_OPTIONS = (_FILE, _REASON, _CONNECT, _STATE_DIR)
_SHORT = {"-f": _FILE, "-e": _CONNECT}


@dataclass(frozen=True, slots=True)
class Wanted:
    """An emergency stop for the cell of `file`, through its doors and those of `endpoints`."""

    file: Path
    file_given: bool = False
    """`file` was named; else it is what lies in the folder or the environment, which tells nothing of `endpoints`."""
    reason: str = "operator"
    endpoints: tuple[str, ...] = ()
    state_dir: Path | None = None
    ignored: tuple[str, ...] = ()
    """Words that mean nothing here. They keep no stop from going out."""


def wanted(words: Sequence[str]) -> Wanted:
    """The words after `cell estop`, in the forms that the other commands take; nothing in them is an error."""
    found: dict[str, list[str]] = {option: [] for option in _OPTIONS}
    ignored: list[str] = []
    rest = list(words)
    while rest:
        word = rest.pop(0)
        option, value = _option(word)
        if not option:
            ignored.append(word)
            continue
        if value is None:
            value = "" if not rest or rest[0] in _SHORT or rest[0].partition("=")[0] in _OPTIONS else rest.pop(0)
        if value:
            found[option].append(value)
    file, reason, folder = (found[option][-1] if found[option] else "" for option in (_FILE, _REASON, _STATE_DIR))
    return Wanted(
        _absolute(file or os.environ.get("ZENCELL_FILE") or "cell.yaml"),
        bool(file),
        plain(reason) or "operator",
        tuple(map(plain, found[_CONNECT])),
        Path(folder) if folder else None,
        tuple(map(plain, ignored)),
    )


def _option(word: str) -> tuple[str, str | None]:
    """The option that a word names, empty where it is none, and the value in the word, None where it comes after it."""
    if word.startswith("--"):
        option, equals, value = word.partition("=")
        return (option if option in _OPTIONS else "", value if equals else None)
    return _SHORT.get(word[:2], ""), word[2:] or None


def _absolute(file: str) -> Path:
    try:
        return Path(file).absolute()
    except OSError:  # the working folder is gone
        return Path(file)
