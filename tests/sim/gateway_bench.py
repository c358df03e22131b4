"""One gateway core and its simulated drives on virtual time, frame by frame; an operator and faults beside them."""

from collections.abc import Callable
from dataclasses import replace

from cell.config.settings import Times
from cell.core import Answer, Ended, Publish, Request
from cell.messages import (
    Call,
    Claim,
    Command,
    DriveFeedback,
    EnableDrives,
    Estop,
    Event,
    GatewayState,
    HoldSetup,
    Home,
    MoveAxes,
    PressAxis,
    Reply,
)
from drive_gateway.canopen.frame import CanFrame
from drive_gateway.canopen.sdo import Sdo
from drive_gateway.config.settings import (
    AxisSettings,
    GatewaySettings,
    HomingSettings,
)
from drive_gateway.gateway.core import GatewayCore
from drive_gateway.gateway.effects import Frame, StorePosition
from drive_gateway.gateway.reference.encoder_record import EncoderRecord
from drive_gateway.sim.config.simulation import Simulation
from tests.sim.bus import Bus
from tests.unit.gateway_world import START, KindManager, echo_for, gateway_settings

CYCLE_S = 0.004
TIMES = Times()


def axis(name: str, node_id: int, **changes: object) -> AxisSettings:
    settings = AxisSettings(
        name=name,
        node_id=node_id,
        counts_per_unit=100_000.0,
        offset=0.25,
        speed=2.0,
        acceleration=10.0,
        quick_stop=40.0,
        following_window=0.05,
        following_time_s=0.05,
        brake_s=0.04,
    )
    return replace(settings, **changes)  # type: ignore[arg-type]


def homing(method: int, position: float, order: int = 1) -> HomingSettings:
    return HomingSettings(method, fast=0.4, slow=0.05, acceleration=5.0, position=position, order=order)


def simulated(configuration: GatewaySettings, start: float = START) -> Simulation:
    """Drives that stand there, with a lag of 8 ms."""
    places = {(robot, axis.name): start for robot, drives in configuration.robots.items() for axis in drives.axes}
    return Simulation(lag_s=0.008, starts=places)


def settings(*axes: AxisSettings) -> GatewaySettings:
    return gateway_settings(axes, name="bus", boot_timeout_s=1.0)


