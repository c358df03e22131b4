"""A cell of `cell_configs` in one process: manager, agents, gateways, drives, wired over a bad network.

Real: cores, shells, codec, slots, queues, calls, journal, planner, drives. Simulated: time, Zenoh's way of a payload
from session to session (`exchange`), the planning process (`planning_worker`), the wire of the CAN bus (`bus`).
"""

import random
import threading
from collections.abc import Callable, Collection
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path

from cell.commands.checks import CellBundle, check_cell
from cell.commands.emergency.door import PERIOD_S as ESTOP_PERIOD_S
from cell.commands.processes.simulation import robot_loads
from cell.config.settings import CellSettings
from cell.core import Answer, Core, Effect
from cell.manager.core import ManagerCore
from cell.manager.journal import JournalError
from cell.manager.shell import ManagerShell
from cell.messages import (
    Call,
    Command,
    DriveFeedback,
    Estop,
    Event,
    GatewayState,
    JogHeld,
    ManagerState,
    Reply,
    RobotState,
    SetEstop,
)
from drive_gateway.gateway.core import GatewayCore
from drive_gateway.gateway.shell import GatewayShell
from robot_agent.agent.core import AgentCore
from robot_agent.agent.operator.loading import read_program
from robot_agent.agent.planning.planner import Planner
from robot_agent.agent.planning.plans import Planned
from robot_agent.agent.shell import PERIOD_S as AGENT_PERIOD_S
from robot_agent.agent.shell import AgentShell
from tests.sim.bus import LivingBus, SimPort, SimWorkers
from tests.sim.clock import Clock
from tests.sim.disk import Disk, SimWriter
from tests.sim.exchange import Exchange, SimSession
from tests.sim.eyes import Eyes
from tests.sim.host import Host
from tests.sim.network import Network, Weather
from tests.sim.planning_worker import SimWorker
from tests.sim.process import Process, Shell, WatchedCore

TWO_ARMS = Path(__file__).parents[2] / "cell_configs" / "two_arms" / "cell.yaml"
ANSWER_TIMEOUT_S = 5.0
_MANAGER_S = 0.01
"""Between two steps of a manager; a real one steps when something comes, a hundred times a second with two robots."""
_UNIX_S = 1_700_000_000.0
_LARGEST_AHEAD_S = 10_000.0
_ESTOP_REPEATED_S = 3.0
"""As `cell estop` does until everyone stands (`cell.commands.emergency.stop`)."""
_LARGEST_DRIFT_PPM = 50.0
_LARGEST_PLANNING_SHARE = 0.05


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
    replies: list[tuple[str, Command, Reply]] = field(default_factory=list)
    """The answers to operators' calls."""
    said: list[tuple[str, str]] = field(default_factory=list)
    """What processes told people, and payloads that nobody could read."""


