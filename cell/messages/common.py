"""What several messages share: the echo that proves freshness, the token of a grant, and the end of a process."""

from dataclasses import dataclass

ECHO_S = 2.0
"""A process remembers so long when it sent which message; an older echo proves nothing, whatever age is allowed."""


@dataclass(frozen=True, slots=True)
class Heard:
    """The newest message of a peer that the sender has received: the echo of `docs/architecture.md`, section 4.1."""

    boot: str
    sequence: int


@dataclass(frozen=True, slots=True, order=True)
class Token:
    """The fencing token of a zone grant. It only ever grows, over restarts of the manager too."""

    epoch: int
    counter: int

    def __str__(self) -> str:
        return f"{self.epoch}.{self.counter}"


@dataclass(frozen=True, slots=True)
class CellTime:
    """A moment by the cell clock: `cell_time` [s] of the manager whose `boot` this is; each manager starts at 0."""

    boot: str
    seconds: float


@dataclass(frozen=True, slots=True)
class TokenGone:
    """The liveliness token of a process went: it died or its link was cut. Delivered by the shell, never on a key."""

    role: str
    name: str
    boot: str
