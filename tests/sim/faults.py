"""What may befall a cell, as a plan that is drawn before anything runs: the same plan on the same seed is the same run.

Each item has a time; many wait from then on for a moment that makes them worse, such as a robot that begins to enter a
zone. To shrink a failing plan is to leave items out.
"""

import random
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from cell.geometry import capsule_distance
from cell.messages import (
    Clearance,
    ClearZone,
    Confinement,
    ConfineRobot,
    Continue,
    Disable,
    Enable,
    Estop,
    ForceOutput,
    Halt,
    Mode,
    PlayoutState,
    ResetEstop,
    ResetRobot,
    Return,
    RobotState,
    Run,
    SetEstop,
    SetManual,
    SetOverride,
    Step,
    SwitchOutput,
    Token,
    ZoneState,
)
from cell.messages import Stop as StopProgram
from drive_gateway.config.settings import AxisSettings
from drive_gateway.gateway.bus.bus_news import BusBack, BusDisturbed, BusFailed, BusNews, SecondMaster
from drive_gateway.sim.nodes.node import SimulatedNode
from tests.sim.cells import GeneratedCell
from tests.sim.item import Item, Moment, Stage
from tests.sim.jog_key import hold_key
from tests.sim.judge.facts import Facts
from tests.sim.strangers import WRONG_DIGEST, Crowd, FalseEnd, FalsePresence, Guest, SaidAgain, SecondAgent, Strays

_OVERLOAD = 0x2310
"""An EMCY of the simulated drives: continuous overcurrent."""
OPERATORS = ("anna", "bert")
_BEFORE_CUT_S = 0.2
_SLIPS, _SLIPS_EVERY_S, _SLIPS_FOR_S = 0.006, 0.02, 0.4
"""[rad/s or m/s] Faster than what counts as rest for a gateway, and for so short a time that it is not alarmed."""
_UNHEARD_S, _NOT_HEARD_S = 1.5, (0.8, 1.5)
"""The echo of an order to a gateway may be 0.7 s old, of one to the manager 0.5 s."""
_CROWDED_S = 0.1
_COMES_S, _BLOCKED_S, _SILENT_S = 12.0, 0.3, 0.8
_WAVERS_S, _WAVER_LOOKS_S = 10.0, 0.02
_PUSHES, _OFF_WITHIN_S, _NEAR_M = 0.2, 3.0, 0.02
"""[rad/s or m/s] by hand; so long [s] until the drives are off; no push goes on so near to another robot."""
_CONFINED_M = 0.05
"""So much larger than the robot is the box of which an operator says that it stays there."""
MOMENTS = ("enters", "is inside", "leaves", "is granted", "asks", "moves fast", "brakes", "begins to move")
"""Of a robot."""
ROOM_MOMENTS = ("is cleared", "is refused", "waits for another", *MOMENTS[5:])
"""Of a robot in a cell without zones."""


@dataclass(frozen=True, slots=True)
class Kill(Item):
    """A process dies, and is started again after a while; `wrong`: first with another configuration."""

    kind: ClassVar[str] = "kill"
    process: str
    down_s: float
    wrong: bool = False

    def strike(self, stage: Stage) -> float:
        if self.process in stage.gone or not stage.world.processes[self.process].alive:
            return 0.0
        stage.world.kill(self.process)
        stage.gone.add(self.process)
        stage.world.clock.after(self.down_s, self._start, stage)
        return self.down_s + (2.0 if self.wrong else 0.0)

    def _start(self, stage: Stage) -> None:
        stage.gone.discard(self.process)
        if not self.wrong:
            stage.world.start(self.process)
            return
        stage.world.start(self.process, WRONG_DIGEST)
        stage.world.clock.after(1.5, self._right, stage)

    def _right(self, stage: Stage) -> None:
        if stage.world.processes[self.process].alive:
            stage.world.kill(self.process)
        stage.world.clock.after(0.3, stage.world.start, self.process)


@dataclass(frozen=True, slots=True)
class PowerCut(Item):
    """All computers of the cell lose their power, often under an emergency stop; each comes back in its own time."""

    kind: ClassVar[str] = "power cut"
    by: str
    stops: bool
    down_s: float

    def strike(self, stage: Stage) -> float:
        if self.stops:
            stop = SetEstop(f"{self.by}-{stage.facts.now:.3f}", self.by, "drawn")
            stage.world.operate("manager", stop, self.by)
        stage.world.clock.after(_BEFORE_CUT_S, self._cut, stage)
        return _BEFORE_CUT_S + self.down_s

    def _cut(self, stage: Stage) -> None:
        for number, name in enumerate(stage.world.processes):
            share = (1 + number) / len(stage.world.processes)
            Kill(0.0, None, name, self.down_s * share).strike(stage)


@dataclass(frozen=True, slots=True)
class Leave(Item):
    """A process is asked to end in order, and is started again."""

    kind: ClassVar[str] = "leave"
    process: str
    down_s: float

    def strike(self, stage: Stage) -> float:
        if self.process in stage.gone or not stage.world.processes[self.process].alive:
            return 0.0
        stage.world.stop(self.process)
        stage.gone.add(self.process)
        stage.world.clock.after(self.down_s, self._start, stage)
        return self.down_s

    def _start(self, stage: Stage) -> None:
        stage.gone.discard(self.process)
        if stage.world.processes[self.process].alive:
            stage.world.kill(self.process)
        stage.world.start(self.process)


@dataclass(frozen=True, slots=True)
class Freeze(Item):
    kind: ClassVar[str] = "freeze"
    process: str
    seconds: float

    def strike(self, stage: Stage) -> float:
        stage.world.freeze(self.process, self.seconds)
        return self.seconds


@dataclass(frozen=True, slots=True)
class Cut(Item):
    """One direction of one link; `to` may be "*"."""

    kind: ClassVar[str] = "cut"
    frm: str
    to: str
    seconds: float

    def strike(self, stage: Stage) -> float:
        stage.world.network.cut(self.frm, self.to, self.seconds)
        return self.seconds


