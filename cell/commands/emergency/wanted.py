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
    file_given: bool = False
    """`file` was named; else it is what lies in the folder or the environment, which tells nothing of `endpoints`."""
    reason: str = "operator"
    endpoints: tuple[str, ...] = ()
    state_dir: Path | None = None
    ignored: tuple[str, ...] = ()
    """Words that mean nothing here. They keep no stop from going out."""


def wanted(words: Sequence[str]) -> Wanted:
    """The words after `cell estop`, in the forms that the other commands take; nothing in them is an error."""
    found: dict[str, list[str]] = {option: [] for option in (_FILE, _REASON, _CONNECT, _STATE_DIR)}
    ignored: list[str] = []
    rest = iter(words)
    for word in rest:
        if word.startswith("--"):
            option, equals, value = word.partition("=")
            in_word = bool(equals)
        else:
            option, value = _SHORT.get(word[:2], ""), word[2:]
            in_word = bool(value)
        if option not in found:
            ignored.append(word)
        elif value := value if in_word else next(rest, ""):
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


def _absolute(file: str) -> Path:
    try:
        return Path(file).absolute()
    except OSError:  # the working folder is gone
        return Path(file)
