"""The encoder on the motor's shaft: whole counts over many turns, with noise and faults.

An incremental one is the same here: that its counter starts at zero is the drive's matter (`sim.reference`).
"""

from collections.abc import Callable
from dataclasses import dataclass
from math import floor, pi
from random import Random


@dataclass(frozen=True, slots=True)
class EncoderData:
    counts_per_turn: int
    turns: int = 65536
    """Turns that it tells apart without power, half of them on each side of zero; 16 bits are usual."""
    noise_counts: float = 0.0
    """Standard deviation of one reading."""


class Encoder:
    """Reads the shaft. `failed` is what its status says: no answer, a wrong checksum, an empty battery.

    Args:
        data: what encoder it is.
        shaft: its angle when it is switched on [rad].
        seed: of the noise.
    """

    def __init__(self, data: EncoderData, shaft: float, seed: int) -> None:
        self._per_rad = data.counts_per_turn / (2.0 * pi)
        self._half = data.counts_per_turn * data.turns // 2
        self._noise = data.noise_counts
        self._gauss: Callable[[float, float], float] = Random(seed).gauss
        self._shift = 0
        self.failed = False
        self.switch_on(shaft)

    def switch_on(self, shaft: float) -> None:
        """Power comes back: the turns wrap."""
        counts = floor(shaft * self._per_rad + 0.5)
        self._shift = (counts + self._half) % (2 * self._half) - self._half - counts

    def read(self, shaft: float) -> int:
        """Counts of the shaft at an angle [rad]."""
        exact = shaft * self._per_rad + 0.5
        if self._noise:
            exact += self._gauss(0.0, self._noise)
        return floor(exact) + self._shift

    def jump(self, counts: int) -> None:
        """From now on it reads wrong by so much more."""
        self._shift += counts
