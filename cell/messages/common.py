"""What several messages share: the ranges of their fields, the echo that proves freshness, the token of a grant.

The ranges are part of the schema: what lies outside is refused where it is read (`cell.net.codec`), so that no core
ever meets a number whose square overflows, or a text without end. What else a value must be is the business of whoever
uses it, who can say why not.
"""

import math
from dataclasses import dataclass
from typing import Annotated

from annotated_types import Ge, Le, MaxLen

Name = Annotated[str, MaxLen(128)]
"""Of a robot, a zone, a process' run, a call, ..."""
Words = Annotated[str, MaxLen(2**17)]
"""What a person gives: a reason, who gives an order; as long as an argument of a command can be."""
Text = Annotated[str, MaxLen(2**19)]
"""What a process tells people; it may repeat their words."""
Few = MaxLen(1000)
"""As many as a cell may have of anything."""
Count = Annotated[int, Ge(0), Le(2**62)]
Whole = Annotated[int, Ge(-(2**62)), Le(2**62)]
Number = Annotated[float, Ge(-1e12), Le(1e12)]
Metres = Annotated[float, Ge(-1e6), Le(1e6)]
"""A coordinate."""
Length = Annotated[float, Ge(0.0), Le(1e6)]
"""[m]"""
Duration = Annotated[float, Ge(0.0), Le(1e9)]
"""[s]"""
Vector = tuple[Metres, Metres, Metres]

ECHO_S = 2.0
"""A process remembers so long when it sent which message; an older echo proves nothing, whatever age is allowed."""

_UNIT_TOLERANCE = 1e-6


def check_quaternion(quaternion_xyzw: tuple[float, float, float, float]) -> None:
    """Raises `ValueError` when the quaternion is no orientation."""
    norm = math.hypot(*quaternion_xyzw)
    if not abs(norm - 1.0) <= _UNIT_TOLERANCE:
        raise ValueError(f"quaternion_xyzw has length {norm:.9g}, allowed is 1 within {_UNIT_TOLERANCE:g}")


@dataclass(frozen=True, slots=True)
class Heard:
    """The newest message of a peer that the sender has received: the echo of `docs/architecture.md`, section 4.1."""

    boot: Name
    sequence: Count


@dataclass(frozen=True, slots=True, order=True)
class Token:
    """The fencing token of a zone grant. It only ever grows, over restarts of the manager too."""

    epoch: Count
    counter: Count

    def __str__(self) -> str:
        return f"{self.epoch}.{self.counter}"


@dataclass(frozen=True, slots=True)
class CellTime:
    """A moment by the cell clock: `cell_time` [s] of the manager whose `boot` this is; each manager starts at 0."""

    boot: Name
    seconds: Annotated[float, Ge(-1e9), Le(1e9)]


@dataclass(frozen=True, slots=True)
class TokenGone:
    """The liveliness token of a process went: it died or its link was cut. Delivered by the shell, never on a key."""

    role: str
    name: str
    boot: str


@dataclass(frozen=True, slots=True)
class ClockStatus:
    """What a process knows of cell time."""

    offset_s: Number
    """Cell time less the process' own clock, as its host counts from its start."""
    error_s: Duration
    """How far that is from the truth at most."""
