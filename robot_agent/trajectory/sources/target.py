"""Where a correction shall be: measured offsets and a measured conveyor, filtered and extrapolated."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

_COUNTER = 2**32


@dataclass(frozen=True, slots=True, eq=False)
class Target:
    """An offset `(6,)` of the tool now, translation [m] and rotation vector [rad], and its speed `(6,)`."""

    offset: NDArray[np.float64]
    speed: NDArray[np.float64]

    @classmethod
    def none(cls) -> "Target":
        """The path as it is."""
        return cls(np.zeros(6), np.zeros(6))

    def after(self, seconds: float) -> "Target":
        """Where it is a while later."""
        return Target(self.offset + seconds * self.speed, self.speed)


class CriticallyDamped:
    """Position and speed of a noisy measurement, critically damped, without lag behind a constant speed.

    The two-state fading-memory filter: with b = exp(-dt / `settle_s`) a new value corrects the position by 1 - b^2 and
    the speed by (1 - b)^2 / dt of what was not foreseen (Brookner, Tracking and Kalman Filtering Made Easy, 1.2).
    """

    def __init__(self, settle_s: float) -> None:
        self._settle_s = settle_s
        self._at: float | None = None
        self._position = np.zeros(0)
        self._speed = np.zeros(0)

    def measured(self, value: NDArray[np.float64], at: float) -> None:
        """Take a value `(m,)` measured at `at` [s]; what is not newer than the last one is dropped."""
        if self._at is None:
            self._position, self._speed, self._at = value, np.zeros_like(value), at
            return
        passed_s = at - self._at
        if passed_s <= 0.0:
            return
        memory = math.exp(-passed_s / self._settle_s)
        foreseen = self._position + passed_s * self._speed
        surprise = value - foreseen
        self._position = foreseen + (1.0 - memory**2) * surprise
        self._speed = self._speed + (1.0 - memory) ** 2 / passed_s * surprise
        self._at = at

    @property
    def measured_at(self) -> float:
        """When the newest value was measured; minus infinity before the first."""
        return -math.inf if self._at is None else self._at

    def at(self, now: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Position and speed `(m,)` extrapolated to `now` [s]."""
        return self._position + (now - (self._at or now)) * self._speed, self._speed


class Stale(Exception):
    """A measurement is too old to move a robot by; says which and how old, for people."""


class SensorOffset:
    """Offsets that a sensor measures, as a target that stands still between measurements."""

    def __init__(self, name: str, settle_s: float, fresh_s: float) -> None:
        """`fresh_s`: older measurements are refused."""
        self._name = name
        self._fresh_s = fresh_s
        self._filter = CriticallyDamped(settle_s)

    def measured(self, offset: NDArray[np.float64], at: float) -> None:
        """An offset `(6,)` [m, rad] measured at `at` [s]."""
        self._filter.measured(offset, at)

    def target(self, now: float) -> Target:
        """Where the correction shall be at `now` [s]. Raises `Stale`."""
        _check_fresh(self._name, now - self._filter.measured_at, self._fresh_s)
        return Target(self._filter.at(self._filter.measured_at)[0], np.zeros(6))


class Conveyor:
    """A belt with an encoder: the offset by which a path that was programmed on the belt has travelled with it."""

    def __init__(
        self,
        name: str,
        pose_base_conveyor: NDArray[np.float64],
        metres_per_count: float,
        settle_s: float,
        fresh_s: float,
        largest_speed_m_s: float,
    ) -> None:
        """The belt runs along X of its measured frame `pose_base_conveyor` `(4, 4)`; `fresh_s` as for a sensor.

        The measured speed counts at most as `largest_speed_m_s`, whatever the encoder says.
        """
        self._name = name
        self._along = pose_base_conveyor[:3, 0]
        self._metres_per_count = metres_per_count
        self._fresh_s = fresh_s
        self._largest = largest_speed_m_s
        self._filter = CriticallyDamped(settle_s)
        self._last: int | None = None
        self._counts = 0
        self.part_m: float | None = None
        """Where the belt was [m] when the newest part passed the place at which it was taught; None when none has."""

    def measured(self, counts: int, at: float, part: int | None = None) -> None:
        """The encoder's 32-bit counter at `at` [s]; it may wrap around. At its first value the path is as taught.

        `part` is what it was when the newest part passed. What is not newer than what was measured last is dropped.
        """
        if at <= self._filter.measured_at:
            return
        if self._last is not None:
            self._counts += _way(self._last, counts)
        self._last = counts
        if part is not None:
            self.part_m = (self._counts + _way(counts, part)) * self._metres_per_count
        self._filter.measured(np.array([self._counts * self._metres_per_count]), at)

    def offset_at(self, place_m: float | NDArray[np.float64]) -> NDArray[np.float64]:
        """The offset `(6,)` that belongs to a place of the belt [m], or its speed to the belt's [m/s]."""
        return place_m * np.append(self._along, np.zeros(3))

    def target(self, now: float) -> Target:
        """Where the correction shall be at `now` [s], extrapolated with the measured speed. Raises `Stale`."""
        age_s = now - self._filter.measured_at
        _check_fresh(self._name, age_s, self._fresh_s)
        travelled, speed = self._filter.at(self._filter.measured_at)
        speed = np.clip(speed, -self._largest, self._largest)
        return Target(self.offset_at(travelled + age_s * speed), self.offset_at(speed))


def _way(before: int, behind: int) -> int:
    """From one value of the counter to another, the shorter way round."""
    return (behind - before + _COUNTER // 2) % _COUNTER - _COUNTER // 2


def _check_fresh(name: str, age_s: float, fresh_s: float) -> None:
    if age_s > fresh_s:
        age = "not measured yet" if age_s == math.inf else f"measured {age_s:.2f} s ago, allowed {fresh_s:g} s"
        raise Stale(f"{name}: {age}")
