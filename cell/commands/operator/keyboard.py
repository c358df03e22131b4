"""Keys of a terminal, one at a time, without the line that a terminal otherwise waits for."""

import contextlib
import os
import select
import sys
import termios
import tty
from types import TracebackType
from typing import Self

UP, DOWN = "up", "down"
_ARROWS = {b"\x1b[A": UP, b"\x1bOA": UP, b"\x1b[B": DOWN, b"\x1bOB": DOWN, b"\t": DOWN}
_MOST = 32


class Keyboard:
    """The keys of standard input, which must be a terminal. A context manager; at its end the terminal is as before."""

    def __init__(self) -> None:
        self._input = sys.stdin.fileno()
        self._before = termios.tcgetattr(self._input)
        self._gone = False

    def __enter__(self) -> Self:
        tty.setcbreak(self._input)
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, tb: TracebackType | None) -> None:
        with contextlib.suppress(termios.error):  # a terminal that is gone is left as it is
            termios.tcsetattr(self._input, termios.TCSADRAIN, self._before)

    @property
    def gone(self) -> bool:
        """The terminal was closed."""
        return self._gone

    def key(self, timeout_s: float) -> str:
        """The next key within a time: a character, `UP` or `DOWN`; empty for none, and for keys without a meaning."""
        if self._gone or not select.select([self._input], [], [], timeout_s)[0]:
            return ""
        try:
            pressed = os.read(self._input, 1)
            if pressed == b"\x1b":  # an arrow comes as several bytes at once, Escape alone as this one
                while select.select([self._input], [], [], 0.0)[0] and len(pressed) < _MOST:
                    pressed += os.read(self._input, 1)
                    if pressed[1:2] in (b"[", b"O") and len(pressed) > 2 and pressed[-1:].isalpha():
                        break
        except OSError:
            pressed = b""
        self._gone = not pressed
        text = pressed.decode("ascii", "ignore")
        return _ARROWS.get(pressed, text if len(text) == 1 and text.isprintable() else "")
