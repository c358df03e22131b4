"""The keys of a cell (`docs/architecture.md`, section 4); those of its state messages are in the register `STATES`.

Every key starts with `cell/<cell>/`, so one subscriber on `cell/<cell>/**` sees the whole cell.
"""

import re
from dataclasses import dataclass
from functools import lru_cache

from cell.messages import STATES

ROOT = "cell"
_MOST_KEYS = 1000
"""Whose kind of message is remembered."""
_NAME = re.compile(r"[A-Za-z0-9_.-]+")


@dataclass(frozen=True, slots=True)
class Alive:
    """What a liveliness token's key says: one running process."""

    role: str
    name: str
    boot: str


class Keys:
    """The keys of one cell."""

    def __init__(self, cell: str) -> None:
        if not _NAME.fullmatch(cell):
            raise ValueError(f"a cell's name is letters, digits, '_', '-' and '.', found {cell!r}")
        self.cell = cell
        self.prefix = f"{ROOT}/{cell}/"
        self._kinds = lru_cache(_MOST_KEYS)(_kind_of)

    def of(self, message: object) -> str:
        """The key on which `message` travels. Raises `TypeError` for what is no state message."""
        state = STATES.get(type(message))
        if state is None:
            raise TypeError(f"{type(message).__name__} is no state message; calls go through ask() and answer()")
        return self.prefix + state.key_of(message)

    def type_of(self, key: str) -> type | None:
        """The message class that travels on `key`; None when it is no state key of this cell."""
        if not key.startswith(self.prefix):
            return None
        return self._kinds(key[len(self.prefix) :])

    def bundle(self, role: str, name: str) -> str:
        """The key on which a process tells its large streams in bundles; both may be `*`."""
        return f"{self.prefix}bundle/{role}/{name}"

    def alive(self, role: str, name: str, boot: str) -> str:
        """The key of a process' liveliness token."""
        return f"{self.prefix}alive/{role}/{name}/{boot}"

    def alive_of(self, key: str) -> Alive | None:
        """The process behind a liveliness token's key; None for other keys."""
        start = f"{self.prefix}alive/"
        chunks = key[len(start) :].split("/")
        return Alive(*chunks) if key.startswith(start) and len(chunks) == 3 and all(chunks) else None

    def command(self, to: str, verb: str) -> str:
        """The key of a call; `to` is `"manager"`, `"robot/<r>"` or `"gateway/<g>"`, `verb` may be `*`."""
        return f"{self.prefix}{to}/cmd/{verb}"


def _kind_of(key: str) -> type | None:
    """By the key below that of the cell."""
    return next((kind for kind, state in STATES.items() if state.pattern.fullmatch(key)), None)
