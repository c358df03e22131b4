"""Free ports for tests. What the kernel calls free it gives to the next who asks as well, or to a connection."""

import fcntl
import itertools
import os
import socket
import tempfile
from pathlib import Path

_FIRST, _BLOCK, _BLOCKS = 12000, 500, 40
"""All below what Linux takes for connections and for port 0 (from 32768 on)."""
_locks: list[int] = []


def _own_block() -> range:
    """A block of ports that no other process of tests has; the lock ends with the process."""
    for number in range(_BLOCKS):
        lock = os.open(Path(tempfile.gettempdir()) / f"zencell-test-ports-{number}", os.O_RDWR | os.O_CREAT, 0o666)
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            os.close(lock)
            continue
        _locks.append(lock)
        return range(_FIRST + number * _BLOCK, _FIRST + (number + 1) * _BLOCK)
    raise RuntimeError(f"{_BLOCKS} processes of tests run on this computer; end some of them")


_ports = itertools.cycle(_own_block())


def free_port() -> int:
    """A port of 127.0.0.1 that nobody listens on, TCP or UDP, and that comes last before it is given again."""
    for port in itertools.islice(_ports, _BLOCK):
        with socket.socket() as stream, socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as datagrams:
            # As servers do: connections that are over do not keep a port.
            stream.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            try:
                stream.bind(("127.0.0.1", port))
                datagrams.bind(("127.0.0.1", port))
            except OSError:
                continue
            return port
    raise RuntimeError(f"all {_BLOCK} ports of this process of tests are in use")


def free_endpoint() -> str:
    """Where a Zenoh process of a test can listen."""
    return f"tcp/127.0.0.1:{free_port()}"
