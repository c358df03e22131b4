"""What several messages share: the echo that proves freshness, and the token of a grant."""

from dataclasses import dataclass


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
