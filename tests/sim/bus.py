"""The CAN bus of one simulated gateway: real frames between its core and the simulated drives."""

import heapq
import random
from collections.abc import Callable
from contextlib import nullcontext
from typing import Any, Self

from drive_gateway.canopen.abort_text import abort_text
from drive_gateway.canopen.cob_id import SYNC
from drive_gateway.canopen.frame import CanFrame
from drive_gateway.canopen.sdo import Sdo, SdoDone
from drive_gateway.config.settings import GatewaySettings
from drive_gateway.gateway.bus.bus_news import BusNews
from drive_gateway.sim.bus import IN_STEP_S, SimulatedBus
from drive_gateway.sim.config.simulation import Level, Simulation
from drive_gateway.sim.shell import Robots, simulated_nodes
from tests.sim.clock import Clock

_ABORT = 0x80
_SDO_S = (0.0005, 0.002)
"""How long a transfer takes."""
_LEAST_STEP_S = 0.009
"""More often no timer of a node needs to run."""
_FRAME_BITS = 55
"""Of a frame without data and with worst-case stuffing, and ten more for each byte."""


class Bus:
    """Hands every frame to every node and the nodes' answers to `deliver`, without wire time."""

    def __init__(
        self,
        settings: GatewaySettings,
        simulation: Simulation,
        deliver: Callable[[CanFrame], None],
        robots: Robots | None = None,
    ) -> None:
        self._deliver = deliver
        self.nodes = {node.node_id: node for node in simulated_nodes(settings, simulation, robots)}
        self._nodes = list(self.nodes.values())

    def send(self, frame: CanFrame, now: float) -> None:
        """A frame of the gateway."""
        number = frame.id
        for node in self._nodes:
            if number in node.handlers:
                for answer in node.receive(frame, now):
                    self._deliver(answer)

    def connect(self, node: Any) -> None:
        """A node of another kind in the place of one of these."""
        self.nodes[node.node_id] = node
        self._nodes = list(self.nodes.values())

    def step(self, now: float) -> None:
        """Let the nodes' timers run."""
        for node in self._nodes:
            for frame in node.step(now):
                self._deliver(frame)

    def sdo(self, request: Sdo, now: float) -> SdoDone:
        """Carry an SDO out with expedited frames, as the gateway's shell does with the canopen library."""
        node = self.nodes[request.node_id]
        answers = node.receive(CanFrame(0x600 + request.node_id, request_bytes(request)), now)
        answer = next((frame.data for frame in answers if frame.id == 0x580 + request.node_id), None)
        return SdoDone(request.request_id, b"", None, "no answer") if answer is None else outcome_of(request, answer)


class LivingBus(Bus):
    """A bus whose nodes live on the world's time, whether a gateway runs or not; one gateway at a time has its port.

    Frames take their time on the wire where the drives file says so.
    """

    STEP_S = 0.0125

    def __init__(
        self, settings: GatewaySettings, simulation: Simulation, clock: Clock, rng: random.Random, robots: Robots
    ) -> None:
        self.port: SimPort | None = None
        self.broken = False
        """Nothing goes over it."""
        self._stepped = clock.now
        self._synced = False
        self._clock = clock
        super().__init__(settings, simulation, self._to_port, robots)
        apart_s = IN_STEP_S if simulation.level is Level.FULL else self.STEP_S
        bitrate = settings.bus.bitrate if simulation.wire_time else None
        self._carrier = SimulatedBus(self._nodes, bitrate, apart_s)
        clock.after(rng.random() * self.STEP_S, self._live)

    def _live(self) -> None:
        """Where no gateway reads, the nodes' timers run by themselves."""
        left_s = self._stepped + self.STEP_S - self._clock.now
        if left_s <= 0.0:
            self.step(self._clock.now)
            left_s = self.STEP_S
        self._clock.after(left_s, self._live)

    def send(self, frame: CanFrame, now: float) -> None:
        if self.broken:
            return
        if frame.id == SYNC:
            self._synced = True
        for answer in self._carrier.receive(frame, now):
            self._to_port(answer)

    def step(self, now: float) -> None:
        self._stepped = now
        for frame in self._carrier.step(now):
            self._to_port(frame)

    def carry(self, now: float) -> None:
        """What is through the wire by now arrives; the nodes' timers run as of the newest SYNC that they heard."""
        for frame in self._carrier.carry(now):
            self._to_port(frame)
        if now - self._stepped >= _LEAST_STEP_S:
            self._stepped = now
            if self._synced:
                self._synced = False
                frames = self._carrier.timers(now)
            else:
                frames = self._carrier.step(now)
            for frame in frames:
                self._to_port(frame)

    def sdo(self, request: Sdo, now: float) -> SdoDone:
        for frame in self._carrier.carry(now):
            self._to_port(frame)
        if self.broken:
            return SdoDone(request.request_id, b"", None, "no answer")
        return super().sdo(request, now)

    def _to_port(self, frame: CanFrame) -> None:
        if self.port is not None and not self.broken:
            self.port.arrived(frame)


