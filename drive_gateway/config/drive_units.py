"""Units in which a drive takes velocities and accelerations (CiA 402-2, user-defined units; SI unit objects)."""

import math
import re
from collections.abc import Callable
from dataclasses import dataclass

_SPEEDS = {
    "counts/s": ("counts", 1.0),
    "rpm": ("turns", 1.0 / 60.0),
    "rev/s": ("turns", 1.0),
    "deg/s": ("turns", 1.0 / 360.0),
    "rad/s": ("turns", 0.5 / math.pi),
    "mm/s": ("metres", 1e-3),
    "m/s": ("metres", 1.0),
}
"""What each of them counts, and how many of that in a second."""
_RAMPS = {
    "counts/s^2": _SPEEDS["counts/s"],
    "rpm/s": _SPEEDS["rpm"],
    "rev/s^2": _SPEEDS["rev/s"],
    "deg/s^2": _SPEEDS["deg/s"],
    "rad/s^2": _SPEEDS["rad/s"],
    "mm/s^2": _SPEEDS["mm/s"],
    "m/s^2": _SPEEDS["m/s"],
}
VELOCITY_UNITS, ACCELERATION_UNITS = ", ".join(_SPEEDS), ", ".join(_RAMPS)
_FORM = re.compile(r"(?:(?P<factor>[0-9.]+(?:e-?[0-9]+)?) )?(?P<unit>\S+)")

# SI unit objects 60A9h and 60AAh: power of ten, numerator, denominator (codes of CiA 303-2).
_NUMERATORS = {0xB5: ("counts", 1.0), 0xB4: ("turns", 1.0), 0x41: ("turns", 1.0 / 360.0),
               0x10: ("turns", 0.5 / math.pi), 0x01: ("metres", 1.0)}  # fmt: skip
_PER_SECOND, _PER_MINUTE, _PER_SECOND_SQUARED = 0x03, 0x47, 0x57
_RPM = 0xC0


@dataclass(frozen=True, slots=True)
class DriveUnits:
    """What one unit of a drive is in counts; the objects hold whole numbers of it."""

    velocity: float = 1.0
    """[counts/s] of 6081h, 6099h, 60B1h and 60FFh."""
    acceleration: float = 1.0
    """[counts/s^2] of 6083h, 6084h, 6085h and 609Ah."""
    velocity_name: str = "counts/s"
    acceleration_name: str = "counts/s^2"
    counts_per_turn: int = 0
    """Of the motor; 0: not known."""
    counts_per_metre: float = 0.0
    """Of an axis that slides."""

    def speed(self, counts_per_s: float) -> int:
        """The nearest number that the drive takes."""
        return round(counts_per_s / self.velocity)

    def ramp(self, counts_per_s2: float) -> int:
        """The nearest number that the drive takes."""
        return round(counts_per_s2 / self.acceleration)

    def shown_velocity(self, code: int) -> float | None:
        """[counts/s] that one unit is by 60A9h; `None`: the drive does not say it, or in no unit known here."""
        return self._shown(code, {_PER_SECOND: 1.0, _PER_MINUTE: 1.0 / 60.0})

    def shown_acceleration(self, code: int) -> float | None:
        """[counts/s^2] that one unit is by 60AAh; `None`: the drive does not say it, or in no unit known here."""
        if code >> 16 & 0xFF == _RPM and code >> 8 & 0xFF == _PER_SECOND:
            return self._shown(code & 0xFF000000 | 0xB4 << 16 | _PER_MINUTE << 8, {_PER_MINUTE: 1.0 / 60.0})
        return self._shown(code, {_PER_SECOND_SQUARED: 1.0})

    def _shown(self, code: int, denominators: dict[int, float]) -> float | None:
        power = code >> 24 & 0xFF
        numerator, denominator = _NUMERATORS.get(code >> 16 & 0xFF), denominators.get(code >> 8 & 0xFF)
        if numerator is None or denominator is None:
            return None
        size = _size(*numerator, self.counts_per_turn, self.counts_per_metre)
        return size * denominator * 10.0 ** (power - 256 if power > 127 else power) or None


COUNTS = DriveUnits()
"""As the simulated drive has them, and drives whose units nobody changed from those of CiA 402."""


def drive_units(velocity: str, acceleration: str, counts_per_turn: int, counts_per_metre: float) -> DriveUnits:
    """The units that a drives file names. `counts_per_metre` is 0 where the axis turns.

    Raises:
        ValueError: no unit of a drive.
    """
    return DriveUnits(
        velocity=_counts(velocity, _SPEEDS, counts_per_turn, counts_per_metre),
        acceleration=_counts(acceleration, _RAMPS, counts_per_turn, counts_per_metre),
        velocity_name=velocity,
        acceleration_name=acceleration,
        counts_per_turn=counts_per_turn,
        counts_per_metre=counts_per_metre,
    )


def unit_of(units: str) -> Callable[[str], str]:
    """Checks the form of a unit, a factor and one of `units`."""

    def checked(text: str) -> str:
        found = _FORM.fullmatch(text)
        if found is None or found["unit"] not in units.split(", ") or not 1e-6 <= _factor(found) <= 1e6:
            raise ValueError(f"one of {units}, with or without a factor (1e-6 to 1e6) before it, such as '0.1 rpm'")
        return text

    return checked


def _factor(found: re.Match[str]) -> float:
    try:
        return float(found["factor"] or 1.0)
    except ValueError:
        return 0.0


def _counts(text: str, units: dict[str, tuple[str, float]], per_turn: int, per_metre: float) -> float:
    found = _FORM.fullmatch(text)
    if found is None or found["unit"] not in units:
        raise ValueError(f"{text!r} is none of {', '.join(units)}")
    size = _factor(found) * _size(*units[found["unit"]], per_turn, per_metre)
    if not size:
        raise ValueError(f"{text!r} of an axis that turns")
    return size


def _size(of: str, share: float, per_turn: int, per_metre: float) -> float:
    return share * {"counts": 1.0, "turns": float(per_turn), "metres": per_metre}[of]