@dataclass(frozen=True, slots=True)
class Part(Item):
    """A group of processes and all others do not hear each other."""

    kind: ClassVar[str] = "partition"
    group: tuple[str, ...]
    seconds: float

    def strike(self, stage: Stage) -> float:
        stage.world.network.partition(self.group, self.seconds)
        return self.seconds


@dataclass(frozen=True, slots=True)
class Late(Item):
    kind: ClassVar[str] = "delay"
    frm: str
    to: str
    extra_s: float
    seconds: float

    def strike(self, stage: Stage) -> float:
        stage.world.network.delay(self.frm, self.to, self.extra_s, self.seconds)
        return self.seconds + self.extra_s


@dataclass(frozen=True, slots=True)
class Burst(Item):
    kind: ClassVar[str] = "burst"
    loss: float
    seconds: float

    def strike(self, stage: Stage) -> float:
        stage.world.network.burst(self.loss, self.seconds)
        return self.seconds


@dataclass(frozen=True, slots=True)
class Stop(Item):
    """An emergency stop by software, through some of its doors."""

    kind: ClassVar[str] = "estop"
    by: str
    doors: tuple[str, ...]

    def strike(self, stage: Stage) -> float:
        stop = Estop(f"{self.by}-{stage.facts.now:.3f}", True, self.by, "drawn")
        stage.world.raise_estop(stop, self.by, self.doors)
        return 3.0


@dataclass(frozen=True, slots=True)
class DriveFails(Item):
    """One drive of a robot: `emergency`, `drop-out`, `blocked`, or `deaf`: it takes set points, does not go there, and
    finds nothing wrong with that."""

    kind: ClassVar[str] = "drive"
    robot: str
    axis: int | None
    """None: the one that moves most."""
    what: str
    seconds: float

    def strike(self, stage: Stage) -> float:
        world, facts = stage.world, stage.facts
        facts.hindered_until[self.robot] = facts.now + self.seconds + 1.0
        gateway = facts.gateway_of(self.robot)
        axes = world.bundle.gateways[gateway.partition("/")[2]].robots[self.robot].axes
        axis = axes[self._fastest(facts, axes) if self.axis is None else self.axis % len(axes)]
        node = world.buses[gateway].nodes[axis.node_id]
        if self.what == "emergency":
            node.raise_emergency(_OVERLOAD)
            return 1.0
        if self.what == "drop-out":
            facts.silence(self.robot, self.seconds, heard=not world.buses[gateway].broken)
            node.silence(True)
            world.clock.after(self.seconds, self._back, stage, node)
        elif self.what == "deaf":
            servo = node.drives[axis.number - 1].servo
            servo.interpolate = lambda _target, _period_s: None  # type: ignore[method-assign]
            world.clock.after(self.seconds, servo.__dict__.pop, "interpolate", None)
        else:
            servo = node.drives[axis.number - 1].servo
            servo.block(True)
            world.clock.after(self.seconds, servo.block, False)
        return self.seconds

    def _back(self, stage: Stage, node: SimulatedNode) -> None:
        """The node is heard again, once nothing else is to keep a node of the robot off the bus."""
        left_s = stage.facts.silenced[self.robot][1] - stage.facts.now
        if left_s > 0.0:
            stage.world.clock.after(left_s, self._back, stage, node)
        else:
            node.silence(False)

    def _fastest(self, facts: Facts, axes: Sequence[AxisSettings]) -> int:
        feedback = facts.feedback[self.robot]
        rates = [abs(v) / axis.following_window for v, axis in zip(feedback.velocity, axes, strict=True)]
        return rates.index(max(rates))


@dataclass(frozen=True, slots=True)
class BusTrouble(Item):
    """The bus of a robot: `failed` for a while, `disturbed`, with a `second master`, or `crowded` by frames that nobody
    asked for."""

    kind: ClassVar[str] = "bus"
    robot: str
    what: str
    seconds: float

    def strike(self, stage: Stage) -> float:
        world, gateway = stage.world, stage.facts.gateway_of(self.robot)
        port = world.buses[gateway].port
        if port is None or not world.processes[gateway].alive:
            return 0.0
        match self.what:
            case "failed":
                self._fail(stage, gateway)
            case "disturbed":
                port.tell(BusDisturbed("drawn"))
            case "second master":
                port.tell(SecondMaster("drawn"))
            case _:
                self._crowd(stage, gateway, stage.facts.now + self.seconds)
        return self.seconds

    def _fail(self, stage: Stage, gateway: str) -> None:
        world, facts = stage.world, stage.facts
        for robot in facts.robots:
            if facts.gateway_of(robot) == gateway:
                facts.hindered_until[robot] = facts.now + self.seconds + 1.0
                facts.silence(robot, self.seconds)
        world.buses[gateway].broken = True
        self._tell(stage, gateway, BusFailed("drawn"))
        world.clock.after(self.seconds, self._back, stage, gateway)

    def _back(self, stage: Stage, gateway: str) -> None:
        stage.world.buses[gateway].broken = False
        self._tell(stage, gateway, BusBack())

    def _tell(self, stage: Stage, gateway: str, news: BusNews) -> None:
        port = stage.world.buses[gateway].port
        if port is not None:
            port.tell(news)

    def _crowd(self, stage: Stage, gateway: str, until: float) -> None:
        bus, port = stage.world.bundle.gateways[gateway.partition("/")[2]].bus, stage.world.buses[gateway].port
        if port is not None:
            port.bits += round(bus.bitrate * _CROWDED_S)
        if stage.facts.now < until:
            stage.world.clock.after(_CROWDED_S, self._crowd, stage, gateway, until)


