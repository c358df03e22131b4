"""An agent's place at a gateway: it owns a robot, sends it blocks and sees on the bus when they are played."""

import random
import time
from contextlib import ExitStack

import numpy as np
from numpy.typing import NDArray

from bench.bus_ear import BusEar
from cell.config.settings import CellSettings
from cell.messages import Claim, DriveFeedback, EnableDrives, GatewayState, Reply, SetpointBlock
from cell.messages.gateway_state import BusCounters
from cell.net.errors import NoAnswer
from cell.net.options import Link
from cell.net.session import CellSession, new_call
from drive_gateway.cia402.units import AxisUnits
from drive_gateway.config import load_drives

Floats = NDArray[np.float64]

CYCLE_S, BLOCK_PERIOD_S, SAMPLES = 0.004, 0.02, 45
READY_S = 60.0
WAY_S = 0.2e-3
"""A block that is sent so long before the next SYNC, or longer, is meant for the set points right behind that SYNC."""
LEAD = 20
"""Ticks from the newest feedback to the first sample of the block that takes the first axis to where it is marked."""
_BELOW, _ABOVE = 0.45, 0.55
"""Counts past a whole one. Between the two lies less than a block may jump where it joins, and yet the set point on the
bus changes by one count: so the first frame that carries a block is known."""


class Owner:
    """Claims one robot, enables it and sends it blocks that hold it where it is, at random moments of the cycle.

    In the cycle of the SYNC numbered `tick` the set points of `tick + 1` are made. Each block begins with the earliest
    tick that it can reach, so that the time until its first frame, which is that of the first axis, is due to the
    network and the gateway and not to a lead that its sender chose.
    """

    def __init__(self, settings: CellSettings, robot: str, stack: ExitStack) -> None:
        self._robot, self._gateway = robot, settings.robots[robot].gateway
        gateway = settings.gateways[self._gateway]
        drives = load_drives(gateway.drives, self._gateway)
        axis = drives.robots[robot].axes[0]
        self._first_axis = AxisUnits([axis])
        self._ear = stack.enter_context(BusEar(drives.bus, axis.node_id, self._on_target))
        link = Link("client", connect=(gateway.endpoint,), open_timeout_s=READY_S)
        self._session = stack.enter_context(CellSession(settings.name, link, "robot", robot, f"bench-{robot}"))
        self._latest = self._session.watch(f"robot/{robot}/drives", f"gateway/{self._gateway}/state")
        self._feedback: DriveFeedback | None = None
        self._state: GatewayState | None = None
        self._tick_of_first_sync = -1
        self._sequence, self._next = 0, 0.0
        self._count: int | None = None
        self._shown = 0
        self._sent: tuple[float, int] | None = None
        self.latencies: list[float] = []
        """[s] from a block to its first frame."""
        self.late = 0
        """Blocks whose set points had been made already when they came."""
        while self._feedback is None or self._state is None or not self._state.ready:
            self._listen()
            time.sleep(0.01)
        reply = self._ask(Claim(robot, f"bench-{robot}", settings.digest))
        if reply.claim is None:
            raise RuntimeError(reply.text)
        self._owner = reply.claim.owner
        deadline = time.monotonic() + READY_S
        while not (enabled := self._ask(EnableDrives(robot, self._owner))).ok:
            # Right after the start, or on a busy computer, the drives may not be there yet.
            if time.monotonic() > deadline:
                raise RuntimeError(enabled.text)
            time.sleep(0.5)

    @property
    def counters(self) -> BusCounters:
        if self._state is None:
            raise RuntimeError(f"gateway {self._gateway} was never heard")
        return self._state.counters

    def forget(self) -> None:
        """What was measured so far does not count."""
        self.latencies.clear()
        self.late = 0

    def step(self) -> None:
        """Listen, and send the next block when it is due."""
        self._listen()
        feedback = self._feedback
        if time.monotonic() < self._next or feedback is None or not feedback.enabled:
            return
        self._next = time.monotonic() + BLOCK_PERIOD_S + random.uniform(0.0, CYCLE_S)
        if self._count is None:
            self._count = self._approach(feedback)
            return
        self.late += self._sent is not None
        above = self._shown == self._count
        position = feedback.commanded.copy()
        position[0] = self._mark(self._count, _ABOVE if above else _BELOW)
        now = time.time()
        reachable = 2 if now - self._ear.sync_at < CYCLE_S - WAY_S else 3
        self._sent = now, self._count + above
        self._publish(self._tick_of_first_sync + self._ear.syncs + reachable, np.tile(position, (SAMPLES, 1)))

    def _approach(self, feedback: DriveFeedback) -> int | None:
        """Let the first axis go the part of a count to the mark; the whole count below, when it is there."""
        count = self._shown
        mark = self._mark(count, _BELOW)
        if feedback.commanded[0] == mark:
            return count
        position = np.tile(feedback.commanded, (SAMPLES, 1))
        position[1:, 0] = mark
        self._publish(feedback.tick + LEAD, position)
        return None

    def _mark(self, count: int, past: float) -> float:
        return float(self._first_axis.position([count + past])[0])

    def _publish(self, first_tick: int, position: Floats) -> None:
        self._sequence += 1
        block = SetpointBlock(
            self._robot,
            self._owner,
            self._sequence,
            self._sequence - 1,
            first_tick,
            CYCLE_S,
            30,
            position,
            0 * position,
        )
        self._session.publish(block)

    def _on_target(self, at: float, target: int) -> None:
        self._shown = target
        if self._sent is not None and at > self._sent[0] and target == self._sent[1]:
            self.latencies.append(at - self._sent[0])
            self._sent = None

    def _listen(self) -> None:
        news = self._latest.take_new()
        # After the feedback: its SYNC is on the bus before it.
        self._ear.listen()
        for message in news:
            if isinstance(message, GatewayState):
                self._state = message
            elif isinstance(message, DriveFeedback):
                self._feedback = message
                self._tick_of_first_sync = max(self._tick_of_first_sync, message.tick - self._ear.syncs)

    def _ask(self, command: Claim | EnableDrives) -> Reply:
        deadline = time.monotonic() + READY_S
        while True:
            try:
                return self._session.ask(f"gateway/{self._gateway}", new_call(command), 5.0)
            except NoAnswer:
                if time.monotonic() > deadline:
                    raise
