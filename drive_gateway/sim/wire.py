"""The wire of a simulated bus: one frame at a time, the lowest identifier first, each as long as its bits last."""

import heapq
from dataclasses import dataclass

from drive_gateway.canopen.frame import CanFrame
from drive_gateway.canopen.stuffing import exact_bits


@dataclass(slots=True)
class Delivered:
    """A frame that everybody has received at the time `at`."""

    frame: CanFrame
    at: float
    from_master: bool


class Wire:
    """Senders put frames in with the time; `take` gives them back one by one, when the wire has carried them.

    Whoever takes a frame puts the answers in before it takes the next one: they take part in the next arbitration.
    """

    def __init__(self, bitrate: int) -> None:
        self._bit_s = 1.0 / bitrate
        self._sent = 0
        self._later: list[tuple[float, int, CanFrame, bool]] = []
        """By the time from which on they are sent."""
        self._ready: list[tuple[int, int, CanFrame, bool]] = []
        """By priority: the lowest identifier first, data before a remote frame."""
        self._carried: tuple[int, int, CanFrame, bool] | None = None
        self._free_at = 0.0
        self.busy_s = 0.0
        """Time for which the wire was used."""

    def send(self, frame: CanFrame, now: float, from_master: bool) -> None:
        """A sender wants to send a frame, from `now` on."""
        self._sent += 1
        heapq.heappush(self._later, (now, self._sent, frame, from_master))

    @property
    def next_at(self) -> float | None:
        """When the next frame will be through, as far as that is known; `None` when nobody sends."""
        if self._carried is None:
            self._arbitrate()
        return None if self._carried is None else self._free_at

    def take(self, now: float) -> Delivered | None:
        """The next frame that is through by `now`."""
        at, carried = self.next_at, self._carried
        if carried is None or at is None or at > now:
            return None
        self._carried = None
        return Delivered(carried[2], at, carried[3])

    def _arbitrate(self) -> None:
        """The wire is free: the first of all that wait then wins."""
        later, ready, start = self._later, self._ready, self._free_at
        if not ready:
            if not later:
                return
            start = max(start, later[0][0])
        while later and later[0][0] <= start:
            _, number, frame, from_master = heapq.heappop(later)
            heapq.heappush(ready, (frame.id << 1 | frame.remote, number, frame, from_master))
        self._carried = heapq.heappop(ready)
        length_s = exact_bits(self._carried[2]) * self._bit_s
        self.busy_s += length_s
        self._free_at = start + length_s
