"""The first thing that every command does; it imports next to nothing, so that Ctrl-C is in good hands at once."""

import importlib
import signal


def start(module: str) -> None:
    """Import `module`, which takes most of a second, and call its `main`.

    Until a command takes SIGINT over (`cell.commands.stop`), Ctrl-C ends the process without a word, as it ends any
    program that holds nothing.
    """
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, signal.SIG_DFL)
    importlib.import_module(module).main()
