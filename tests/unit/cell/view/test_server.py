"""Where the page listens, and what its server never does."""

import os

import pytest

pytest.importorskip("viser", reason="the group `view` is not installed")

from cell.view.gate import Gate, Level
from cell.view.server import GatedServer, PortTaken, listen


def test_a_busy_port_is_an_error_that_names_who_has_it() -> None:
    with listen("127.0.0.1", 0) as first:
        port = first.getsockname()[1]
        with pytest.raises(PortTaken, match=f"port {port} of 127.0.0.1 is in use by process {os.getpid()}: "):
            listen("127.0.0.1", port)


def test_nobody_opens_a_public_link() -> None:
    listener = listen("127.0.0.1", 0)
    server = GatedServer(Gate(("127.0.0.1",), Level.WATCH), listener)
    try:
        assert server.request_share_url() is None
    finally:
        server.stop()
