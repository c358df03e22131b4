"""The register of state messages: on which key each travels, and how urgent it is.

`@state` above the `@dataclass` of a message is all that its key, the codec, `cell schema` and the session ask for.
"""

import re
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum, auto
from typing import TypeVar

T = TypeVar("T")
_FIELD = re.compile(r"\{(\w+)\}")


class Urgency(Enum):
    """Which message overtakes which on the way, the most urgent first."""

    REAL_TIME = auto()
    INTERACTIVE = auto()
    HIGH = auto()
    NORMAL = auto()


@dataclass(frozen=True, slots=True)
class State:
    """How one kind of message travels."""

    key: str
    """Below `cell/<cell>/`, with the message's fields in braces: `robot/{robot}/state`."""
    urgency: Urgency
    fields: tuple[str, ...]
    """Those in its key."""
    pattern: re.Pattern[str]
    """Of the keys that belong to it."""

    @property
    def everybodys(self) -> str:
        """The key expression of all its keys: `robot/*/state`, `event/**`."""
        key = re.sub(r"\{\w+\}$", "**", self.key)
        return _FIELD.sub("*", key)

    def key_of(self, message: object) -> str:
        return self.key.format(**{field: getattr(message, field) for field in self.fields})


STATES: dict[type, State] = {}
"""By message class."""


def state(key: str, urgency: Urgency = Urgency.NORMAL, most_chunks: int = 1) -> Callable[[type[T]], type[T]]:
    """Register a message. A field in `key` fills one chunk of it, or up to `most_chunks`."""
    chunks = rf"[^/]+(?:/[^/]+){{0,{most_chunks - 1}}}"
    pattern = "".join(chunks if i % 2 else re.escape(part) for i, part in enumerate(_FIELD.split(key)))

    def register(kind: type[T]) -> type[T]:
        STATES[kind] = State(key, urgency, tuple(_FIELD.findall(key)), re.compile(pattern))
        return kind

    return register
