"""A recording that is played: its messages again, at the pace at which they were heard, faster or slower."""

from collections.abc import Callable, Iterator

from cell.core import Arrived
from cell.messages import Event
from cell.recording.reader import Raw, Recorded


class Replay:
    """A source of messages, as a running cell is one; times are those of the recording, seconds since 1970 (UTC).

    Not for several threads. Every method but `pace` raises `RecordingError`.
    """

    def __init__(self, recorded: Recorded, speed: float, clock: Callable[[], float]) -> None:
        """`speed`: 1 as it was, 2 twice as fast, 0 stands; `clock`: seconds, such as `time.monotonic`."""
        self._recorded = recorded
        self._clock = clock
        self._speed = speed
        self.began, self.ends = recorded.span()
        self._raw: Iterator[Raw] = iter(())
        self._next: Raw | None = None
        self._from = self._since = 0.0
        self._seek(self.began)

    @property
    def ended(self) -> bool:
        """Everything was told."""
        return self._next is None

    def now(self) -> float:
        """Where it is; it stays at the end of the recording."""
        return min(self.ends, self._from + (self._clock() - self._since) * self._speed)

    def pace(self, speed: float) -> None:
        """Go on at another speed."""
        self._from, self._since, self._speed = self.now(), self._clock(), speed

    def seek(self, at: float) -> None:
        """Go on from another moment, or the nearest that is recorded; first comes the newest on each topic before."""
        self._seek(min(max(at, self.began), self.ends))

    def take_new(self) -> list[Arrived]:
        """What is due since the last call, oldest first: every event, of all else the newest on each topic."""
        now = self.now()
        newest: dict[tuple[int, int], Raw] = {}
        while self._next is not None and self._next.at <= now:
            one_of_all = len(newest) if self._next.kind is Event else 0
            key = (self._next.topic, one_of_all)
            newest.pop(key, None)
            newest[key] = self._next
            self._next = next(self._raw, None)
        return [Arrived(self._recorded.message(raw), raw.at) for raw in newest.values()]

    def _seek(self, at: float) -> None:
        self._from, self._since = at, self._clock()
        self._raw = self._recorded.raw(at)
        self._next = next(self._raw, None)