@dataclass(frozen=True, slots=True)
class BlockedInFront(Item):
    """Whenever the robot comes to a zone that another holds, something holds the axis that moves most, while its
    command goes on to where it has to wait. `silent`: it is its own zone, and the manager falls silent first."""

    kind: ClassVar[str] = "blocked in front of a zone"
    robot: str
    times: int
    silent: bool
    early_s: float
    """So long before it would be inside."""

    def strike(self, stage: Stage) -> float:
        self._look(stage, stage.facts.now + _COMES_S, self.times)
        return 0.0

    def _look(self, stage: Stage, until: float, times: int) -> None:
        facts, world = stage.facts, stage.world
        comes = self._comes(facts)
        if comes and self.silent:
            world.network.cut("manager", f"robot/{self.robot}", _SILENT_S)
            world.clock.after(facts.cell.times.fresh_s - _WAVER_LOOKS_S, self._block, stage)
        elif comes:
            self._block(stage)
        if comes:
            facts.troubled_until = max(facts.troubled_until, facts.now + _SILENT_S)
            times -= 1
        if times > 0 and facts.now < until:
            world.clock.after(4.0 * _BLOCKED_S if comes else _WAVER_LOOKS_S, self._look, stage, until, times)

    def _block(self, stage: Stage) -> None:
        DriveFails(0.0, None, self.robot, None, "blocked", _BLOCKED_S).strike(stage)

    def _comes(self, facts: Facts) -> bool:
        shown, manager, feedback = facts.shown.get(self.robot), facts.manager, facts.feedback.get(self.robot)
        if shown is None or manager is None or feedback is None or not feedback.enabled:
            return False
        if not facts.moving(self.robot):
            return False
        wants, holds = shown.message.wants, shown.message.holds
        if self.silent:
            outside = (zone for zone in holds if zone in wants and not shown.touches(zone, facts.boxes[zone]))
            return any(wants[zone] < self.early_s + facts.cell.times.fresh_s for zone in outside)
        return any(wants[zone] < self.early_s for zone in wants if manager.zones[zone].holder not in (None, self.robot))


@dataclass(frozen=True, slots=True)
class Sags(Item):
    """A drive of a robot fails, and the brake of its last axis slips now and then: too slowly and too shortly for any
    alarm. An operator acknowledges the fault meanwhile."""

    kind: ClassVar[str] = "brake slips"
    by: str
    robot: str
    seconds: float

    def strike(self, stage: Stage) -> float:
        DriveFails(0.0, None, self.robot, 0, "emergency", self.seconds).strike(stage)
        self._look(stage, stage.facts.now + self.seconds)
        return self.seconds

    def _look(self, stage: Stage, until: float) -> None:
        facts, world = stage.facts, stage.world
        feedback = facts.feedback.get(self.robot)
        slips = feedback is not None and feedback.state is PlayoutState.FAULT
        if slips:
            facts.slips_until[self.robot] = facts.now + 2.0 * _SLIPS_FOR_S
            self._slip(stage, facts.now + _SLIPS_FOR_S)
            to = f"robot/{self.robot}"
            world.clock.after(0.6 * _SLIPS_FOR_S, world.operate, to, ResetRobot(), self.by)
        if facts.now < until:
            world.clock.after(2.5 * _SLIPS_FOR_S if slips else _SLIPS_EVERY_S, self._look, stage, until)

    def _slip(self, stage: Stage, until: float) -> None:
        world, gateway = stage.world, stage.facts.gateway_of(self.robot)
        axis = world.bundle.gateways[gateway.partition("/")[2]].robots[self.robot].axes[-1]
        counts = round(_SLIPS * _SLIPS_EVERY_S * abs(axis.counts_per_unit))
        world.buses[gateway].nodes[axis.node_id].drives[axis.number - 1].servo.jump(counts)
        if stage.facts.now < until:
            world.clock.after(_SLIPS_EVERY_S, self._slip, stage, until)


@dataclass(frozen=True, slots=True)
class Pushed(Item):
    """An operator switches a robot off and pushes it by hand: its first axis, until it is `far` away or comes near
    another one."""

    kind: ClassVar[str] = "pushed"
    by: str
    robot: str
    far: float
    """[rad or m], with its sign."""

    def strike(self, stage: Stage) -> float:
        world, to = stage.world, f"robot/{self.robot}"
        lasts_s = _OFF_WITHIN_S + abs(self.far) / _PUSHES
        stage.staff.leave_alone(self.robot, lasts_s)
        world.operate(to, Halt(), self.by)
        world.clock.after(0.6, world.operate, to, Disable(), self.by)
        self._look(stage, stage.facts.now + _OFF_WITHIN_S)
        return lasts_s

    def _look(self, stage: Stage, until: float) -> None:
        facts = stage.facts
        feedback = facts.feedback.get(self.robot)
        if feedback is not None and not feedback.enabled and not facts.moving(self.robot):
            self._push(stage, abs(self.far))
        elif facts.now < until:
            stage.world.clock.after(_SLIPS_EVERY_S, self._look, stage, until)

    def _push(self, stage: Stage, left: float) -> None:
        facts, world, gateway = stage.facts, stage.world, stage.facts.gateway_of(self.robot)
        feedback = facts.feedback[self.robot]
        if left <= 0.0 or feedback.enabled or self._near(facts):
            return
        facts.hindered_until[self.robot] = facts.slips_until[self.robot] = facts.now + 1.0
        axis = world.bundle.gateways[gateway.partition("/")[2]].robots[self.robot].axes[0]
        step = _PUSHES * _SLIPS_EVERY_S
        counts = round(np.sign(self.far) * step * abs(axis.counts_per_unit))
        world.buses[gateway].nodes[axis.node_id].drives[axis.number - 1].servo.jump(counts)
        world.clock.after(_SLIPS_EVERY_S, self._push, stage, left - step)

    def _near(self, facts: Facts) -> bool:
        """Whether it would soon hit another one."""
        points, radii = self._body(facts, self.robot)
        others = (self._body(facts, other) for other in facts.robots if other != self.robot)
        return any(float(capsule_distance(points[:, None], radii[:, None], *its).min()) < _NEAR_M for its in others)

    def _body(self, facts: Facts, robot: str) -> tuple[np.ndarray, np.ndarray]:
        return facts.points(robot, facts.measured(robot)[None])[0], facts.world.models[robot].capsule_radii


