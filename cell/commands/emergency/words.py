"""Texts and names that may be anything, as text that every message, terminal and log takes."""

import os
import sys
from contextlib import suppress

LONGEST = 200
"""A reason is for people who hurry."""
HARD_WIRED = "use the hard-wired emergency stop"
_NAMES = ("LOGNAME", "USER", "LNAME", "USERNAME")


def plain(text: str) -> str:
    """One printable line; bytes of the command line that are no UTF-8 are read as Latin-1."""
    read = (chr(ord(c) - 0xDC00) if "\udc80" <= c <= "\udcff" else c for c in text)
    return " ".join("".join(c if c.isprintable() else " " for c in read).split())[:LONGEST]


def operator_name() -> str:
    """Who gives the order: user and host. A user without a name has a number; no directory service is asked."""
    named = (plain(os.environ.get(variable, "")) for variable in _NAMES)
    user = next(filter(None, named), f"uid {os.getuid()}")
    return f"{user}@{plain(os.uname().nodename)}"


def say(text: str, *, error: bool = False) -> None:
    """Print a line where that is possible."""
    with suppress(OSError, ValueError):
        print(text, file=sys.stderr if error else sys.stdout, flush=True)


def open_standard_streams() -> None:
    """Let whatever is closed of stdin, stdout and stderr lead nowhere: a socket must not take its number."""
    for number in range(3):
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, os.O_RDWR)
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="backslashreplace")
