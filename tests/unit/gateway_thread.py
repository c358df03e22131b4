"""A gateway as it runs, beside the test: its own thread, a python-can bus, simulated drives and Zenoh."""

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import replace
from pathlib import Path

from cell.messages import Command, DriveFeedback, GatewayState, Reply
from cell.net.errors import NoAnswer
from cell.net.options import Link
from cell.net.session import CellSession, new_call
from drive_gateway.config.settings import GatewaySettings
from drive_gateway.gateway.shell import run_gateway
from drive_gateway.sim.config.simulation import Simulation
from tests.ports import free_endpoint
from tests.unit.gateway_world import START, TIMES, echo_for, gateway_settings

DEADLINE_S = 60.0
PATIENCE_S = 5.0
"""Its threads may wait for a processor for so long: other tests run beside it."""
SIMULATION = Simulation(lag_s=0.0, starts=dict.fromkeys((("left", "J1"), ("left", "J2")), START))


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
                self._take(message)

    def _take(self, message: object) -> None:
        if isinstance(message, DriveFeedback):
            self.feedback = message
        elif isinstance(message, GatewayState):
            self.state = message

    def ask(self, command: Command) -> Reply:
        """The answer; where the newest state that has come is too old to be answered, the call is given again."""
        deadline = time.monotonic() + DEADLINE_S
        while True:
            for message in self.latest.take_new():
                self._take(message)
            call = new_call(command, echo_for(command, self.state, self.feedback))
            with suppress(NoAnswer):
                reply = self.session.ask("gateway/left_bus", call, DEADLINE_S)
                if "too old to be carried out" not in reply.text:
                    return reply
            assert time.monotonic() < deadline


@contextmanager
def running_gateway(
    settings: GatewaySettings | None = None, state_folder: Path | None = None
) -> Iterator[tuple[Client, threading.Event, list[int]]]:
    """The gateway's client, what stops it, and its exit codes."""
    endpoint = free_endpoint()
    settings = replace(
        settings or gateway_settings(),
        overrun_limit_s=PATIENCE_S,
        tpdo_timeout_s=PATIENCE_S,
        heartbeat_timeout_s=PATIENCE_S,
        boot_timeout_s=PATIENCE_S,
        sdo_timeout_s=PATIENCE_S,
    )
    stop, codes = threading.Event(), list[int]()

    def gateway() -> None:
        link = Link("peer", listen=(endpoint,))
        names = {"cell": "c", "digest": "d"}
        codes.append(
            run_gateway(
                settings, TIMES, **names, link=link, stop=stop, simulation=SIMULATION, state_folder=state_folder
            )
        )

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
