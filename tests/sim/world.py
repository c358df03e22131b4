"""A cell of `cell_configs` in one process: manager, agents, gateways, drives, wired over a bad network."""

import random
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path

from cell.commands.checks import CellBundle, check_cell
from cell.commands.robot_loads import robot_loads
from cell.core import Answer, Arrived, Ask, AskDone, Effect, Publish, Request
from cell.manager.core import ManagerCore
from cell.manager.records import EstopCleared, EstopLatched, Record, Store, Stored
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
from tests.sim.network import Network, Weather
from tests.sim.process import Process

TWO_ARMS = Path(__file__).parents[2] / "cell_configs" / "two_arms" / "cell.yaml"
MANAGER_PERIOD_S = 0.01


def load_bundle(cell_file: Path = TWO_ARMS) -> CellBundle:
    """A cell, as `cell up` would load it."""
    bundle, problems = check_cell(cell_file)
    assert bundle is not None, problems
    return bundle


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
        self.network = Network(weather, self.rng)
        self.seen = Observed(planned={robot: [] for robot in self.cell.robots})
        self.on_feedback: list[Callable[[DriveFeedback], None]] = []
        self.models = {name: model_of(description) for name, description in bundle.models.items()}
        self.planners = {
            name: Planner(model, Limits.of(model.description), base_pose(self.cell.robots[name]), self.cycle_s(name))
            for name, model in self.models.items()
        }
        self._boots = 0
        self._calls = 0
        self._pending: dict[str, Callable[[Reply], None]] = {}
        self._epoch = 0
        self._stored = Stored()
        self.buses: dict[str, Bus] = {}
        self.processes: dict[str, Process] = {}
        for gateway in self.cell.gateways:
            self._start_gateway(gateway)
        self.start_manager()
        for robot in self.cell.robots:
            self.start_agent(robot)

    def cycle_s(self, robot: str) -> float:
        return self.bundle.gateways[self.cell.robots[robot].gateway].cycle_s

    # Processes

    def _boot(self, name: str) -> str:
        self._boots += 1
        return f"{name}-{self._boots}"

    def start_manager(self) -> None:
        self._epoch += 1
        core = ManagerCore(self.cell, self._boot("manager"), self._epoch, self._stored)
        self._start("manager", core, MANAGER_PERIOD_S)

    def start_agent(self, robot: str) -> None:
        planner, settings = self.planners[robot], self.cell.robots[robot]
        model = self.models[robot]
        text = settings.program.read_text()
        program = parse_program(
            text, settings.program.name, model.joint_names, model.linear_names, settings.corrections
        )
        core = AgentCore(self.cell, robot, lambda _: planner, program, self._boot(robot))
        self._start(f"robot/{robot}", core, AGENT_PERIOD_S)

    def _start_gateway(self, gateway: str) -> None:
        settings = self.bundle.gateways[gateway]
        core = GatewayCore(settings, self.cell.times, boot=self._boot(gateway), digest=self.cell.digest)
        name = f"gateway/{gateway}"
        self._start(name, core, settings.cycle_s)
        loads = robot_loads(self.cell, settings)
        self.buses[name] = Bus(settings, lambda message: self.processes[name].tell(message), loads)

    def _start(self, name: str, core: object, period_s: float) -> None:
        self.processes[name] = Process(name, core, period_s, self.clock, self._perform, self.rng)

    def kill(self, name: str) -> None:
        """End a process at once; a robot's token goes, and the manager hears of it if the network lets it."""
        process = self.processes[name]
        process.kill()
        role, _, who = name.partition("/")
        if role == "robot":
            self._send(TokenGone("robot", who, process.core._boot), ["manager"])

    # Effects

    def _perform(self, process: Process, effect: Effect) -> None:
        match effect:
            case Frame(frame):
                bus = self.buses[process.name]
                bus.send(frame, self.clock.now)
                if frame.id == 0x80:
                    bus.step(self.clock.now)
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
                self._published(message)
            case Ask():
                self._ask(process, effect)
            case Answer(request_id, Reply() as reply):
                answer = self._pending.pop(request_id, None)
                if answer is not None:
                    answer(reply)
            case Store(record):
                self._stored = _after(self._stored, record)

    def _published(self, message: object) -> None:
        match message:
            case Presence():
                self._send(message, ["manager"])
            case ManagerState():
                self.seen.manager = message
                self.tell_timed(message, [*self._agents(), *(f"gateway/{name}" for name in self.cell.gateways)])
            case ZoneGeometry():
                self._send(message, self._agents())
            case SetpointBlock():
                self._send(message, [f"gateway/{self.cell.robots[message.robot].gateway}"])
            case DriveFeedback():
                self.seen.feedback[message.robot] = message
                for look in self.on_feedback:
                    look(message)
                self.tell_timed(message, [f"robot/{message.robot}"])
            case RobotState():
                self.seen.robots[message.robot] = message
            case GatewayState():
                self.seen.gateways[message.gateway] = message
                self._send(message, ["manager"])
            case Estop():
                self._send(message, [name for name in self.processes if name != "manager"])
            case Event():
                self.seen.events.append(message)

    def _agents(self) -> list[str]:
        return [f"robot/{robot}" for robot in self.cell.robots]

    def _send(self, message: object, names: list[str]) -> None:
        for name in names:
            for delay in self.network.delays():
                self.clock.after(delay, lambda name=name: self.processes[name].tell(message))

    def tell_timed(self, message: object, names: list[str]) -> None:
        """To agents, whose shells note when a state comes in."""
        for name in names:
            for delay in self.network.delays():
                self.clock.after(delay, lambda name=name: self._arrive(name, message))

    def _arrive(self, name: str, message: object) -> None:
        self.processes[name].tell(Arrived(message, self.clock.now))

    # Calls

    def _ask(self, process: Process, ask: Ask) -> None:
        answered = []

        def finish(outcome: AskDone) -> None:
            if not answered:
                answered.append(outcome)
                process.tell(outcome)

        self._call(ask.to, ask.call, lambda reply: finish(AskDone(ask.ask_id, reply)))
        self.clock.after(ask.timeout_s, lambda: finish(AskDone(ask.ask_id, None, "no answer in time")))

    def _call(self, to: str, call: object, then: Callable[[Reply], None]) -> None:
        self._calls += 1
        request = Request(f"request-{self._calls}", call)

        def answer(reply: Reply) -> None:
            for delay in self.network.delays()[:1]:
                self.clock.after(delay, lambda: then(reply))

        self._pending[request.request_id] = answer
        self._send(request, [to])

    def press(self, key: JogHeld) -> None:
        """A sign of an operator's jog key over the same bad network."""
        self._send(key, [f"robot/{key.robot}"])

    def operate(self, to: str, command: Command) -> None:
        """An operator's call over the same bad network, with the echo of the newest state of the robot or gateway."""
        self._calls += 1
        name = to.partition("/")[2]
        state = self.seen.robots.get(name) or self.seen.gateways.get(name)
        heard = Heard(state.boot, state.sequence) if state is not None else None
        call = Call(f"operator-{self._calls}", command, heard)
        self._call(to, call, lambda reply: self.seen.replies.append((to, command, reply)))


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
