"""The first thing that every command does; it imports next to nothing, so Ctrl-C ends a command at once."""

import importlib
import os
import signal

ZENOH_THREADS = "(rx: (handover: app), acc: (handover: app), net: (handover: app), app: (worker_threads: 1))"


def start(module: str) -> None:
    """Import `module`, which takes most of a second, and call its `main`.

    Linear algebra keeps to one thread unless the user's environment says otherwise: the matrices are small, and threads
    that spin take the processor from the other processes of the cell. Zenoh does all but sending in one thread: what
    comes is then read where it was noticed, and no second thread is woken for it. Sending keeps its own, because
    handlers that answer must not wait for themselves.

    Until a command takes SIGINT over (`cell.commands.processes.stop`), Ctrl-C ends the process without a word, as it
    ends any program that holds nothing.
    """
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    os.environ.setdefault("ZENOH_RUNTIME", ZENOH_THREADS)
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, signal.SIG_DFL)
    importlib.import_module(module).main()
