"""A cell of `cell_configs` in one process: manager, agents, gateways, drives, wired over a bad network."""

import random
from collections.abc import Callable, Collection
from dataclasses import dataclass, field, replace
from pathlib import Path

from cell.commands.checks import CellBundle, check_cell
from cell.commands.robot_loads import robot_loads
from cell.core import Answer, Arrived, Ask, AskDone, Core, Effect, Publish, Request
from cell.manager.core import ManagerCore
from cell.manager.records import EstopCleared, EstopLatched, Record, Store, Stored, next_epoch
from cell.messages import (
    Call,
    Command,
    DriveFeedback,
    Estop,
    Event,
    GatewayState,
    Heard,
    JogHeld,
    ManagerState,
    Presence,
    Reply,
    RobotState,
    SetEstop,
    SetpointBlock,
    TokenGone,
    ZoneGeometry,
)
from drive_gateway.canopen.sdo import Sdo
from drive_gateway.gateway.core import GatewayCore
from drive_gateway.gateway.effects import Frame
from robot_agent.agent.core import AgentCore
from robot_agent.agent.planning import Plan, Planned, Planner
from robot_agent.agent.shell import PERIOD_S as AGENT_PERIOD_S
from robot_agent.agent.shell import base_pose
from robot_agent.kinematics import model_of
from robot_agent.language import parse_program
from robot_agent.trajectory import Limits
from tests.sim.bus import Bus
from tests.sim.clock import Clock
from tests.sim.host import Host
from tests.sim.network import Network, Weather
from tests.sim.process import Process

TWO_ARMS = Path(__file__).parents[2] / "cell_configs" / "two_arms" / "cell.yaml"
MANAGER_PERIOD_S = 0.01
ANSWER_TIMEOUT_S = 5.0
_BUS_STEP_S = 0.01
_UNIX_S = 1_700_000_000.0
_LARGEST_OFFSET_S = 10_000.0
_LARGEST_DRIFT_PPM = 50.0


class JournalFull(Exception):
    """A write that found no room."""


def load_bundle(cell_file: Path = TWO_ARMS) -> CellBundle:
    """A cell, as `cell up` would load it."""
    bundle, problems = check_cell(cell_file)
    assert bundle is not None, problems
    return bundle


class Disk:
    """What the manager's journal holds, and what may become of it."""

    def __init__(self) -> None:
        self.stored = Stored()
        self._full = False
        self._before: list[Stored] = []

    def write(self, stored: Stored) -> None:
        if self._full:
            raise JournalFull
        self._before.append(self.stored)
        self.stored = stored

    def lose(self) -> None:
        """The file is gone at the manager's next start."""
        self.stored = Stored()

    def fill(self, full: bool) -> None:
        """Whether writing fails."""
        self._full = full

    def roll_back(self, n: int) -> None:
        """The newest `n` writes are gone at the manager's next start."""
        for _ in range(min(n, len(self._before))):
            self.stored = self._before.pop()


@dataclass
class Eyes:
    """What one operator has heard."""

    robots: dict[str, RobotState] = field(default_factory=dict)
    manager: ManagerState | None = None
    gateways: dict[str, GatewayState] = field(default_factory=dict)

    def heard(self, to: str) -> Heard | None:
        """The echo for a call to a process."""
        role, _, name = to.partition("/")
        of_robot_or_gateway = self.robots.get(name) if role == "robot" else self.gateways.get(name)
        state = self.manager if role == "manager" else of_robot_or_gateway
        return Heard(state.boot, state.sequence) if state is not None else None

    def see(self, message: object) -> None:
        match message:
            case RobotState():
                self.robots[message.robot] = message
            case ManagerState():
                self.manager = message
            case GatewayState():
                self.gateways[message.gateway] = message


@dataclass
class Observed:
    """What was sent, however it fared: for the operator's eyes and for the checks."""

    robots: dict[str, RobotState] = field(default_factory=dict)
    manager: ManagerState | None = None
    gateways: dict[str, GatewayState] = field(default_factory=dict)
    feedback: dict[str, DriveFeedback] = field(default_factory=dict)
    events: list[Event] = field(default_factory=list)
    planned: dict[str, list[Planned]] = field(default_factory=dict)
    replies: list[tuple[str, Command, Reply | None]] = field(default_factory=list)


