"""How a process learns that it should end: SIGINT, SIGTERM, or the end of the process that started it."""

import os
import signal
import threading
from types import FrameType


def stop_event(parent_pipe: int | None = None, hurry: threading.Event | None = None) -> threading.Event:
    """An event that is set by SIGINT, SIGTERM, or end of file on the pipe of the parent process.

    The parent never writes to the pipe; when it dies, however it dies, the kernel closes its end. A second signal sets
    `hurry`.
    """
    stop = threading.Event()

    def on_signal(_number: int, _frame: FrameType | None) -> None:
        if stop.is_set() and hurry is not None:
            hurry.set()
        stop.set()

    signal.signal(signal.SIGINT, on_signal)
    signal.signal(signal.SIGTERM, on_signal)
    if parent_pipe is not None:
        threading.Thread(target=_wait_for_parent, args=(parent_pipe, stop), name="parent-pipe", daemon=True).start()
    return stop


def _wait_for_parent(pipe: int, stop: threading.Event) -> None:
    while os.read(pipe, 1):
        pass
    stop.set()
