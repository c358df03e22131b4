"""A cell without Zenoh: a `ManagerCore` and robots on a line, each a ball; the zone is the middle of the line."""

import itertools
from dataclasses import dataclass, field, replace
from pathlib import Path

from cell.config.settings import (
    CellSettings,
    OnManagerReturn,
    PoseSettings,
    RobotSettings,
    SeparationSettings,
    Times,
    ZoneSettings,
)
from cell.core import Answer, Effect, Publish, Request
from cell.manager.core import ManagerCore
from cell.manager.frames import WriteFrame
from cell.manager.records import Record, Store, Stored
from cell.manager.zone_changes import WriteZone
from cell.messages import (
    Body,
    Call,
    Command,
    Estop,
    Event,
    FramePose,
    Heard,
    ManagerState,
    Presence,
    Reply,
    Token,
    ZoneGeometry,
    ZoneStatus,
)
from tests.unit.plain_body import plain_body

HERE = PoseSettings((0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0))
OUTSIDE, INSIDE = 1.0, 0.0
PERIOD_S = 0.01


def settings(robots: tuple[str, ...] = ("left", "right"), zones: tuple[str, ...] = ("middle",)) -> CellSettings:
    """A cell whose zones all are the cube of 0.4 m around the origin."""
    robot = RobotSettings("", Path("model"), "bus", HERE, Path("program"))
    return CellSettings(
        name="line",
        file=Path("cell.yaml"),
        manager_endpoint="tcp/127.0.0.1:0",
        robots={name: replace(robot, name=name) for name in robots},
        gateways={},
        zones={name: ZoneSettings(name, (0.4, 0.4, 0.4), HERE, robots) for name in zones},
        times=Times(),
        on_manager_return=OnManagerReturn.CONTINUE,
        digest="digest",
        separation=SeparationSettings(0.03),
    )


def ball(x: float, known: bool = True) -> Body:
    """A ball of 0.1 m at `x`; the reach around it does not touch the zone from outside."""
    pose = ((x, 0.0, 0.0, x, 0.0, 0.0),)
    return plain_body((0.1,), (pose,), (0.0,), known=known, base=(x, 0.0, 0.0), reach_m=0.5)


@dataclass
class Robot:
    """A robot that keeps to the rules unless a test makes it break them."""

    name: str
    x: float = OUTSIDE
    boot: str = "b1"
    owner: int = 1
    digest: str = "digest"
    known: bool = True
    moving: bool = False
    wants: bool = False
    silent: bool = False
    standing: bool = False
    holds: dict[str, Token] = field(default_factory=dict)
    estop: str | None = None
    heard: Heard | None = None
    sequence: int = 0

    def listen(self, message: object) -> None:
        if isinstance(message, ManagerState) and not self.silent:
            self.heard = Heard(message.boot, message.sequence)
            for name, zone in message.zones.items():
                if zone.holder == self.name and zone.token is not None and (self.wants or self.x == INSIDE):
                    self.holds[name] = zone.token
                elif self.x != INSIDE:
                    self.holds.pop(name, None)
        if isinstance(message, Estop) and not self.silent:
            if message.active:
                self.estop = self.estop or message.id
            elif self.estop == message.id:
                self.estop = None

    def presence(self) -> Presence:
        self.sequence += 1
        return Presence(
            robot=self.name,
            boot=self.boot,
            owner=self.owner,
            sequence=self.sequence,
            heard=self.heard,
            digest=self.digest,
            body=ball(self.x, self.known),
            stop_time_s=0.4 if self.moving else 0.0,
            holds=dict(self.holds),
            wants={"middle": 0.0} if self.wants else {},
            estop_acknowledged=self.estop,
            standing=self.standing,
        )

    def restart(self, boot: str) -> None:
        self.boot, self.sequence, self.heard, self.holds, self.estop = boot, 0, None, {}, None
        self.owner += 1
        self.silent = self.wants = self.moving = False


class World:
    """Virtual time: every step all robots speak, the manager steps, and all hear it."""

    def __init__(self, cell: CellSettings | None = None, epoch: int = 7, boot: str = "m1") -> None:
        self.cell = cell or settings()
        self.now = 100.0
        self.robots = {name: Robot(name) for name in self.cell.robots}
        self.records: list[Record] = []
        self.events: list[Event] = []
        self.estops: list[Estop] = []
        self.states: list[ManagerState] = []
        self.geometry: list[ZoneGeometry] = []
        self.frames: list[FramePose] = []
        self.writes: list[WriteFrame] = []
        self.zone_writes: list[WriteZone] = []
        self.replies: dict[str, Reply] = {}
        self._requests = itertools.count(1)
        self.manager = ManagerCore(self.cell, boot, epoch, Stored(), process=4711)

    def __getattr__(self, name: str) -> Robot:
        return self.__dict__["robots"][name]

    def restart_manager(self, epoch: int, boot: str, stored: Stored | None = None) -> None:
        self.manager = ManagerCore(self.cell, boot, epoch, stored or Stored(), process=4712)

    def run(self, seconds: float = 0.1) -> "World":
        for _ in range(max(1, round(seconds / PERIOD_S))):
            self.now += PERIOD_S
            for robot in self.robots.values():
                if not robot.silent:
                    self.manager.receive(robot.presence(), self.now)
            for effect in self.manager.step(self.now):
                self._perform(effect)
        return self

    def _perform(self, effect: Effect) -> None:
        match effect:
            case Publish(message):
                for robot in self.robots.values():
                    robot.listen(message)
                kinds = {
                    ManagerState: self.states,
                    Event: self.events,
                    Estop: self.estops,
                    ZoneGeometry: self.geometry,
                    FramePose: self.frames,
                }
                kinds[type(message)].append(message)  # type: ignore[attr-defined, index]
            case WriteFrame():
                self.writes.append(effect)
            case WriteZone():
                self.zone_writes.append(effect)
            case Store(record):
                self.records.append(record)
            case Answer(request_id, reply):
                self.replies[request_id] = reply  # type: ignore[assignment]

    def ask(self, command: Command, heard: Heard | None = None) -> str:
        """Ask in view of the state `heard`, or else of the newest."""
        request_id = f"r{next(self._requests)}"
        if heard is None and self.states:
            heard = Heard(self.state.boot, self.state.sequence)
        self.manager.receive(Request(request_id, Call(request_id, command, heard)), self.now)
        return request_id

    def call(self, command: Command, heard: Heard | None = None) -> Reply:
        """Ask and run until the answer is there."""
        request_id = self.ask(command, heard)
        for _ in range(200):
            self.run(PERIOD_S)
            if request_id in self.replies:
                return self.replies[request_id]
        raise AssertionError("never answered")

    @property
    def state(self) -> ManagerState:
        return self.states[-1]

    @property
    def zone(self) -> ZoneStatus:
        return self.state.zones["middle"]

    def codes(self) -> list[str]:
        return [event.code for event in self.events]
