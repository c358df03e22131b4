"""What is wrong with a configuration, with an address: file, line and column."""

import difflib
from collections.abc import Collection
from dataclasses import dataclass
from enum import Enum
from functools import partial
from itertools import islice
from pathlib import Path

Key = str | int
KeyPath = tuple[Key, ...]

_NEAREST = 3
_MOST_NAMED = 12
_MOST_COMPARED = 1000
"""To compare takes time for each name; a file may have a hundred thousand labels."""


class Severity(Enum):
    """An error refuses the configuration, a warning only says so."""

    ERROR = "error"
    WARNING = "warning"


@dataclass(frozen=True, slots=True)
class Problem:
    """One finding. `line` and `column` count from 1; `path` is the place in the file, like `robots.left.base.X`."""

    file: Path
    line: int
    column: int
    path: str
    found: str
    allowed: str
    severity: Severity = Severity.ERROR

    def __str__(self) -> str:
        mark = "warning: " if self.severity is Severity.WARNING else ""
        place = f"{shown(self.file)}:{self.line}:{self.column}"
        return f"{place}: {mark}{self.path}: found {self.found}, allowed {self.allowed}"


class ConfigError(Exception):
    """A configuration is refused; `problems` holds everything that was found, warnings included."""

    def __init__(self, problems: tuple[Problem, ...]) -> None:
        super().__init__("\n".join(map(str, problems)))
        self.problems = problems


def refuses(problems: tuple[Problem, ...] | list[Problem]) -> bool:
    """True when at least one of the problems is an error."""
    return any(problem.severity is Severity.ERROR for problem in problems)


def shown(file: Path) -> str:
    """The file's name as short as it stays unambiguous: relative when it lies below the working folder."""
    try:
        return str(file.relative_to(Path.cwd()))
    except (ValueError, OSError):
        return str(file)


def path_text(path: KeyPath) -> str:
    """`("zones", "a", "size", 1)` as `zones.a.size[1]`; the empty path is the file as a whole."""
    text = ""
    for key in path:
        text += f"[{key}]" if isinstance(key, int) else f".{key}" if text else key
    return text or "file"


def near(name: str, known: Collection[str], none: str) -> str:
    """What is allowed instead of an unknown name, for people: the nearest names first where there are some."""
    if not known:
        return none
    if len(known) > _MOST_COMPARED:
        return f"one of {', '.join(islice(known, _MOST_NAMED))}, {len(known) - _MOST_NAMED} more"
    folded = {each.casefold(): each for each in known}
    close = difflib.get_close_matches(name.casefold(), folded, _NEAREST)
    close = [*filter(partial(_one_letter_apart, name.casefold()), folded), *close]
    found = [folded[each] for each in dict.fromkeys(close)][:_NEAREST]
    others = [each for each in sorted(known) if each not in found]
    if not found:
        return f"one of {', '.join(others)}" if len(others) > 1 else f"only {others[0]}"
    return f"{' or '.join(found)}{f'; there are also {_few(others)}' if others else ''}"


def _one_letter_apart(name: str, known: str) -> bool:
    """Whether one letter of two and more was taken for another; of short names a share of letters tells too little."""
    return len(name) == len(known) > 1 and (name + known).isalpha() and sum(map(str.__ne__, name, known)) == 1


def _few(names: list[str]) -> str:
    return ", ".join(names if len(names) <= _MOST_NAMED else [*names[:_MOST_NAMED], f"{len(names) - _MOST_NAMED} more"])
