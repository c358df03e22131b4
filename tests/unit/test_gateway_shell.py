"""The gateway as it runs: its own thread, a python-can bus, simulated drives and Zenoh."""

import socket
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace

import numpy as np
import pytest
from gateway_world import TIMES, block, gateway_settings, s_motion

from cell.messages import Claim, Command, DriveFeedback, EnableDrives, GatewayState, Reply
from cell.net.errors import NoAnswer
from cell.net.options import Link
from cell.net.session import CellSession, new_call
from drive_gateway.config.settings import BusSettings
from drive_gateway.gateway.bus import BusError, open_bus
from drive_gateway.gateway.shell import run_gateway

DEADLINE_S = 20.0


@pytest.mark.parametrize(
    ("interface", "channel", "found"),
    [("no_such_bus", "x", "allowed are"), ("socketcan", "no_such_can9", "check that the adapter")],
)
def test_a_bus_that_is_not_there_says_what_to_do(interface: str, channel: str, found: str) -> None:
    with pytest.raises(BusError, match=found) as caught:
        open_bus(BusSettings(interface, channel, 500_000, {}))
    assert f"{interface}:{channel}" in str(caught.value)


class Client:
    """An agent's place: what it heard last, and calls that wait for the gateway to be there."""

    def __init__(self, session: CellSession) -> None:
        self.session = session
        self.latest = session.watch("robot/left/drives", "gateway/left_bus/state")
        self.feedback: DriveFeedback | None = None
        self.state: GatewayState | None = None

    def until(self, happened: Callable[[], bool]) -> None:
        deadline = time.monotonic() + DEADLINE_S
        pause = threading.Event()
        while not happened():
            assert time.monotonic() < deadline, (self.state, self.feedback)
            pause.wait(0.002)
            for message in self.latest.take_new():
                if isinstance(message, DriveFeedback):
                    self.feedback = message
                elif isinstance(message, GatewayState):
                    self.state = message

    def ask(self, command: Command) -> Reply:
        deadline = time.monotonic() + DEADLINE_S
        while True:
            try:
                return self.session.ask("gateway/left_bus", new_call(command), 5.0)
            except NoAnswer:
                assert time.monotonic() < deadline


@contextmanager
def running_gateway() -> Iterator[tuple[Client, threading.Event, list[int]]]:
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        endpoint = f"tcp/127.0.0.1:{free.getsockname()[1]}"
    settings = replace(gateway_settings(), overrun_limit_s=1.0, tpdo_timeout_s=1.0, heartbeat_timeout_s=1.0)
    stop, codes = threading.Event(), list[int]()

    def gateway() -> None:
        link = Link("peer", listen=(endpoint,))
        codes.append(run_gateway(settings, TIMES, cell="c", digest="d", link=link, stop=stop, simulate=True))

    thread = threading.Thread(target=gateway)
    thread.start()
    try:
        link = Link("client", connect=(endpoint,), open_timeout_s=DEADLINE_S)
        with CellSession("c", link, "robot", "left", "a1") as session:
            yield Client(session), stop, codes
    finally:
        stop.set()
        thread.join(DEADLINE_S)
    assert not thread.is_alive()


def test_a_block_sent_over_zenoh_moves_a_simulated_drive_and_a_stop_switches_it_off() -> None:
    with running_gateway() as (client, stop, codes):
        client.until(lambda: client.state is not None and client.state.ready)
        claim = client.ask(Claim("left", "a1", "d")).claim
        assert claim is not None
        enabled = client.ask(EnableDrives("left", claim.owner))
        assert enabled.ok, enabled.text
        client.until(lambda: client.feedback is not None and client.feedback.enabled)
        start = client.feedback.commanded
        position, velocity = s_motion(0.5, 0.1)
        client.session.publish(block(claim.owner, 1, client.feedback.tick + 25, start + position, velocity))
        client.until(lambda: bool(np.all(np.abs(client.feedback.position - start - 0.1) < 1e-3)))
        stop.set()
        client.until(lambda: bool(codes))
        assert codes == [0]