class World:
    """All processes of the cell on one clock. The same seed gives the same run."""

    def __init__(self, bundle: CellBundle, seed: int, weather: Weather, drives_wait_s: float = 0.0) -> None:
        """`drives_wait_s`: so long at least the drives do without set points before they stop by themselves."""
        self.bundle = bundle
        self.cell = bundle.cell
        self.clock = Clock()
        self.rng = random.Random(seed)
        self.network = Network(weather, self.rng, self.clock)
        self.journal = Disk()
        self.seen = Observed(planned={robot: [] for robot in self.cell.robots})
        self.on_feedback: list[Callable[[DriveFeedback], None]] = []
        self.on_published: list[Callable[[str, object], None]] = []
        self.on_delivered: list[Callable[[str, object], None]] = []
        self.on_effect: list[Callable[[str, Effect], None]] = []
        self.on_life: list[Callable[[str, str], None]] = []
        """Also "ended": a process has ended by itself."""
        self.models = {name: robot.model for name, robot in bundle.robots.items()}
        self.planners = {name: Planner(robot, *self._told(name)) for name, robot in bundle.robots.items()}
        self.exchange = Exchange(self.cell.name, self.clock, self.network, self.rng.random())
        self.exchange.on_published.append(self._left)
        self._planning_share = self.rng.uniform(0.0, _LARGEST_PLANNING_SHARE)
        self._boots = 0
        self._calls = 0
        self._operators: dict[str, Eyes] = {}
        self.buses: dict[str, LivingBus] = {}
        self.processes: dict[str, Process] = {}
        names = [f"gateway/{gateway}" for gateway in self.cell.gateways]
        names += ["manager", *(f"robot/{robot}" for robot in self.cell.robots)]
        self.hosts = {name: self._host() for name in names}
        self._desk = self._host()
        self.operator("operator")
        for name in names:
            if name.startswith("gateway/"):
                gateway = name.partition("/")[2]
                settings, simulation = self.bundle.gateways[gateway], self.bundle.simulations[gateway]
                waiting = replace(settings, overrun_limit_s=max(settings.overrun_limit_s, drives_wait_s))
                loads = robot_loads(self.cell, gateway, simulation)
                self.buses[name] = LivingBus(waiting, simulation, self.clock, self.rng, loads)
            self.start(name)

    def cycle_s(self, robot: str) -> float:
        return self.bundle.gateways[self.cell.robots[robot].gateway].cycle_s

    def _told(self, robot: str) -> tuple[float, tuple[float, ...]]:
        """Cycle and quick stop of a robot, as the drives file has them."""
        gateway = self.bundle.gateways[self.cell.robots[robot].gateway]
        return gateway.cycle_s, tuple(axis.quick_stop for axis in gateway.robots[robot].axes)

    def _host(self) -> Host:
        drift_ppm = self.rng.uniform(-_LARGEST_DRIFT_PPM, _LARGEST_DRIFT_PPM)
        unix_s = _UNIX_S + self.rng.uniform(-1.0, 1.0)
        return Host(self.clock, self.rng.uniform(0.0, _LARGEST_AHEAD_S), drift_ppm, unix_s)

    # Life and death

    def start(self, name: str, digest: str | None = None) -> None:
        """Start a process that is not alive, under a new boot; `digest`: of another configuration than the cell's.

        A manager whose journal cannot be opened, or takes no new epoch, ends at once.
        """
        if name in self.processes and self.processes[name].alive:
            return
        cell = self.cell if digest is None else replace(self.cell, digest=digest)
        self._boots += 1
        role, _, who = name.partition("/")
        boot = f"{who or role}-{self._boots}"
        session = SimSession(self.exchange, name, self.hosts[name], boot, self._says(name))
        try:
            if role == "manager":
                process = self._manager(cell, session)
            elif role == "gateway":
                process = self._gateway(who, cell, session)
            else:
                process = self._agent(who, cell, session)
        except JournalError as error:
            session.close()
            self.seen.said.append((name, str(error)))
            self._lived(name, "ended")
            return
        self.processes[name] = process
        self._lived(name, "started")

    def _manager(self, cell: CellSettings, session: SimSession) -> Process:
        journal = self.journal.open(session.host.unix)
        shell = ManagerShell(session, session.token_watch(), SimWriter(journal))
        stored = journal.read()
        core = ManagerCore(cell, session.boot, journal.begin_epoch(session.boot), stored)
        session.declare_alive()
        return self._process(core, shell, session, _MANAGER_S, threading.Event())

    def _gateway(self, gateway: str, cell: CellSettings, session: SimSession) -> Process:
        settings, bus, stop = self.bundle.gateways[gateway], self.buses[session.process], threading.Event()
        first = int(1000 * session.host.unix())
        core = GatewayCore(settings, cell.times, boot=session.boot, digest=cell.digest, first_owner=first)
        port = SimPort(bus, self.clock)
        shell = GatewayShell(
            WatchedCore(session.process, core, self.on_delivered),
            settings,
            cell.times,
            session,
            stop,
            None,
            open_port=port.opened,
            open_workers=lambda _nodes, _send, _attend, done, _timeout_s: SimWorkers(port, self.rng, done),
            now=session.host.read,
        )
        session.declare_alive()
        return self._process(core, shell, session, settings.cycle_s, stop)

    def _agent(self, robot: str, cell: CellSettings, session: SimSession) -> Process:
        settings = self.cell.robots[robot]
        program = read_program(cell, robot, self.models[robot], settings.program)
        planner_for = partial(self._planner_for, robot)
        core, stop = AgentCore(cell, robot, planner_for, program, session.boot), threading.Event()
        watched = WatchedCore(session.process, core, self.on_delivered)
        shell = AgentShell(watched, session, cell, robot, self._says(session.process), stop, session.host.read)
        shell.note_doubt = lambda _doubtful: None
        planned = self.seen.planned[robot].append
        shell.start_worker = lambda *told: SimWorker(planner_for(*told), self.clock, self._planning_share, planned)
        return self._process(core, shell, session, AGENT_PERIOD_S, stop)

    def _planner_for(self, robot: str, *told: object) -> Planner:
        """It knows what the drives file says; so must who asks for it with what a claim told."""
        planner = self.planners[robot]
        assert told == (planner.cycle_s, planner.quick_stop), f"{robot} was told {told}"
        return planner

    def _process(
        self, core: Core, shell: Shell, session: SimSession, period_s: float, stop: threading.Event
    ) -> Process:
        watched = WatchedCore(session.process, core, self.on_delivered)
        machine = self.clock, self.rng
        return Process(core, watched, shell, session, period_s, *machine, self._performs, self._ended, stop)

    def start_manager(self) -> None:
        self.start("manager")

    def start_agent(self, robot: str) -> None:
        self.start(f"robot/{robot}")

    def kill(self, name: str) -> None:
        """End a process at once; its token goes, and who has a link to it hears of that."""
        if self.processes[name].alive:
            self._end(self.processes[name])
            self._lived(name, "killed")

    def stop(self, name: str) -> None:
        """Ask a process to leave in order, as SIGTERM does; "ended" when it has."""
        self.processes[name].stop.set()

    def freeze(self, name: str, seconds: float) -> None:
        """A process does nothing for a while, and then finds what came meanwhile.

        Longer than a lease, and its links are given up by the others: it finds what they sent before, and hears and is
        heard anew when the links are back.
        """
        process = self.processes[name]
        if not process.alive:
            return
        process.freeze(seconds)
        self._lived(name, "frozen")
        self.clock.after(seconds, self._thaw, process)

    def _thaw(self, process: Process) -> None:
        if process.alive and not process.frozen:
            self._lived(process.name, "thawed")

    def _end(self, process: Process) -> None:
        process.end()
        if process.name in self.buses:
            self.buses[process.name].port = None

    def _ended(self, process: Process, text: str) -> None:
        """A process ended by itself."""
        self._end(process)
        self.seen.said.append((process.name, text))
        self._lived(process.name, "ended")

    def _lived(self, name: str, what: str) -> None:
        for look in self.on_life:
            look(name, what)

    def _says(self, name: str) -> Callable[[str], None]:
        return lambda text: self.seen.said.append((name, text))

    # What is sent

    def _performs(self, name: str, effect: Effect) -> None:
        for look in self.on_effect:
            look(name, effect)
        if isinstance(effect, Answer):
            for left in self.on_published:
                left(name, effect.reply)

    def _left(self, session: SimSession, message: object) -> None:
        name = session.process
        for look in self.on_published:
            look(name, message)
        match message:
            case DriveFeedback():
                self.seen.feedback[message.robot] = message
                for see in self.on_feedback:
                    see(message)
            case RobotState():
                self.seen.robots[message.robot] = message
            case ManagerState():
                self.seen.manager = message
            case GatewayState():
                self.seen.gateways[message.gateway] = message
            case Event():
                self.seen.events.append(message)

    # Operators, and others who are no process of the cell

    def operator(self, by: str) -> Eyes:
        """What an operator has heard; one that is named for the first time begins to hear now."""
        if by not in self._operators:
            self._operators[by] = Eyes(SimSession(self.exchange, by, self._desk, by, self._says(by)))
        return self._operators[by]

    def publish(self, message: object, by: str) -> None:
        """A message of a sensor, an encoder, or anybody else."""
        self.exchange.publish(self.operator(by).session, message)

    def press(self, key: JogHeld, by: str = "operator") -> None:
        """A sign of an operator's jog key."""
        self.publish(key, by)

    def operate(
        self,
        to: str,
        command: Command,
        by: str = "operator",
        timeout_s: float = ANSWER_TIMEOUT_S,
        then: Callable[[Reply | None], None] | None = None,
        call_id: str = "",
    ) -> None:
        """An operator's call, with the echo of the newest state of the addressee that this operator has heard.

        `then` gets the reply, once, or None when there is none. A `call_id` that was used before repeats that call.
        """
        self._calls += 1
        operator = self.operator(by)
        call = Call(call_id or f"{by}-{self._calls}", command, operator.heard(to))

        def done(reply: Reply | None, problem: str) -> None:
            if reply is None:
                self.seen.said.append((by, problem))
            else:
                self.seen.replies.append((to, command, reply))
            if then is not None:
                then(reply)

        self.exchange.ask(operator.session, to, call, timeout_s, done)

    def raise_estop(
        self, estop: Estop, by: str = "operator", doors: Collection[str] = ("manager", "gateways", "agents")
    ) -> None:
        """As `cell estop`: a stop that is repeated to everybody after these doors until all have confirmed it, for 3 s
        at most, and called to the manager once."""
        if "manager" in doors:
            self.operate("manager", SetEstop(estop.id, estop.by, estop.reason), by, _ESTOP_REPEATED_S)
        roles = {"gateways": "gateway", "agents": "robot"}
        through = {roles.get(door, door) for door in doors}
        self._repeat_estop(estop, by, through, self.clock.now + _ESTOP_REPEATED_S)

    def _repeat_estop(self, estop: Estop, by: str, through: set[str], until: float) -> None:
        eyes = self.operator(by)
        self.exchange.publish(eyes.session, estop, lambda name: name.partition("/")[0] in through)
        stopped = {name for name, state in eyes.presences.items() if state.estop_acknowledged is not None}
        secured = {name for name, state in eyes.gateways.items() if state.estop_confirmed is not None}
        confirmed = stopped == set(self.cell.robots) and secured == set(self.cell.gateways)
        if not confirmed and self.clock.now + ESTOP_PERIOD_S < until:
            self.clock.after(ESTOP_PERIOD_S, self._repeat_estop, estop, by, through, until)
