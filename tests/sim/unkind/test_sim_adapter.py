"""A CAN adapter that fails, in every state of a robot: `bus_failed` with its reason, and back in the same process.

Core, `SteadyBus` and simulated drives are the real ones; the adapter and its driver are played here, on virtual time.
"""

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

import can
import pytest

from cell.messages import MoveAxes, PlayoutState, Severity
from drive_gateway.canopen.frame import CanFrame
from drive_gateway.config.settings import BusSettings
from drive_gateway.gateway.bus import steady_bus
from drive_gateway.gateway.bus.steady_bus import SteadyBus
from tests.sim.unkind.bench import BRAKE, PLAIN, WAY, Changes, UnkindBench

AWAY_S = 0.8
LATE_S = 0.5
STOPS = 2.0 * BRAKE
"""[rad] In set-up drives move by themselves: they go on until they miss their gateway, and brake then."""
_BUS_OFF = 0x040


@dataclass(frozen=True)
class Trouble:
    """What an adapter does while it is away."""

    reads: Callable[[], can.Message | None] = lambda: None
    sends: Exception | None = None
    opens: Exception | None = None
    closes: Exception | None = None
    late_s: float = 0.0
    """What is received comes so late, and all is well otherwise."""

    @property
    def dead(self) -> bool:
        return self.late_s == 0.0


def raising(error: Exception) -> Callable[[], None]:
    def read() -> None:
        raise error

    return read


def error_frame(classes: int) -> can.Message:
    return can.Message(arbitration_id=classes, data=bytes(8), is_error_frame=True)


GONE = can.CanOperationError("Error receiving: No such device", 19)
NONE_THERE = can.CanInitializationError("no device found")

FULL = can.CanOperationError("Failed to transmit: No buffer space available", 105)

TROUBLES = {
    "pulled": (Trouble(raising(GONE), GONE, NONE_THERE, AttributeError("port")), "failed: Error receiving: No such d"),
    "garbles": (Trouble(raising(ValueError("no hex: 'x'"))), "failed: ValueError: no hex: 'x'"),
    "raises when it sends": (Trouble(sends=AttributeError("no port")), "failed: AttributeError: no port"),
    "bus-off": (Trouble(lambda: error_frame(_BUS_OFF)), "failed: bus-off"),
    "slow": (Trouble(late_s=LATE_S), "sent no TPDO"),
    "takes no frames": (Trouble(sends=FULL, opens=NONE_THERE), "sent no TPDO"),
}
"""With a part of what people are told."""


class Adapter:
    """Stands for a python-can bus: frames of the nodes wait in it, and it fails as it is told."""

    def __init__(self, world: "AdapterBench") -> None:
        self._world = world

    def recv(self, _timeout_s: float) -> can.Message | None:
        trouble = self._world.trouble
        if trouble is not None and trouble.dead:
            return trouble.reads()
        return self._world.waiting.popleft()[1] if self._world.arrived() else None

    def send(self, message: can.Message) -> None:
        trouble = self._world.trouble
        if trouble is None or not trouble.dead:
            self._world.bus.send(CanFrame(message.arbitration_id, bytes(message.data)), self._world.now)
        elif trouble.sends is not None:
            raise trouble.sends

    def shutdown(self) -> None:
        trouble = self._world.trouble
        if trouble is not None and trouble.closes is not None:
            raise trouble.closes


