"""Moves frames in the manager's cell file."""

import threading
from collections import deque

from cell.config.frame_edit import write_frame
from cell.config.yaml_edit import NotWritten
from cell.manager.frames import FrameNotWritten, FramesWritten, WriteFrame


class FrameFile:
    """Writes frames into the cell file on threads of its own: no disk, full or slow, holds the manager's loop up."""

    def __init__(self) -> None:
        self._news: deque[FramesWritten | FrameNotWritten] = deque()

    def write(self, effect: WriteFrame) -> None:
        """Begin to write; the outcome is among the `news`."""
        threading.Thread(target=self._write, args=(effect,), name="frame", daemon=True).start()

    def _write(self, effect: WriteFrame) -> None:
        try:
            self._news.append(FramesWritten(write_frame(effect.file, effect.frame, effect.place, effect.running)))
        except NotWritten as error:
            self._news.append(FrameNotWritten(str(error)))
        except Exception as error:  # whatever it is, an operator waits for the outcome
            self._news.append(FrameNotWritten(f"internal error, please report it: {error!r}"))

    def news(self) -> list[FramesWritten | FrameNotWritten]:
        """What came of it since the last call."""
        return [self._news.popleft() for _ in range(len(self._news))]
