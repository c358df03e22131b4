"""A network that is as bad as its seed says: every copy of a message has its own fate, and links fail by direction."""

import random
from collections.abc import Callable, Collection
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


@dataclass(frozen=True, slots=True)
class _Trouble:
    """Something about the links from `frm` to `to` (a process, or "*") until a moment."""

    frm: str
    to: str
    until: float
    extra_s: float | None = None
    """Messages are so much later; None: they do not pass."""

    def meets(self, frm: str, to: str) -> bool:
        return self.frm in ("*", frm) and self.to in ("*", to)


@dataclass(frozen=True, slots=True)
class _Partition:
    """The members of the group and all others do not hear each other until a moment."""

    group: frozenset[str]
    until: float

    def meets(self, frm: str, to: str) -> bool:
        return (frm in self.group) is not (to in self.group)


class Network:
    """Decides the fate of each message; `now` tells the time [s]."""

    def __init__(self, weather: Weather, rng: random.Random, now: Callable[[], float]) -> None:
        self._rng = rng
        self._now = now
        self.weather = weather
        self._links: list[_Trouble] = []
        self._partitions: list[_Partition] = []
        self._bursts: list[tuple[float, float]] = []

    # Faults

    def cut(self, frm: str, to: str, seconds: float) -> None:
        """Nothing passes from one process to another; a name may be "*"."""
        self._links.append(_Trouble(frm, to, self._now() + seconds))

    def partition(self, group: Collection[str], seconds: float) -> None:
        """Nothing passes between the group and all others, in both directions."""
        self._partitions.append(_Partition(frozenset(group), self._now() + seconds))

    def delay(self, frm: str, to: str, extra_s: float, seconds: float) -> None:
        """Messages that are sent within the next `seconds` arrive `extra_s` later; a name may be "*"."""
        self._links.append(_Trouble(frm, to, self._now() + seconds, extra_s))

    def burst(self, loss: float, seconds: float) -> None:
        """At least this share of all messages is lost for a while."""
        self._bursts.append((loss, self._now() + seconds))

    def heal(self) -> None:
        """All faults end; the weather stays."""
        self._links, self._partitions, self._bursts = [], [], []

    # Fate

    def passes(self, frm: str, to: str) -> bool:
        """Whether the link in this direction is whole."""
        self._forget()
        cut = any(each.extra_s is None and each.meets(frm, to) for each in self._links)
        return not cut and not any(each.meets(frm, to) for each in self._partitions)

    def delays(self, frm: str, to: str) -> list[float]:
        """The delays [s] of the copies that arrive: none when the message is lost."""
        if not self.passes(frm, to):
            return []
        weather = self.weather
        loss = max([weather.loss, *(loss for loss, _ in self._bursts)])
        copies = 2 if self._rng.random() < weather.double else 1
        extra_s = sum(each.extra_s or 0.0 for each in self._links if each.meets(frm, to))
        return [self._delay() + extra_s for _ in range(copies) if self._rng.random() >= loss]

    def _delay(self) -> float:
        if self._rng.random() < self.weather.late:
            return self._rng.uniform(0.0, self.weather.late_s)
        return 0.0002 + self._rng.expovariate(1.0 / self.weather.usual_s)

    def _forget(self) -> None:
        now = self._now()
        self._links = [each for each in self._links if now < each.until]
        self._partitions = [each for each in self._partitions if now < each.until]
        self._bursts = [each for each in self._bursts if now < each[1]]