@dataclass(frozen=True, slots=True)
class JournalFails(Item):
    """The manager dies, and finds its journal lost, or older than it was."""

    kind: ClassVar[str] = "journal"
    what: str
    down_s: float

    def strike(self, stage: Stage) -> float:
        world = stage.world
        if "manager" in stage.gone or not world.processes["manager"].alive:
            return 0.0
        world.kill("manager")
        stage.facts.journal_spoilt = True
        if self.what == "lost":
            world.journal.lose()
        else:
            world.journal.roll_back(1)
        stage.gone.add("manager")
        world.clock.after(self.down_s, self._start, stage)
        return self.down_s

    def _start(self, stage: Stage) -> None:
        stage.gone.discard("manager")
        stage.world.start("manager")


@dataclass(frozen=True, slots=True)
class JournalFull(Item):
    """Nothing more can be written for a while; a manager that ends by that is started again."""

    kind: ClassVar[str] = "journal full"
    seconds: float

    def strike(self, stage: Stage) -> float:
        stage.world.journal.fill(True)
        stage.facts.journal_spoilt = True
        stage.world.clock.after(self.seconds, self._room, stage)
        return self.seconds

    def _room(self, stage: Stage) -> None:
        stage.world.journal.fill(False)
        if "manager" not in stage.gone:
            stage.world.start("manager")


@dataclass(frozen=True, slots=True)
class ClockStep(Item):
    """The wall clock of a process' computer is set."""

    kind: ClassVar[str] = "clock"
    process: str
    seconds: float

    def strike(self, stage: Stage) -> float:
        stage.world.hosts[self.process].step(self.seconds)
        return 0.0


@dataclass(frozen=True, slots=True)
class Order(Item):
    """An operator's call to a robot, at a bad moment; `then` is called so much later."""

    kind: ClassVar[str] = "order"
    by: str
    robot: str
    order: str
    then: str = ""
    then_s: float = 0.0

    def strike(self, stage: Stage) -> float:
        if self.then:
            stage.staff.leave_alone(self.robot, self.then_s)
        self._call(stage, self.order)
        if self.then:
            stage.world.clock.after(self.then_s, self._call, stage, self.then)
        return self.then_s

    def _call(self, stage: Stage, order: str) -> None:
        stage.world.operate(f"robot/{self.robot}", ORDERS[order](), self.by)


ORDERS: dict[str, Callable[[], object]] = {
    "enable": Enable,
    "disable": Disable,
    "run": Run,
    "halt": Halt,
    "continue": Continue,
    "return": Return,
    "step": Step,
    "reset": ResetRobot,
    "override 20": lambda: SetOverride(20.0),
    "override 0": lambda: SetOverride(0.0),
    "override -50": lambda: SetOverride(-50.0),
    "override 100": lambda: SetOverride(100.0),
    "stop": StopProgram,
    "manual": lambda: SetManual(True),
    "automatic": lambda: SetManual(False),
}


@dataclass(frozen=True, slots=True)
class OrderAll(Item):
    """An operator halts all robots of the cell at once, or stops their programs; `then` is called so much later."""

    kind: ClassVar[str] = "order to all"
    by: str
    order: str
    then: str
    then_s: float

    def strike(self, stage: Stage) -> float:
        for robot in stage.facts.robots:
            Order(0.0, None, self.by, robot, self.order, self.then, self.then_s).strike(stage)
        return self.then_s


@dataclass(frozen=True, slots=True)
class Waver(Item):
    """An operator who cannot decide: for a while he halts a robot each time that it is given a zone, before it is
    inside, and lets it go on at once. News of the manager come to the robot `late_s` after they were sent, so it may
    want again what it has just given up, and not have heard yet that it was taken back."""

    kind: ClassVar[str] = "wavering operator"
    by: str
    robot: str
    then_s: float
    late_s: float

    def strike(self, stage: Stage) -> float:
        stage.world.network.delay("manager", f"robot/{self.robot}", self.late_s, _WAVERS_S)
        self._look(stage, stage.facts.now + _WAVERS_S, set())
        return _WAVERS_S

    def _look(self, stage: Stage, until: float, seen: set[Token]) -> None:
        facts = stage.facts
        shown, manager = facts.shown.get(self.robot), facts.manager
        for zone, status in manager.zones.items() if manager is not None else ():
            if shown is None or status.holder != self.robot or status.token is None or status.token in seen:
                continue
            if not shown.touches(zone, facts.boxes[zone]):
                seen.add(status.token)
                then_s = self.then_s * (0.5 + 0.5 * (len(seen) % 4))
                # One that does not hold it yet hears of it late, and halted.
                self._waver(stage, then_s if zone in shown.message.holds else then_s + self.late_s)
        if facts.now < until:
            stage.world.clock.after(_WAVER_LOOKS_S, self._look, stage, until, seen)

    def _waver(self, stage: Stage, then_s: float) -> None:
        to = f"robot/{self.robot}"
        stage.world.operate(to, Halt(), self.by)
        stage.world.clock.after(then_s, stage.world.operate, to, Continue(), self.by)


@dataclass(frozen=True, slots=True)
class JogPress(Item):
    """An operator halts a robot, jogs it, and lets the key go, or vanishes."""

    kind: ClassVar[str] = "jog"
    by: str
    robot: str
    axis: str
    speed: float
    held_s: float
    lets_go: bool

    def strike(self, stage: Stage) -> float:
        world, to = stage.world, f"robot/{self.robot}"
        stage.staff.leave_alone(self.robot, 1.5 + self.held_s)
        world.operate(to, Halt(), self.by)
        world.clock.after(0.6, self._press, stage)
        return 0.6 + self.held_s

    def _press(self, stage: Stage) -> None:
        hold_key(stage.world, self.by, self.robot, self.axis, self.speed, self.held_s, lets_go=self.lets_go)