class SimPort:
    """What a gateway's shell has of its bus: stands for `BusPort`."""

    def __init__(self, bus: LivingBus, clock: Clock) -> None:
        self._bus = bus
        self._clock = clock
        self._on_frame: Callable[[CanFrame], None] = lambda _frame: None
        self.tell: Callable[[BusNews], None] = lambda _news: None
        """What happens to the bus as a whole."""
        self._frames: list[CanFrame] = []
        self._done: list[tuple[float, int, Callable[[], None]]] = []
        self.bits = 0
        bus.port = self

    def opened(
        self, _settings: object, on_frame: Callable[[CanFrame], None], on_news: Callable[[BusNews], None]
    ) -> Self:
        """With what a shell makes of it."""
        self._on_frame, self.tell = on_frame, on_news
        return self

    def send(self, frame: CanFrame) -> None:
        self.bits += _FRAME_BITS + 10 * len(frame.data)
        self._bus.send(frame, self._clock.now)

    attend = nullcontext
    """An answer needs nobody who waits for it."""

    def arrived(self, frame: CanFrame) -> None:
        """A node has sent a frame."""
        self.bits += _FRAME_BITS + 10 * len(frame.data)
        self._frames.append(frame)

    def later(self, delay_s: float, action: Callable[[], None]) -> None:
        """Do something in the first `take` after a delay."""
        heapq.heappush(self._done, (self._clock.now + delay_s, len(self._done), action))

    def take(self) -> None:
        self._bus.carry(self._clock.now)
        frames, self._frames = self._frames, []
        for frame in frames:
            self._on_frame(frame)
        while self._done and self._done[0][0] <= self._clock.now:
            heapq.heappop(self._done)[2]()

    def sdo(self, request: Sdo) -> SdoDone:
        return self._bus.sdo(request, self._clock.now)


class SimWorkers:
    """Carries SDOs out: stands for `SdoWorkers`."""

    def __init__(self, port: SimPort, rng: random.Random, done: Callable[[SdoDone], None]) -> None:
        self._port = port
        self._rng = rng
        self._tell = done

    def take(self, _frame: CanFrame) -> bool:
        """No answer of an SDO comes as a frame here."""
        return False

    def submit(self, request: Sdo) -> None:
        """Carry a request out; its outcome comes a little later."""
        done = self._port.sdo(request)
        self._port.later(self._rng.uniform(*_SDO_S), lambda: self._tell(done))


def outcome_of(request: Sdo, answer: bytes) -> SdoDone:
    """What an expedited answer says."""
    if answer[0] == _ABORT:
        code = int.from_bytes(answer[4:8], "little")
        return SdoDone(request.request_id, b"", code, abort_text(code))
    size = 4 - (answer[0] >> 2 & 0x3) if request.data is None else 0
    return SdoDone(request.request_id, bytes(answer[4 : 4 + size]))


def request_bytes(request: Sdo) -> bytes:
    """An expedited request."""
    object_bytes = request.index.to_bytes(2, "little") + bytes([request.sub])
    if request.data is None:
        return b"\x40" + object_bytes + bytes(4)
    return bytes([0x23 | (4 - len(request.data)) << 2]) + object_bytes + request.data.ljust(4, b"\x00")
