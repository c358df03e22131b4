"""A node that is too late, on command: its process data are measured in time and sent afterwards."""

from collections import deque

from drive_gateway.canopen.frame import CanFrame


class LateFrames:
    """Holds frames back for `late_s`; 0 lets them pass."""

    def __init__(self) -> None:
        self.late_s = 0.0
        self._waiting: deque[tuple[float, CanFrame]] = deque()

    def passed(self, frames: list[CanFrame], now: float) -> list[CanFrame]:
        """What may be sent at once; the others wait."""
        if self.late_s == 0.0:
            return frames
        self._waiting += [(now + self.late_s, frame) for frame in frames]
        return []

    def due(self, now: float) -> list[CanFrame]:
        """What waited long enough."""
        frames: list[CanFrame] = []
        while self._waiting and self._waiting[0][0] <= now:
            frames.append(self._waiting.popleft()[1])
        return frames

    def forget(self) -> None:
        """The node no longer sends process data."""
        self._waiting.clear()