@dataclass(frozen=True, slots=True)
class Hasty(Item):
    """An operator who wants a zone cleared as soon as he sees it given to a robot, before that is inside."""

    kind: ClassVar[str] = "hasty operator"
    by: str

    def strike(self, stage: Stage) -> float:
        self._look(stage, stage.facts.now + _WAVERS_S, set())
        return 0.0

    def _look(self, stage: Stage, until: float, seen: set[Token]) -> None:
        facts, world = stage.facts, stage.world
        manager = facts.manager
        for zone, status in manager.zones.items() if manager is not None else ():
            if status.state is not ZoneState.GRANTED or status.token is None or status.token in seen:
                continue
            if not any(zone in facts.inside_now(robot) for robot in facts.robots):
                seen.add(status.token)
                world.operate("manager", ClearZone(zone, self.by), self.by)
        if facts.now < until:
            world.clock.after(_WAVER_LOOKS_S, self._look, stage, until, seen)


@dataclass(frozen=True, slots=True)
class ZoneOrder(Item):
    """An operator clears a zone, or lets a robot adopt it; an honest one, who has looked first."""

    kind: ClassVar[str] = "zone order"
    by: str
    zone: str
    clear: bool

    def strike(self, stage: Stage) -> float:
        if self.clear:
            stage.staff.clear(self.by, self.zone)
        else:
            stage.staff.adopt(self.by, self.zone)
        return 0.0


@dataclass(frozen=True, slots=True)
class LateOrder(Item):
    """An operator who has heard nothing of a robot, of its gateway or of the manager for a while gives it an order; an
    honest one of the manager, who looks at the robots."""

    kind: ClassVar[str] = "late order"
    by: str
    robot: str
    to: str
    """robot, gateway or manager."""
    unheard_s: float

    def strike(self, stage: Stage) -> float:
        name = {"robot": f"robot/{self.robot}", "gateway": stage.facts.gateway_of(self.robot)}.get(self.to, self.to)
        stage.world.operator(self.by).heard(name)
        stage.world.network.cut(name, self.by, self.unheard_s + 0.5)
        stage.world.clock.after(self.unheard_s, self._order, stage, name)
        return 0.0

    def _order(self, stage: Stage, name: str) -> None:
        operate, staff = stage.world.operate, stage.staff
        match self.to:
            case "robot":
                operate(name, SetOverride(80.0), self.by)
            case "gateway":
                operate(name, SwitchOutput(self.robot, "gripper", False, self.by), self.by)
                operate(name, ForceOutput(self.robot, "gripper", None, self.by), self.by)
            case _:
                manager = stage.world.operator(self.by).manager
                seen = () if manager is None else manager.estops
                operate(name, ResetEstop(self.by, tuple(estop.id for estop in seen)), self.by)
                for zone in stage.facts.boxes:
                    staff.clear(self.by, zone)
                    staff.adopt(self.by, zone)


@dataclass(frozen=True, slots=True)
class ResetStop(Item):
    """An operator resets the emergency stop that is seen, whoever has set it and why."""

    kind: ClassVar[str] = "reset stop"
    by: str

    def strike(self, stage: Stage) -> float:
        stage.staff.reset_estop(self.by)
        return 0.0


@dataclass(frozen=True, slots=True)
class Switch(Item):
    """An operator switches a robot's output by hand."""

    kind: ClassVar[str] = "output"
    by: str
    robot: str
    on: bool

    def strike(self, stage: Stage) -> float:
        gateway = stage.facts.gateway_of(self.robot)
        stage.world.operate(gateway, SwitchOutput(self.robot, "gripper", self.on, self.by), self.by)
        return 0.0


@dataclass(frozen=True, slots=True)
class Force(Item):
    """An operator keeps a robot's output on or off for a test, and lets it follow its program again after a while."""

    kind: ClassVar[str] = "forced output"
    by: str
    robot: str
    on: bool
    held_s: float

    def strike(self, stage: Stage) -> float:
        self._order(stage, self.on)
        stage.world.clock.after(self.held_s, self._order, stage, None)
        return 0.0

    def _order(self, stage: Stage, on: bool | None) -> None:
        order = ForceOutput(self.robot, "gripper", on, self.by)
        stage.world.operate(stage.facts.gateway_of(self.robot), order, self.by)


@dataclass(frozen=True, slots=True)
class Confine(Item):
    """The agent of a robot dies, and before it is started again an operator who sees the robot stand says in which box
    it stays; where nobody waits for it by that, the manager refuses it."""

    kind: ClassVar[str] = "confine"
    by: str
    robot: str
    down_s: float
    said_s: float

    def strike(self, stage: Stage) -> float:
        lasts_s = Kill(0.0, None, f"robot/{self.robot}", self.down_s).strike(stage)
        stage.world.clock.after(self.said_s, self._say, stage)
        return lasts_s

    def _say(self, stage: Stage) -> None:
        facts = stage.facts
        if facts.moving(self.robot):
            return
        ends = facts.points(self.robot, facts.measured(self.robot)[None]).reshape(-1, 3)
        around = facts.world.models[self.robot].capsule_radii.max() + _CONFINED_M
        low, high = ends.min(axis=0) - around, ends.max(axis=0) + around
        (x, y, z), (length, width, height) = (0.5 * (low + high)).tolist(), (high - low).tolist()
        box = Confinement((length, width, height), (x, y, z), (0.0, 0.0, 0.0, 1.0))
        stage.world.operate("manager", ConfineRobot(self.robot, box, self.by), self.by)


KINDS: tuple[type[Item], ...] = (
    Kill, PowerCut, Leave, Freeze, Cut, Part, Late, Burst, Stop, DriveFails, BusTrouble, BlockedInFront, Sags, Pushed,
    JournalFails, JournalFull, ClockStep,
    Order, OrderAll, JogPress, Waver, LateOrder, Hasty, ZoneOrder, ResetStop, Switch, Force, Confine,
    Strays, SaidAgain, FalsePresence, FalseEnd, Guest, Crowd, SecondAgent,
)  # fmt: skip