class World:
    """All processes of the cell on one clock. The same seed gives the same run."""

    def __init__(self, bundle: CellBundle, seed: int, weather: Weather) -> None:
        self.bundle = bundle
        self.cell = bundle.cell
        self.clock = Clock()
        self.rng = random.Random(seed)
        self.network = Network(weather, self.rng, lambda: self.clock.now)
        self.journal = Disk()
        self.seen = Observed(planned={robot: [] for robot in self.cell.robots})
        self.on_feedback: list[Callable[[DriveFeedback], None]] = []
        self.on_published: list[Callable[[str, object], None]] = []
        self.on_delivered: list[Callable[[str, object], None]] = []
        self.on_effect: list[Callable[[str, Effect], None]] = []
        self.on_life: list[Callable[[str, str], None]] = []
        self.models = {name: model_of(description) for name, description in bundle.models.items()}
        self.planners = {
            name: Planner(model, Limits.of(model.description), base_pose(self.cell.robots[name]), self.cycle_s(name))
            for name, model in self.models.items()
        }
        self._boots = 0
        self._calls = 0
        self._pending: dict[str, Callable[[Reply], None]] = {}
        self._operators: dict[str, Eyes] = {}
        self.operator("operator")
        self.buses: dict[str, Bus] = {}
        self.processes: dict[str, Process] = {}
        names = [f"gateway/{gateway}" for gateway in self.cell.gateways]
        names += ["manager", *(f"robot/{robot}" for robot in self.cell.robots)]
        self.hosts = {name: self._host() for name in names}
        for name in names:
            if name.startswith("gateway/"):
                self._connect_bus(name)
            self.start(name)

    def cycle_s(self, robot: str) -> float:
        return self.bundle.gateways[self.cell.robots[robot].gateway].cycle_s

    def _host(self) -> Host:
        offset_s = self.rng.uniform(0.0, _LARGEST_OFFSET_S)
        drift_ppm = self.rng.uniform(-_LARGEST_DRIFT_PPM, _LARGEST_DRIFT_PPM)
        return Host(lambda: self.clock.now, offset_s, drift_ppm, _UNIX_S + self.rng.uniform(-1.0, 1.0))

    # Processes

    def start(self, name: str, digest: str | None = None) -> None:
        """Start a process that is not alive, under a new boot; `digest`: of another configuration than the cell's."""
        if name in self.processes and self.processes[name].alive:
            return
        role, _, who = name.partition("/")
        cell = self.cell if digest is None else replace(self.cell, digest=digest)
        self._boots += 1
        boot = f"{name}-{self._boots}"
        core: Core
        if role == "manager":
            stored = self.journal.stored
            epoch = next_epoch(stored.epoch, self.hosts[name].unix)
            try:
                self.journal.write(replace(stored, epoch=epoch))
            except JournalFull:
                return
            core, period_s = ManagerCore(cell, boot, epoch, stored), MANAGER_PERIOD_S
        elif role == "gateway":
            settings, first = self.bundle.gateways[who], int(self.hosts[name].unix)
            core = GatewayCore(settings, cell.times, boot=boot, digest=cell.digest, first_owner=first)
            period_s = settings.cycle_s
        else:
            core, period_s = self._agent(who, cell, boot), AGENT_PERIOD_S
        process = Process(
            name, core, period_s, self.clock, self.hosts[name], self._perform, self._delivered, self.rng, boot
        )
        self.processes[name] = process
        self._lived(name, "started")

    def _agent(self, robot: str, cell: object, boot: str) -> AgentCore:
        planner, settings, model = self.planners[robot], self.cell.robots[robot], self.models[robot]
        text = settings.program.read_text()
        names = model.joint_names, model.linear_names
        program = parse_program(text, settings.program.name, *names, settings.corrections)
        return AgentCore(cell, robot, lambda _: planner, program, boot)

    def start_manager(self) -> None:
        self.start("manager")

    def start_agent(self, robot: str) -> None:
        self.start(f"robot/{robot}")

    def kill(self, name: str) -> None:
        """End a process at once; its token goes, and the manager hears of it if the network lets it."""
        process = self.processes[name]
        if not process.alive:
            return
        process.kill()
        role, _, who = name.partition("/")
        self._lived(name, "killed")
        if role != "manager":
            self._send(name, TokenGone(role, who, process.boot), ["manager"])

    def freeze(self, name: str, seconds: float) -> None:
        """A process does nothing for a while, and then finds what came meanwhile."""
        process = self.processes[name]
        if not process.alive:
            return
        process.freeze(seconds)
        self._lived(name, "frozen")
        self.clock.after(seconds, lambda: self._thaw(process))

    def _thaw(self, process: Process) -> None:
        if process.alive and not process.frozen:
            self._lived(process.name, "thawed")

    def _lived(self, name: str, what: str) -> None:
        for look in self.on_life:
            look(name, what)

    def _delivered(self, name: str, message: object) -> None:
        for look in self.on_delivered:
            look(name, message)

    # The buses

    def _connect_bus(self, name: str) -> None:
        settings = self.bundle.gateways[name.partition("/")[2]]
        loads = robot_loads(self.cell, settings)
        self.buses[name] = Bus(settings, lambda message: self.processes[name].tell(message), loads)
        period_s = min(settings.cycle_s, _BUS_STEP_S)
        self.clock.after(period_s, lambda: self._step_bus(name, period_s))

    def _step_bus(self, name: str, period_s: float) -> None:
        """The nodes live on the world's time, whether a gateway runs or not."""
        self.buses[name].step(self.clock.now)
        self.clock.after(period_s, lambda: self._step_bus(name, period_s))

    # Effects

    def _perform(self, process: Process, effect: Effect) -> None:
        for look in self.on_effect:
            look(process.name, effect)
        match effect:
            case Frame(frame):
                self.buses[process.name].send(frame, self.clock.now)
            case Sdo():
                done = self.buses[process.name].sdo(effect, self.clock.now)
                self.clock.after(self.rng.uniform(0.0005, 0.002), lambda: process.tell(done))
            case Plan(request):
                robot = process.name.partition("/")[2]
                result = self.planners[robot].plan(request)
                if isinstance(result, Planned):
                    self.seen.planned[robot].append(result)
                self.clock.after(self.rng.uniform(0.02, 0.08), lambda: process.tell(result))
            case Publish(message):
                self._published(process.name, message)
            case Ask():
                self._ask(process, effect)
            case Answer(request_id, Reply() as reply):
                self._left(process.name, reply)
                answer = self._pending.pop(request_id, None)
                if answer is not None:
                    answer(reply)
            case Store(record):
                try:
                    self.journal.write(_after(self.journal.stored, record))
                except JournalFull:
                    self.kill(process.name)

    def _left(self, name: str, message: object) -> None:
        for look in self.on_published:
            look(name, message)

    def _published(self, frm: str, message: object) -> None:
        self._left(frm, message)
        for by, eyes in self._operators.items():
            if isinstance(message, RobotState | ManagerState | GatewayState):
                for delay in self.network.delays(frm, by):
                    self.clock.after(delay, lambda eyes=eyes: eyes.see(message))
        match message:
            case Presence():
                self._send(frm, message, ["manager"])
            case ManagerState():
                self.seen.manager = message
                self.tell_timed(message, self._agents(), frm)
                self.tell_timed(message, [f"gateway/{gateway}" for gateway in self.cell.gateways], frm)
            case ZoneGeometry():
                self._send(frm, message, self._agents())
            case SetpointBlock():
                self._send(frm, message, [f"gateway/{self.cell.robots[message.robot].gateway}"])
            case DriveFeedback():
                self.seen.feedback[message.robot] = message
                for look in self.on_feedback:
                    look(message)
                self.tell_timed(message, [f"robot/{message.robot}"], frm)
            case RobotState():
                self.seen.robots[message.robot] = message
            case GatewayState():
                self.seen.gateways[message.gateway] = message
                self._send(frm, message, ["manager"])
            case Estop():
                self._send(frm, message, [name for name in self.processes if name != frm])
            case Event():
                self.seen.events.append(message)

    def _agents(self) -> list[str]:
        return [f"robot/{robot}" for robot in self.cell.robots]

    def _send(self, frm: str, message: object, names: Collection[str]) -> None:
        for name in names:
            for delay in self.network.delays(frm, name):
                self.clock.after(delay, lambda name=name: self.processes[name].tell(message))

    def tell_timed(self, message: object, names: Collection[str], frm: str = "sensor") -> None:
        """To processes whose shells note when a state comes in."""
        for name in names:
            for delay in self.network.delays(frm, name):
                self.clock.after(delay, lambda name=name: self._arrive(name, message))

    def _arrive(self, name: str, message: object) -> None:
        process = self.processes[name]
        process.tell(Arrived(message, process.host.now))

    # Calls

    def _ask(self, process: Process, ask: Ask) -> None:
        answered = []

        def finish(outcome: AskDone) -> None:
            if not answered:
                answered.append(outcome)
                process.tell(outcome)

        self._call(process.name, ask.to, ask.call, lambda reply: finish(AskDone(ask.ask_id, reply)))
        self.clock.after(ask.timeout_s, lambda: finish(AskDone(ask.ask_id, None, "no answer in time")))

    def _call(self, frm: str, to: str, call: object, then: Callable[[Reply], None]) -> None:
        self._calls += 1
        self._left(frm, call)
        request = Request(f"request-{self._calls}", call)

        def answer(reply: Reply) -> None:
            for delay in self.network.delays(to, frm)[:1]:
                self.clock.after(delay, lambda: then(reply))

        self._pending[request.request_id] = answer
        self._send(frm, request, [to])

    # Operators

    def operator(self, by: str) -> Eyes:
        """What an operator has heard; one that is named for the first time begins to hear now."""
        return self._operators.setdefault(by, Eyes())

    def press(self, key: JogHeld, by: str = "operator") -> None:
        """A sign of an operator's jog key over the same bad network."""
        self._left(by, key)
        self._send(by, key, [f"robot/{key.robot}"])

    def operate(
        self,
        to: str,
        command: Command,
        by: str = "operator",
        timeout_s: float = ANSWER_TIMEOUT_S,
        then: Callable[[Reply | None], None] | None = None,
    ) -> None:
        """An operator's call over the same bad network, with the echo of the newest state that this operator has heard.

        `then` gets the reply, once, or None when there is none in time.
        """
        self._calls += 1
        call = Call(f"{by}-{self._calls}", command, self.operator(by).heard(to))
        answered = False

        def finish(reply: Reply | None) -> None:
            nonlocal answered
            if answered:
                return
            answered = True
            self.seen.replies.append((to, command, reply))
            if then is not None:
                then(reply)

        self._call(by, to, call, finish)
        self.clock.after(timeout_s, lambda: finish(None))

    def raise_estop(
        self, estop: Estop, by: str = "operator", doors: Collection[str] = ("manager", "gateways", "agents")
    ) -> None:
        """A stop that is published directly, and called to the manager, through the doors that this operator has."""
        self._left(by, estop)
        roles = {"gateways": "gateway", "agents": "robot"}
        through = {roles.get(door, door) for door in doors}
        self._send(by, estop, [name for name in self.processes if name.partition("/")[0] in through])
        if "manager" in doors:
            self.operate("manager", SetEstop(estop.id, estop.by, estop.reason), by)


def _after(stored: Stored, record: Record) -> Stored:
    """What a journal holds after one more record."""
    match record:
        case EstopLatched(estop):
            return replace(stored, estops=(*stored.estops, estop))
        case EstopCleared(id):
            left = tuple(estop for estop in stored.estops if estop.id != id)
            return replace(stored, estops=left, cleared=stored.cleared | {id})
        case _:
            return stored
