"""An agent's place at a gateway: it owns a robot, sends it blocks and sees on the bus when they are played."""

import random
import time
from contextlib import ExitStack

import numpy as np
from numpy.typing import NDArray

from bench.bus_ear import BusEar
from cell.config.settings import CellSettings
from cell.messages import Claim, DriveFeedback, EnableDrives, GatewayState, Heard, Reply, SetpointBlock
from cell.messages.gateway_state import BusCounters
from cell.net.errors import NoAnswer
from cell.net.options import Link
from cell.net.session import CellSession, new_call
from drive_gateway.config import load_drives

Floats = NDArray[np.float64]

CYCLE_S, BLOCK_PERIOD_S, SAMPLES = 0.004, 0.02, 45
READY_S = 60.0
LEAD = 20
"""Ticks from the newest feedback to the first sample of the block that takes the first axis to where it is marked."""
_BELOW, _ABOVE = 0.45, 0.55
"""Counts past a whole one. Between the two lies less than a block may jump where it joins, and yet the set point on the
bus changes by one count: so the first frame that carries a block is known."""


class Owner:
    """Claims one robot, enables it and sends it blocks that hold it where it is, at random moments of the cycle.

    In the cycle of the SYNC numbered `tick` the set points of `tick + 1` are made. Each block begins with the tick that
    the next cycle makes, so that the time until its first frame, which is that of the first axis, is due to the network
    and the gateway and not to a lead that its sender chose. A block that misses that cycle is refused by the one after
    it; then the frame of that cycle counts, which would have carried the block, had it been meant for it.
    """

    def __init__(self, settings: CellSettings, robot: str, stack: ExitStack) -> None:
        self._robot, self._gateway = robot, settings.robots[robot].gateway
        gateway = settings.gateways[self._gateway]
        drives = load_drives(gateway.drives, self._gateway)
        self._first_axis = drives.robots[robot].axes[0]
        self._ear = stack.enter_context(BusEar(drives.bus, self._first_axis.node_id, self._on_target))
        link = Link("client", connect=(gateway.endpoint,), open_timeout_s=READY_S)
        self._session = stack.enter_context(CellSession(settings.name, link, "robot", robot, f"bench-{robot}"))
        self._latest = self._session.watch(f"robot/{robot}/drives", f"gateway/{self._gateway}/state")
        self._feedback: DriveFeedback | None = None
        self._state: GatewayState | None = None
        self._ticks_before = -1
        """SYNCs before the first one that was heard."""
        self._sequence = 0
        self.due = 0.0
        """When the next block is sent [s, time.monotonic()]."""
        self._count: int | None = None
        self._shown = 0
        self._sent: tuple[float, int] | None = None
        self.latencies: list[float] = []
        """[s] from a block to its first frame."""
        self.late = 0
        """Of these, blocks whose set points had been made already when they came."""
        self.lost = 0
        """Of these, blocks of which nothing was seen until the next one was sent: they count with that time."""
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
        self.late = self.lost = 0

    def step(self) -> None:
        """Listen, and send the next block when it is due."""
        self._listen()
        feedback = self._feedback
        if time.monotonic() < self.due or feedback is None or not feedback.enabled:
            return
        self.due = time.monotonic() + BLOCK_PERIOD_S + random.uniform(0.0, CYCLE_S)
        if self._count is None:
            self._count = self._approach(feedback)
            return
        if self._sent is not None:
            self.lost += 1
            self.latencies.append(time.time() - self._sent[0])
        above = self._shown == self._count
        position = feedback.commanded.copy()
        position[0] = self._mark(self._count, _ABOVE if above else _BELOW)
        block = np.tile(position, (SAMPLES, 1))
        self._sent = time.time(), self._count + above
        self._publish(self._ear.syncs + self._ticks_before + 2, block)

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
        return self._first_axis.offset + (count + past) / self._first_axis.counts_per_unit

    def _publish(self, first_tick: int, position: Floats) -> None:
        before, still = self._sequence, np.zeros_like(position)
        self._sequence += 1
        self._session.publish(
            SetpointBlock(self._robot, self._owner, before + 1, before, first_tick, CYCLE_S, 30, position, still)
        )

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
                self._take(message)

    def _take(self, feedback: DriveFeedback) -> None:
        before, self._feedback = self._feedback, feedback
        self._ticks_before = max(self._ticks_before, feedback.tick - self._ear.syncs)
        if self._sent is None or before is None or feedback.refused == before.refused:
            return
        at = self._ear.command_at(feedback.tick - self._ticks_before)
        if at is not None:
            self.latencies.append(at - self._sent[0])
            self.late += 1
            self._sent = None

    def _ask(self, command: Claim | EnableDrives) -> Reply:
        deadline = time.monotonic() + READY_S
        while True:
            try:
                self._listen()
                seen = self._feedback
                heard = None if seen is None else Heard(seen.boot, seen.sequence)
                return self._session.ask(f"gateway/{self._gateway}", new_call(command, heard), 5.0)
            except NoAnswer:
                if time.monotonic() > deadline:
                    raise