# Drawing

THEMES: tuple[dict[str, int], ...] = (
    {
        "kill": 16, "freeze": 12, "cut": 10, "part": 8, "late": 8, "burst": 3, "stop": 8, "drive": 8, "journal": 3,
        "clock": 2, "order": 16, "jog": 6, "zone": 3, "switch": 3, "leave": 2, "reset": 2, "waver": 2, "power": 2,
    },
    {"waver": 8, "order": 2, "late": 1},
    {"kill": 6, "leave": 2, "cut": 3, "part": 2, "late": 2, "journal": 1},
    {"stop": 5, "drive": 4, "reset": 2, "jog": 2, "switch": 1, "freeze": 1, "power": 3},
    {"cut": 4, "kill": 3, "freeze": 2, "zone": 4, "order": 1},
)  # fmt: skip
"""What may befall a cell, and how often: everything, or few kinds that need each other to do harm."""


def draw_plan(seed: int, cell: GeneratedCell, lasting_s: float) -> tuple[Item, ...]:
    """What befalls the cell within `lasting_s` of the start; the later part is left to what waits for its moment."""
    rng = random.Random(f"plan {seed}")
    theme, zones = rng.choices(THEMES, [6, 1, 1, 1, 1])[0], cell.bundle.cell.zones
    if not zones:
        theme = {what: share for what, share in theme.items() if what != "zone"}
    items: list[Item] = []
    for _ in range(rng.choice([3, 5, 6, 8] if zones else [2, 3, 4])):
        robot, at_s = rng.choice(sorted(cell.bundle.cell.robots)), rng.uniform(0.5, 0.7 * lasting_s)
        what = rng.choices(*((MOMENTS, [2, 2, 2, 3, 2, 1, 1, 1]) if zones else (ROOM_MOMENTS, [2, 3, 3, 2, 2, 1])))[0]
        # What comes together is worse than what comes alone.
        for _ in range(rng.choice([1, 1, 2])):
            moment = Moment(robot, what, rng.choice([0.0, rng.uniform(0.0, 0.3), rng.uniform(0.2, 0.6)]))
            items.append(_item(rng, theme, cell, robot, (at_s, moment if rng.random() < 0.85 else None)))
    if any(isinstance(item, ClockStep) and item.process == "manager" and item.seconds < 0.0 for item in items):
        # Without a journal and with a clock that was set back no epoch can grow (docs/architecture.md, section 4.2).
        items = [item for item in items if not isinstance(item, JournalFails)]
    items += _each_in_its_turn(rng, seed, cell, lasting_s)
    it, by = rng.choice(sorted(cell.bundle.cell.robots)), rng.choice(OPERATORS)
    at_s, moment = rng.uniform(0.5, 0.6 * lasting_s), Moment(it, rng.choice(["moves fast", "begins to move"]))
    if seed % 4 == 1:
        items.append(Force(at_s, moment, by, it, rng.random() < 0.5, rng.uniform(0.2, 3.0)))
    elif seed % 4 == 3 and zones:
        down_s = rng.uniform(1.5, 3.0)
        items.append(Confine(at_s, moment, by, it, down_s, 0.8 * down_s))
    elif seed % 4 == 3:
        # While another one wants its room.
        other = rng.choice(sorted(cell.bundle.cell.robots.keys() - {it}))
        items.append(Confine(0.5, Moment(other, "is refused"), by, it, rng.uniform(3.0, 5.0), 1.0))
    elif not zones:
        far = rng.choice([-1.0, 1.0]) * rng.uniform(0.05, 0.4)
        items.append(Pushed(at_s, Moment(it, rng.choice(["is refused", "moves fast"])), by, it, far))
    return tuple(sorted(items, key=lambda item: item.at_s))


def _each_in_its_turn(rng: random.Random, seed: int, cell: GeneratedCell, lasting_s: float) -> list[Item]:
    """What is meant for one rule, and comes by itself hardly ever: some of it in each run, all of it in a few."""
    robots = sorted(cell.bundle.cell.robots)

    def when(latest: float) -> tuple[float, Moment | None]:
        return rng.uniform(0.5, latest * lasting_s), None

    def robot() -> str:
        return rng.choice(robots)

    def wavers() -> Item:
        return Waver(*when(0.3), rng.choice(OPERATORS), robot(), rng.uniform(0.02, 0.15), rng.uniform(0.05, 0.15))

    def power() -> Item:
        return PowerCut(*when(0.6), rng.choice(OPERATORS), True, rng.uniform(0.2, 2.0))

    def frozen_gateway() -> Item:
        it = robot()
        gateway = f"gateway/{cell.bundle.cell.robots[it].gateway}"
        return Freeze(when(0.5)[0], Moment(it, "moves fast"), gateway, rng.uniform(0.12, 0.35))

    def killed_at_speed() -> Item:
        it = robot()
        return Kill(when(0.5)[0], Moment(it, "moves fast"), f"robot/{it}", rng.uniform(0.5, 1.5))

    def jog() -> Item:
        speed = rng.choice([-1.0, 1.0]) * rng.uniform(0.05, 0.2)
        return JogPress(*when(0.6), rng.choice(OPERATORS), robot(), "J1", speed, rng.uniform(0.5, 1.5), False)

    def fails(what: str, moment: str) -> Item:
        it = robot()
        return DriveFails(when(0.5)[0], Moment(it, moment), it, None, what, rng.uniform(0.8, 1.5))

    def bus() -> Item:
        it, what = robot(), rng.choice(["failed", "failed", "disturbed", "second master", "crowded"])
        seconds = 2.5 if what == "crowded" else rng.uniform(0.3, 1.5)
        return BusTrouble(when(0.5)[0], Moment(it, "moves fast"), it, what, seconds)

    def long_halt() -> Item:
        return Order(
            when(0.5)[0], Moment(it := robot(), "moves fast"), rng.choice(OPERATORS), it, "halt", "continue", 2.8
        )

    turns: tuple[Callable[[], Item], ...] = (
        wavers,
        long_halt,
        lambda: Guest(*when(0.6)),
        lambda: Crowd(*when(0.6)),
        lambda: FalsePresence(*when(0.5), robot()),
        lambda: Hasty(*when(0.3), rng.choice(OPERATORS)),
        lambda: SaidAgain(*when(0.8), rng.choice(OPERATORS), robot()),
        power,
        frozen_gateway,
        killed_at_speed,
        jog,
        frozen_gateway,
        wavers,
        lambda: fails("drop-out", "moves fast"),
        lambda: fails("deaf", "moves fast"),
        lambda: Sags(*when(0.5), rng.choice(OPERATORS), robot(), rng.uniform(1.5, 2.5)),
        jog,
        bus,
    )
    always: list[Item] = [
        Strays(*when(0.6), robot()),
        SecondAgent(*when(0.6), robot()),
        LateOrder(*when(0.8), rng.choice(OPERATORS), robot(), "robot", _UNHEARD_S),
        *_said_to_others(seed, robots, lasting_s),
    ]
    if not cell.bundle.cell.zones:
        what = rng.choice(["blocked", "deaf"])
        always += [DriveFails(when(0.3)[0], Moment(it, "is refused"), it, None, what, _BLOCKED_S) for it in robots[:2]]
        return always + [turns[(seed + k) % len(turns)]() for k in (0, 7)]
    always += [
        BlockedInFront(*when(0.3), robot(), 2, False, 0.3),
        *(BlockedInFront(*when(0.3), each, 4, True, rng.uniform(0.15, 0.4)) for each in robots[:2]),
    ]
    return always + [turns[(seed + k) % len(turns)]() for k in (0, 3, 7, 12)]


