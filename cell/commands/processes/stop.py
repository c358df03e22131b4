"""How a process learns that it should end: SIGINT, SIGTERM, SIGHUP, or the end of the process that started it."""

import os
import signal
import threading
from types import FrameType


def stop_event(parent_pipe: int | None = None, hurry: threading.Event | None = None) -> threading.Event:
    """An event that is set by SIGINT, SIGTERM, SIGHUP, or end of file on the pipe of the parent process.

    The parent never writes to the pipe; when it dies, however it dies, the kernel closes its end. A second signal sets
    `hurry`. SIGHUP means that the terminal is gone: what would still be printed there goes nowhere, and the end of the
    process stays in order. A SIGHUP that is ignored (`nohup`) stays ignored.
    """
    stop = threading.Event()
    terminals = [fd for fd in (1, 2) if os.isatty(fd)]

    def on_signal(number: int, _frame: FrameType | None) -> None:
        if number == signal.SIGHUP:
            _print_nowhere(terminals)
        if stop.is_set() and hurry is not None:
            hurry.set()
        stop.set()

    signal.signal(signal.SIGINT, on_signal)
    signal.signal(signal.SIGTERM, on_signal)
    if signal.getsignal(signal.SIGHUP) is not signal.SIG_IGN:
        signal.signal(signal.SIGHUP, on_signal)
    if parent_pipe is not None:
        threading.Thread(target=_wait_for_parent, args=(parent_pipe, stop), name="parent-pipe", daemon=True).start()
    return stop


def _print_nowhere(descriptors: list[int]) -> None:
    nowhere = os.open(os.devnull, os.O_WRONLY)
    for fd in descriptors:
        os.dup2(nowhere, fd)
    os.close(nowhere)


def _wait_for_parent(pipe: int, stop: threading.Event) -> None:
    while os.read(pipe, 1):
        pass
    stop.set()
