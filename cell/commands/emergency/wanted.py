"""What the command line of `cell estop` asks for, whatever stands in it."""

import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from cell.commands.emergency.words import plain

_FILE, _REASON, _CONNECT, _STATE_DIR = "--file", "--reason", "--connect", "--state-dir"
_SHORT = {"-f": _FILE, "-e": _CONNECT}


@dataclass(frozen=True, slots=True)
class Wanted:
    """An emergency stop for the cell of `file`, through its doors and those of `endpoints`."""

    file: Path
    reason: str = "operator"
    endpoints: tuple[str, ...] = ()
    state_dir: Path | None = None
    ignored: tuple[str, ...] = ()
    """Words that mean nothing here. They keep no stop from going out."""


def wanted(words: Sequence[str]) -> Wanted:
    """The words after `cell estop`, in the forms that the other commands take; nothing in them is an error."""
    found: dict[str, list[str]] = {_FILE: [os.environ.get("ZENCELL_FILE") or "cell.yaml"], _REASON: ["operator"]}
    ignored: list[str] = []
    rest = iter(words)
    for word in rest:
        if word.startswith("--"):
            option, _, value = word.partition("=")
        else:
            option, value = _SHORT.get(word[:2], ""), word[2:]
        if option not in (_FILE, _REASON, _CONNECT, _STATE_DIR):
            ignored.append(word)
        elif value := value or next(rest, ""):
            found.setdefault(option, []).append(value)
    folders = found.get(_STATE_DIR)
    return Wanted(
        _absolute(found[_FILE][-1]),
        plain(found[_REASON][-1]) or "operator",
        tuple(map(plain, found.get(_CONNECT, ()))),
        Path(folders[-1]) if folders else None,
        tuple(map(plain, ignored)),
    )


def _absolute(file: str) -> Path:
    try:
        return Path(file).absolute()
    except OSError:  # the working folder is gone
        return Path(file)