def _said_to_others(seed: int, robots: Sequence[str], lasting_s: float) -> list[Item]:
    """What somebody says too late to the manager or to a gateway, of an emergency stop, and in a few runs to all robots
    at once. Drawn apart, so that all else of a plan is as it was without it."""
    rng = random.Random(f"said to others {seed}")
    to = ("manager", "gateway")[seed // 2 % 2]
    unheard_s = rng.uniform(*_NOT_HEARD_S)
    items: list[Item] = [
        LateOrder(rng.uniform(0.5, 0.8 * lasting_s), None, rng.choice(OPERATORS), rng.choice(robots), to, unheard_s),
        FalseEnd(0.5, None),
    ]
    order, then = rng.choice([("halt", "continue"), ("stop", "run")])
    moment = Moment(rng.choice(robots), rng.choice(["moves fast", "begins to move"]), rng.uniform(0.0, 0.3))
    all_at_s, by, then_s = rng.uniform(0.5, 0.6 * lasting_s), rng.choice(OPERATORS), rng.uniform(0.3, 2.0)
    return [*items, OrderAll(all_at_s, moment, by, order, then, then_s)] if seed % 4 == 2 else items


def _item(
    rng: random.Random, theme: dict[str, int], cell: GeneratedCell, robot: str, when: tuple[float, Moment | None]
) -> Item:
    agent, gateway = f"robot/{robot}", f"gateway/{cell.bundle.cell.robots[robot].gateway}"
    by = rng.choice(OPERATORS)
    down_s = rng.choice([rng.uniform(0.02, 0.3), rng.uniform(0.3, 2.0)])
    some = rng.choice(["manager", agent, agent, gateway])
    seconds = rng.choice(
        [rng.uniform(0.05, 0.3), rng.uniform(0.26, 1.0), rng.uniform(0.26, 1.0), rng.uniform(1.0, 3.0)]
    )
    ends = rng.choice(
        [("manager", agent), (agent, "manager"), (agent, "manager"), (agent, gateway), (gateway, agent), (agent, "*")]
    )
    match rng.choices(list(theme), list(theme.values()))[0]:
        case "waver":
            # Grants that are given up and wanted again, while the link brings news of before.
            if rng.random() < 0.3:
                return Late(*when, "manager", agent, rng.uniform(0.05, 0.22), rng.uniform(0.5, 3.0))
            return Waver(*when, by, robot, rng.uniform(0.02, 0.15), rng.uniform(0.0, 0.15))
        case "kill":
            return Kill(*when, rng.choice(["manager", "manager", agent, agent, gateway]), down_s, rng.random() < 0.1)
        case "freeze":
            return Freeze(*when, some, min(seconds, 1.5))
        case "cut":
            return Cut(*when, *ends, seconds)
        case "part":
            group = rng.choice([("manager",), (agent,), (agent, gateway), ("manager", agent), tuple(OPERATORS)])
            return Part(*when, group, seconds)
        case "late":
            return Late(*when, *ends, rng.choice([rng.uniform(0.1, 0.6), rng.uniform(0.6, 3.0)]), seconds)
        case "burst":
            return Burst(*when, rng.uniform(0.3, 0.9), seconds)
        case "stop":
            doors = [("manager", "gateways", "agents"), ("manager",), ("gateways",), ("agents",), ("manager", "agents")]
            return Stop(*when, by, rng.choice(doors))
        case "drive":
            what = rng.choice(["emergency", "emergency", "drop-out", "blocked"])
            return DriveFails(*when, robot, rng.randrange(6), what, rng.uniform(0.1, 1.5))
        case "journal":
            if rng.random() < 0.3:
                return JournalFull(*when, rng.uniform(0.5, 3.0))
            return JournalFails(*when, rng.choice(["lost", "old"]), down_s)
        case "clock":
            # Without a store and with a clock that was set back a gateway's claims cannot grow (section 4.2 again).
            steps = [5.0, 3600.0] if some == gateway else [-3600.0, -5.0, 5.0, 3600.0]
            return ClockStep(*when, some, rng.choice(steps))
        case "order":
            return _order(rng, when, by, robot)
        case "jog":
            axis = rng.choice(["J1", "J1", "J2", "X", "X", "Y", "Z"])
            speed = rng.choice([-1.0, 1.0]) * rng.uniform(0.05, 0.3)
            return JogPress(*when, by, robot, axis, speed, rng.uniform(0.2, 2.5), rng.random() < 0.6)
        case "zone":
            return ZoneOrder(*when, by, rng.choice(sorted(cell.bundle.cell.zones)), rng.random() < 0.6)
        case "switch":
            return Switch(*when, by, robot, rng.random() < 0.5)
        case "power":
            return PowerCut(*when, by, rng.random() < 0.7, rng.uniform(0.2, 2.0))
        case "leave":
            return Leave(*when, rng.choice([agent, gateway]), rng.uniform(1.0, 3.0))
        case _:
            return ResetStop(*when, by)


def _order(rng: random.Random, when: tuple[float, Moment | None], by: str, robot: str) -> Order:
    first, then = rng.choice(
        [
            ("halt", "continue"), ("halt", "continue"), ("halt", "continue"), ("halt", "run"), ("halt", "step"),
            ("step", "continue"), ("override 20", "override 100"), ("override 0", "override 100"),
            ("override -50", "override 100"), ("manual", "automatic"), ("disable", "enable"), ("halt", "disable"),
            ("reset", ""), ("return", ""), ("run", ""), ("enable", ""), ("continue", ""),
        ]
    )  # fmt: skip
    later_s = rng.choice(
        [rng.uniform(0.01, 0.06), rng.uniform(0.06, 0.2), rng.uniform(0.2, 0.6), rng.uniform(0.6, 2.0)]
    )
    return Order(*when, by, robot, first, then, later_s)


# Running it


def meets_another(clearance: Clearance) -> bool:
    """Whether the robot is refused room for where another one is, or is to go."""
    return clearance.refused is not None and clearance.refused.text.startswith(clearance.robot)


class Play:
    """Lets the items of a plan happen."""

    def __init__(self, stage: Stage, plan: Sequence[Item]) -> None:
        self._stage = stage
        self._waiting: list[Item] = []
        self.struck: list[tuple[float, Item]] = []
        self.active = True
        self._held: dict[str, frozenset[str]] = {}
        self._touched: dict[str, frozenset[str]] = {}
        self._asked: dict[str, frozenset[str]] = {}
        self._states: dict[str, RobotState] = {}
        for name in OPERATORS:
            stage.world.operator(name)  # who watches from the beginning: nobody is answered who has heard nothing yet
        for item in plan:
            stage.world.clock.after(item.at_s, self._due, item)
        stage.world.on_published.append(self._look)

    def _due(self, item: Item) -> None:
        if item.moment is None:
            self._strike(item)
        else:
            self._waiting.append(item)

    def _strike(self, item: Item) -> None:
        if not self.active:
            return
        facts = self._stage.facts
        self.struck.append((facts.now - facts.start, item))
        lasts_s = item.strike(self._stage)
        facts.troubled_until = max(facts.troubled_until, facts.now + lasts_s)

    def _happens(self, robot: str, what: str) -> None:
        for item in [each for each in self._waiting if each.moment is not None]:
            moment = item.moment
            if moment is not None and (moment.robot, moment.what) == (robot, what):
                self._waiting.remove(item)
                # Never in the middle of a step: a process is not killed by what it sends.
                self._stage.world.clock.after(moment.after_s, self._strike, item)

    def _look(self, name: str, message: object) -> None:
        if not self._waiting:
            return
        facts = self._stage.facts
        role, _, robot = name.partition("/")
        if isinstance(message, Clearance):
            self._clearance(message)
        elif isinstance(message, RobotState):
            self._state(robot, message)
            shown = facts.shown.get(robot)
            if shown is not None:
                self._presence(robot, frozenset(z for z, box in facts.boxes.items() if shown.touches(z, box)))
                asks = frozenset(shown.message.wants)
                if asks - self._asked.get(robot, frozenset()):
                    self._happens(robot, "asks")
                self._asked[robot] = asks
        elif role == "manager" and facts.manager is not None:
            for each in facts.robots:
                held = frozenset(zone for zone, status in facts.manager.zones.items() if status.holder == each)
                if held - self._held.get(each, frozenset()):
                    self._happens(each, "is granted")
                self._held[each] = held
                if any(facts.manager.zones[zone].state is ZoneState.OCCUPIED for zone in held):
                    self._happens(each, "is inside")

    def _clearance(self, clearance: Clearance) -> None:
        if meets_another(clearance):
            self._happens(clearance.robot, "is refused")
        elif clearance.cleared:
            self._happens(clearance.robot, "is cleared")

    def _presence(self, robot: str, touched: frozenset[str]) -> None:
        before = self._touched.get(robot, touched)
        self._touched[robot] = touched
        if touched - before:
            self._happens(robot, "enters")
        if before - touched:
            self._happens(robot, "leaves")

    def _state(self, robot: str, state: RobotState) -> None:
        before = self._states.get(robot)
        self._states[robot] = state
        speed = state.tcp_speed_m_s or 0.0
        slow = 0.0 if before is None else before.tcp_speed_m_s or 0.0
        if state.mode is Mode.RUNNING and speed > 0.4:
            self._happens(robot, "moves fast")
        if state.waiting_for.startswith(robot) and (before is None or not before.waiting_for):
            self._happens(robot, "waits for another")
        if before is not None and before.mode is Mode.RUNNING and state.mode is not Mode.RUNNING and speed > 0.02:
            self._happens(robot, "brakes")
        if slow == 0.0 < speed:
            self._happens(robot, "begins to move")


def without(plan: Sequence[Item], left_out: set[int]) -> tuple[Item, ...]:
    """A plan without the items of these numbers."""
    return tuple(item for number, item in enumerate(plan) if number not in left_out)


def at_once(item: Item) -> Item:
    """The same without its moment."""
    return replace(item, moment=None)
