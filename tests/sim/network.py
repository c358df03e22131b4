"""A network that is as bad as its seed says: every copy of a message has its own fate, and links fail by direction."""

import random
from collections.abc import Collection
from dataclasses import dataclass

from tests.sim.clock import Clock


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
class _Fault:
    """Of the links from `frm` to `to` (a process, or "*") until a moment."""

    frm: str
    to: str
    until: float
    extra_s: float | None
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
    """Decides the fate of each message. Who sends or hears has the name of its process, or of its operator."""

    def __init__(self, weather: Weather, rng: random.Random, clock: Clock) -> None:
        self._rng = rng
        self._clock = clock
        self.weather = weather
        self._links: list[_Fault] = []
        self._partitions: list[_Partition] = []
        self._bursts: list[tuple[float, float]] = []
        self._next_end = float("inf")

    # Faults

    def cut(self, frm: str, to: str, seconds: float) -> None:
        """Nothing that is sent within the next `seconds` passes from one to the other; a name may be "*"."""
        self._links.append(_Fault(frm, to, self._until(seconds), None))

    def partition(self, group: Collection[str], seconds: float) -> None:
        """Nothing passes between the group and all others, in both directions."""
        self._partitions.append(_Partition(frozenset(group), self._until(seconds)))

    def delay(self, frm: str, to: str, extra_s: float, seconds: float) -> None:
        """What is sent within the next `seconds` arrives `extra_s` later; a name may be "*"."""
        self._links.append(_Fault(frm, to, self._until(seconds), extra_s))

    def burst(self, loss: float, seconds: float) -> None:
        """At least this share of all messages is lost for a while."""
        self._bursts.append((loss, self._until(seconds)))

    def heal(self) -> None:
        """All faults end; the weather stays, and what is under way arrives when it does."""
        self._links, self._partitions, self._bursts = [], [], []

    def _until(self, seconds: float) -> float:
        end = self._clock.now + seconds
        self._next_end = min(self._next_end, end)
        return end

    # Fate

    def passes(self, frm: str, to: str) -> bool:
        """Whether the link is whole in this direction."""
        self._forget()
        cut = any(fault.extra_s is None and fault.meets(frm, to) for fault in self._links)
        return not cut and not any(each.meets(frm, to) for each in self._partitions)

    def delays(self, frm: str, to: str) -> list[float]:
        """The delays [s] of the copies that arrive: none when the message is lost."""
        weather, draw = self.weather, self._rng.random
        loss, extra_s = weather.loss, 0.0
        if self._links or self._partitions or self._bursts:
            if not self.passes(frm, to):
                return []
            extra_s = self._extra_s(frm, to)
            loss = max([loss, *(worse for worse, _ in self._bursts)])
        copies = 2 if draw() < weather.double else 1
        return [self._delay() + extra_s for _ in range(copies) if draw() >= loss]

    def late(self, frm: str, to: str) -> float:
        """The delay [s] of what is never lost, only late."""
        self._forget()
        return self._delay() + self._extra_s(frm, to)

    def _extra_s(self, frm: str, to: str) -> float:
        return sum(fault.extra_s or 0.0 for fault in self._links if fault.meets(frm, to))

    def _delay(self) -> float:
        weather, draw = self.weather, self._rng.random
        if draw() < weather.late:
            return draw() * weather.late_s
        return 0.0002 + self._rng.expovariate(1.0 / weather.usual_s)

    def _forget(self) -> None:
        """Faults that are over."""
        now = self._clock.now
        if now < self._next_end:
            return
        self._links = [each for each in self._links if now < each.until]
        self._partitions = [each for each in self._partitions if now < each.until]
        self._bursts = [each for each in self._bursts if now < each[1]]
        ends = [fault.until for fault in (*self._links, *self._partitions)] + [end for _, end in self._bursts]
        self._next_end = min(ends, default=float("inf"))
