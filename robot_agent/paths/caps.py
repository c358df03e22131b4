"""What every move may be told besides its target."""

import math
from dataclasses import dataclass


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Caps:
    """A cap on the flange's rotation, and what happens where the move meets the next one. `None`: nothing is asked.

    Each move names its cap on the speed, `speed_m_s`, itself. The slower of all caps and limits rules.
    """

    rotation_rad_s: float | None = None
    round_m: float | None = None
    """`None`: stop at the end unless the next move goes on in the same direction. 0: stop in any case. More: cut the
    corner, from so far before it to so far behind it, each at most half of its move."""

    def check(self, kind: str, line: int, speed_m_s: float | None) -> None:
        """Raise ValueError for values that make no sense."""
        for name, value in (("speed", speed_m_s), ("rotation", self.rotation_rad_s)):
            if value is not None and not value > 0.0:
                raise ValueError(f"{kind} move, line {line}: {name} {value} found, allowed above 0")
        if self.round_m is not None and not (self.round_m >= 0.0 and math.isfinite(self.round_m)):
            raise ValueError(f"{kind} move, line {line}: round edge {self.round_m} m found, allowed from 0")