class AdapterBench(UnkindBench):
    """What the loop does with its port: frames through the adapter, and an attempt to open it where it is closed."""

    def __init__(self, changes: Changes) -> None:
        self.trouble: Trouble | None = None
        self.waiting: deque[tuple[float, can.Message]] = deque()
        super().__init__((), changes)
        self._port = SteadyBus(BusSettings("socketcan", "can0", 1_000_000, {}), self.tell, self._opened)

    def monotonic(self) -> float:
        """For `SteadyBus`, which has nothing else of the module `time`."""
        return self.now

    def sleep(self, _seconds: float) -> None:
        """Nobody waits within a cycle."""

    def arrived(self) -> bool:
        return bool(self.waiting) and self.waiting[0][0] <= self.now

    def cycle(self, late_s: float = 0.0) -> None:
        while (message := self._port.receive(0.0)) is not None:
            UnkindBench._deliver(self, CanFrame(message.arbitration_id, bytes(message.data)))
        super().cycle(late_s)

    def _opened(self, _settings: BusSettings) -> can.BusABC:
        if self.trouble is not None and self.trouble.opens is not None:
            raise self.trouble.opens
        self.waiting.clear()
        return Adapter(self)  # type: ignore[return-value]

    def _send(self, frame: CanFrame) -> None:
        self._port.send(can.Message(arbitration_id=frame.id, data=frame.data, is_extended_id=False))

    def _deliver(self, message: object) -> None:
        if isinstance(message, CanFrame):
            frame = can.Message(arbitration_id=message.id, data=message.data, is_extended_id=False)
            late_s = 0.0 if self.trouble is None else self.trouble.late_s
            self.waiting.append((self.now + late_s, frame))
            return
        super()._deliver(message)


def _boot(world: AdapterBench) -> None:
    world.run(0.05)
    assert world.state is None or not world.state.ready


def _off(world: AdapterBench) -> None:
    world.comes_up()


def _set_up(world: AdapterBench) -> None:
    world.comes_up()
    world.stands(False)
    assert world.ask(MoveAxes("left", {"J1": 0.4, "J2": 0.4}, True, 1.0, False)).ok
    world.holder = "left"
    before = world.places
    world.until(lambda: abs(world.places - before).min() > 0.1)


def _at_rest(world: AdapterBench) -> None:
    world.comes_up()
    world.enables()


def _moving(world: AdapterBench) -> None:
    _at_rest(world)
    world.half_way(WAY)


def _fault(world: AdapterBench) -> None:
    _at_rest(world)
    world.breaks()


def _braking(world: AdapterBench) -> None:
    _moving(world)
    world.bus.nodes[PLAIN].raise_emergency(0x4310)
    world.until(lambda: world.feedback is not None and world.feedback.state is PlayoutState.STOPPING)


STATES = {
    "boot": _boot,
    "off": _off,
    "set-up": _set_up,
    "enabled at rest": _at_rest,
    "moving": _moving,
    "fault": _fault,
    "braking": _braking,
}
_PLAYING = ("enabled at rest", "moving")


@pytest.mark.parametrize("trouble", TROUBLES)
@pytest.mark.parametrize("state", STATES)
def test_it_is_told_with_its_reason_and_the_robot_stops_and_comes_back(
    monkeypatch: pytest.MonkeyPatch, state: str, trouble: str
) -> None:
    world = AdapterBench(Changes({}, {"incremental": False, "homing": None}))
    monkeypatch.setattr(steady_bus, "time", world)
    STATES[state](world)
    before, told = world.places, len(world.events)
    world.trouble, reason = TROUBLES[trouble]
    world.stands(False)
    world.run(AWAY_S)
    world.stands()
    assert abs(world.places - before).max() < STOPS
    said = [event for event in world.events[told:] if reason in event.text]
    assert said or state in ("boot", "fault"), [event.text for event in world.events[told:]]
    assert world.state is not None
    assert not world.state.ready
    if "failed" in reason:
        assert world.codes()[told:].count("bus_failed") == 1
        assert reason in world.state.problem
        if state in _PLAYING:
            assert any(event.severity is Severity.ALARM for event in said), "it is the fault, and no later one"
    world.trouble = None
    world.until(lambda: world.state is not None and world.state.ready)
    world.run(0.5)
    assert world.feedback is not None
    assert not world.feedback.enabled, "nothing goes on by itself"
    world.moves(world.returns(), WAY)
