"""Writes frames and zones into the manager's cell file."""

import threading
from collections import deque

from cell.config.cell_edit import NotWritten
from cell.config.frame_edit import write_frame
from cell.config.zone_edit import write_zone
from cell.manager.frames import FrameNotWritten, FramesWritten, WriteFrame
from cell.manager.zone_changes import WriteZone, ZoneNotWritten, ZonesWritten

Outcome = FramesWritten | FrameNotWritten | ZonesWritten | ZoneNotWritten


class EditsOnDisk:
    """Writes into the cell file on threads of its own: no disk, full or slow, holds the manager's loop up."""

    def __init__(self) -> None:
        self._news: deque[Outcome] = deque()

    def write(self, effect: WriteFrame | WriteZone) -> None:
        """Begin to write; the outcome is among the `news`."""
        threading.Thread(target=self._write, args=(effect,), name="cell file", daemon=True).start()

    def _write(self, effect: WriteFrame | WriteZone) -> None:
        failed = FrameNotWritten if isinstance(effect, WriteFrame) else ZoneNotWritten
        try:
            self._news.append(_written(effect))
        except NotWritten as error:
            self._news.append(failed(str(error)))
        except Exception as error:  # whatever it is, an operator waits for the outcome
            self._news.append(failed(f"internal error, please report it: {error!r}"))

    def news(self) -> list[Outcome]:
        """What came of it since the last call."""
        return [self._news.popleft() for _ in range(len(self._news))]


def _written(effect: WriteFrame | WriteZone) -> FramesWritten | ZonesWritten:
    if isinstance(effect, WriteFrame):
        return FramesWritten(write_frame(effect.file, effect.frame, effect.place, effect.running))
    return ZonesWritten(write_zone(effect.file, effect.change, effect.running))
