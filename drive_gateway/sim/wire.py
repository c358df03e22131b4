"""The wire of a simulated bus: one frame at a time, the lowest identifier first, each as long as its bits last."""

from dataclasses import dataclass

from drive_gateway.canopen.frame import CanFrame
from drive_gateway.canopen.stuffing import exact_bits


@dataclass(frozen=True, slots=True)
class Sent:
    """A frame that waits for the wire or is on it."""

    frame: CanFrame
    since: float
    from_master: bool


@dataclass(frozen=True, slots=True)
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
        self._waiting: list[Sent] = []
        self._carried: Sent | None = None
        self._free_at = 0.0
        self.busy_s = 0.0
        """Time for which the wire was used."""

    def send(self, frame: CanFrame, now: float, from_master: bool) -> None:
        """A sender wants to send a frame, from `now` on."""
        self._waiting.append(Sent(frame, now, from_master))

    @property
    def next_at(self) -> float | None:
        """When the next frame will be through, as far as that is known; `None` when nobody sends."""
        if self._carried is None:
            self._arbitrate()
        return None if self._carried is None else self._free_at

    def take(self, now: float) -> Delivered | None:
        """The next frame that is through by `now`."""
        at = self.next_at
        if self._carried is None or at is None or at > now:
            return None
        carried, self._carried = self._carried, None
        return Delivered(carried.frame, at, carried.from_master)

    def _arbitrate(self) -> None:
        """The wire is free: of all that wait the lowest identifier wins, data before a remote frame."""
        if not self._waiting:
            return
        start = max(self._free_at, min(sent.since for sent in self._waiting))
        rivals = [sent for sent in self._waiting if sent.since <= start]
        winner = min(rivals, key=lambda sent: (sent.frame.id, sent.frame.remote))
        self._waiting.remove(winner)
        self._carried = winner
        length_s = exact_bits(winner.frame) * self._bit_s
        self.busy_s += length_s
        self._free_at = start + length_s
