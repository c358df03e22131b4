"""A bus inside the gateway's own process: a `virtual` one to python-can, and whoever reads it computes the drives."""

import threading
import time
from collections import deque

import can
from can.interfaces.virtual import VirtualBus

from drive_gateway.canopen.cob_id import SYNC
from drive_gateway.canopen.frame import CanFrame
from drive_gateway.config.settings import GatewaySettings
from drive_gateway.sim.bus import SimulatedBus
from drive_gateway.sim.config.simulation import Level, Simulation
from drive_gateway.sim.shell import STEP_S, Robots, simulated_nodes

_GRAIN_S = 0.0005
"""A reader that waits looks at most so often for frames that come through the wire."""


class InnerBus(VirtualBus):
    """The gateway's handle of a bus all of whose drives are in this process, without a thread of their own.

    A frame that is sent waits, with its time, until somebody reads; then the drives hear it as of that time. One thread
    reads, any may send. Other handles of the same channel hear everything, and are heard by both sides.
    """

    def __init__(self, settings: GatewaySettings, simulation: Simulation, robots: Robots | None = None) -> None:
        super().__init__(settings.bus.channel)
        bitrate = settings.bus.bitrate if simulation.wire_time else None
        self._carrier = SimulatedBus(simulated_nodes(settings, simulation, robots), bitrate)
        self._sent: deque[tuple[CanFrame, float]] = deque()
        self._arrived: deque[CanFrame] = deque()
        self._stepped = 0.0
        self._synced = False
        """A SYNC has brought the axes forward since the timers ran."""
        self._news = threading.Event()

    @staticmethod
    def fits(settings: GatewaySettings, simulation: Simulation) -> bool:
        """Nobody else can be on the bus, and to compute its drives takes a small part of a cycle."""
        return settings.bus.interface == "virtual" and simulation.level is Level.FAST

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        self._to_drives(msg)
        if self._company:
            super().send(msg, timeout)
        self._news.set()

    def recv(self, timeout: float | None = None) -> can.Message | None:
        end = None if timeout is None else time.monotonic() + timeout
        while True:
            self._news.clear()
            if self._company and not self.queue.empty():
                heard = self.queue.get()
                self._to_drives(heard)
                return heard
            now = time.monotonic()
            if not self._arrived:
                self._compute(now)
            if self._arrived:
                return self._message(self._arrived.popleft())
            if end is not None and now >= end:
                return None
            self._news.wait(min(self._patience(now), STEP_S if end is None else end - now))

    @property
    def _company(self) -> bool:
        return len(self.channel) > 1

    def _to_drives(self, message: can.Message) -> None:
        if not message.is_extended_id:
            frame = CanFrame(message.arbitration_id, bytes(message.data), message.is_remote_frame)
            self._sent.append((frame, time.monotonic()))

    def _message(self, frame: CanFrame) -> can.Message:
        message = can.Message(arbitration_id=frame.id, data=frame.data, is_extended_id=False)
        if self._company:
            super().send(message)
        return message

    def _compute(self, now: float) -> None:
        carrier, arrived = self._carrier, self._arrived
        while self._sent:
            frame, at = self._sent.popleft()
            self._synced = self._synced or frame.id == SYNC
            arrived += carrier.receive(frame, at)
        if now - self._stepped < STEP_S:
            arrived += carrier.carry(now)
            return
        arrived += carrier.timers(now) if self._synced else carrier.step(now)
        self._stepped, self._synced = now, False

    def _patience(self, now: float) -> float:
        """How long to wait for a frame that is sent: until the drives' timers or one of their own frames are due."""
        due, arrival = self._stepped + STEP_S, self._carrier.next_at
        return max((due if arrival is None else min(due, arrival)) - now, _GRAIN_S)