class GatewayBench:
    """`cycle` runs one bus cycle; everything that was said is kept."""

    def __init__(self, configuration: GatewaySettings, simulation: Simulation | None = None) -> None:
        self.settings = configuration
        self.simulation = simulated(configuration) if simulation is None else simulation
        self.robot = next(iter(configuration.robots))
        self.now = 10.0
        self.events: list[Event] = []
        self.frames: list[CanFrame] = []
        self.requests: list[Sdo] = []
        self.replies: dict[str, Reply] = {}
        self.feedback: DriveFeedback | None = None
        self.state: GatewayState | None = None
        self.stored: dict[str, EncoderRecord] = {}
        """What the gateway keeps over its end."""
        self.estops: list[Estop] = []
        self.lost: Callable[[CanFrame], bool] = lambda _frame: False
        """Frames that the bus swallows, in both directions."""
        self.manager: KindManager | None = KindManager()
        self.holder = ""
        """Robot whose set-up an operator holds, ..."""
        self.order = ""
        """... by the id of his newest order that was let in."""
        self.said = ("", "")
        self.alive = True
        """Whether the gateway's process runs."""
        self.ended = False
        """It has left its bus in order."""
        self._calls = 0
        self._orders: set[str] = set()
        self._back: list[object] = []
        self.bus = Bus(configuration, self.simulation, self._deliver)
        self.restart_gateway()

    def restart_gateway(self) -> None:
        """A gateway's process starts, with a new boot; the drives know nothing of it."""
        self._calls += 1000
        self.core = GatewayCore(
            self.settings, TIMES, boot=f"g{self._calls}", digest="d", first_owner=self._calls, stored=self.stored
        )
        self.feedback = self.state = None
        self._back = []
        self.alive = True

    def cycle(self, late_s: float = 0.0) -> None:
        self.now += self.settings.cycle_s + late_s
        self.bus.step(self.now)
        back, self._back = self._back, []
        if not self.alive:
            return
        for message in back:
            self.core.receive(message, self.now)
        if self.holder and round(self.now / self.settings.cycle_s) % 25 == 0:
            self.request(HoldSetup(self.holder, self.order), "hold")
        for effect in self.core.step(self.now):
            self._perform(effect)

    def run(self, seconds: float) -> None:
        for _ in range(round(seconds / self.settings.cycle_s)):
            self.cycle()

    def until(self, happened: Callable[[], bool], within_s: float = 10.0) -> None:
        for _ in range(round(within_s / self.settings.cycle_s)):
            if happened():
                return
            self.cycle()
        raise AssertionError(f"did not happen within {within_s} s; last: {[e.text for e in self.events[-5:]]}")

    def ready(self, within_s: float = 10.0) -> None:
        self.until(lambda: self.state is not None and self.state.ready and self.feedback is not None, within_s)
        self.run(0.3)

    def request(self, command: Command, name: str = "") -> str:
        self._calls += 1
        request_id = name or f"r{self._calls}"
        heard = echo_for(command, self.state, self.feedback)
        if isinstance(command, Home | MoveAxes | PressAxis):
            self._orders.add(f"c{self._calls}")
        self._back.append(Request(request_id, Call(f"c{self._calls}", command, heard)))
        return request_id

    def ask(self, command: Command) -> Reply:
        request_id = self.request(command)
        self.until(lambda: request_id in self.replies)
        return self.replies[request_id]

    def tell(self, message: object) -> None:
        self._back.append(message)

    def set_up(self, command: Command) -> str:
        """Give a set-up order and hold it to its end; answers `done` or `stopped`."""
        reply = self.ask(command)
        assert reply.ok, reply.text
        return self.held()

    def held(self) -> str:
        """Hold the set-up order that runs to its end; answers `done` or `stopped`."""
        self.holder, self.said = self.robot, ("", "moving")
        self.until(lambda: self.said[1] != "moving", within_s=60.0)
        self.holder = ""
        self.run(0.3)
        return self.said[1]

    def enabled(self) -> int:
        """Claim and enable; answers the owner."""
        claim = self.ask(Claim(self.robot, f"a{self._calls}", "d"))
        assert claim.claim is not None, claim.text
        reply = self.ask(EnableDrives(self.robot, claim.claim.owner))
        assert reply.ok, reply.text
        self.until(lambda: self.feedback is not None and self.feedback.enabled)
        return claim.claim.owner

    def codes(self) -> list[str]:
        return [event.code for event in self.events]

    def _deliver(self, message: object) -> None:
        if not (isinstance(message, CanFrame) and self.lost(message)):
            self._back.append(message)

    def _send(self, frame: CanFrame) -> None:
        if not self.lost(frame):
            self.bus.send(frame, self.now)

    def _perform(self, effect: object) -> None:
        match effect:
            case Frame(frame):
                self.frames.append(frame)
                self._send(frame)
            case StorePosition(name, record):
                self.stored[name] = record
            case Sdo():
                self.requests.append(effect)
                self._back.append(self.bus.sdo(effect, self.now))
            case Ended():
                self.ended = True
            case Publish(DriveFeedback() as feedback):
                self.feedback = feedback
            case Publish(GatewayState() as state):
                self.state = state
                if self.manager is not None:
                    self._back.append(self.manager.answer(state, self.now))
            case Publish(Estop() as estop):
                self.estops.append(estop)
            case Publish(Event() as event):
                self.events.append(event)
            case Answer(request_id, Reply() as reply):
                self.replies[request_id] = reply
                if reply.ok and reply.id in self._orders:
                    self.order = reply.id
                if request_id == "hold":
                    self.said = (reply.text, reply.data)
