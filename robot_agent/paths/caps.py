"""What every move may be told besides its target."""

import math
from dataclasses import dataclass

SLOWEST = 1e-7
"""[m/s, rad/s] of a cap: a motion that creeps more takes months, and its numbers have no digits left."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Caps:
    """Caps on the TCP's rotation and the joints' speed, and what happens where the move meets the next one.

    `None`: nothing is asked.
    Each move names its cap on the speed, `speed_m_s`, itself. The slower of all caps and limits rules.
    """

    rotation_rad_s: float | None = None
    joint_speed_rad_s: float | None = None
    """Cap on the joints' own speed: the root of the sum of the squares, of the joints that turn."""
    round_m: float | None = None
    """`None`: stop at the end unless the next move goes on in the same direction. 0: stop in any case. More: cut the
    corner, from so far before it to so far after it, each at most half of its move."""

    def check(self, kind: str, line: int, speed_m_s: float | None) -> None:
        """Raise ValueError for values that make no sense."""
        caps = ("speed", speed_m_s), ("rotation", self.rotation_rad_s), ("joint speed", self.joint_speed_rad_s)
        for name, value in caps:
            if value is not None and not value >= SLOWEST:
                raise ValueError(f"{kind} move, line {line}: {name} {value} found, allowed from {SLOWEST}")
        if self.round_m is not None and not (self.round_m >= 0.0 and math.isfinite(self.round_m)):
            raise ValueError(f"{kind} move, line {line}: round edge {self.round_m} m found, allowed from 0")


@dataclass(frozen=True, slots=True)
class Tolerance:
    """How far the TCP may pass beside lines and arcs, and beside their orientation, where that spares it a stop."""

    distance_m: float
    angle_rad: float


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class TcpCaps(Caps):
    """The same for a move of the TCP."""

    tangential_rad: float | None = None
    """The tool follows the direction of the path, at this angle to it (see `paths.tangential`); `None`: it turns from
    orientation to orientation as programmed."""
    tolerance: Tolerance | None = None
    """Of lines and arcs. `None`: the path is theirs."""

    def check(self, kind: str, line: int, speed_m_s: float | None) -> None:
        """Raise ValueError for values that make no sense."""
        Caps.check(self, kind, line, speed_m_s)
        if self.tangential_rad is not None and not math.isfinite(self.tangential_rad):
            raise ValueError(f"{kind} move, line {line}: angle of the tool {self.tangential_rad} found, allowed finite")
        given = self.tolerance
        if given is not None and not (0.0 < given.distance_m < math.inf and 0.0 < given.angle_rad < math.inf):
            raise ValueError(f"{kind} move, line {line}: tolerance {given} found, allowed finite values above 0")
