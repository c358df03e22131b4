"""A network that is as bad as its seed says: every copy of a message has its own fate."""

import random
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Weather:
    """How bad the network is."""

    loss: float = 0.05
    """Share of the messages that are lost."""
    double: float = 0.02
    """Share of the messages that arrive twice."""
    late: float = 0.02
    """Share of the messages that are held up for up to `late_s`, long enough to be overtaken by many others."""
    late_s: float = 0.3
    usual_s: float = 0.002


class Network:
    """Decides the fate of each message."""

    def __init__(self, weather: Weather, rng: random.Random) -> None:
        self._rng = rng
        self.weather = weather

    def delays(self) -> list[float]:
        """The delays [s] of the copies that arrive: none when the message is lost."""
        copies = 2 if self._rng.random() < self.weather.double else 1
        return [self._delay() for _ in range(copies) if self._rng.random() >= self.weather.loss]

    def _delay(self) -> float:
        if self._rng.random() < self.weather.late:
            return self._rng.uniform(0.0, self.weather.late_s)
        return 0.0002 + self._rng.expovariate(1.0 / self.weather.usual_s)
