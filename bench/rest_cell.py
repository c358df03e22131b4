"""One arm that moves, as real processes: what they are told, what is heard of them, and how each of them is lost."""

import re
import select
import shutil
import signal
import socket
import subprocess
import sys
import threading
import time
import uuid
from collections.abc import Callable, Collection
from contextlib import ExitStack
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from types import TracebackType
from typing import Self

import numpy as np
from numpy.typing import NDArray

from cell.commands.processes.simulation import simulation_of
from cell.config.load import load_cell
from cell.config.settings import CellSettings
from cell.messages import (
    AcceptPosition,
    Call,
    Command,
    Continue,
    Disable,
    DriveFeedback,
    Enable,
    GatewayState,
    Halt,
    Heard,
    HoldSetup,
    Jog,
    JogFrame,
    JogHeld,
    Mode,
    MoveAxes,
    Reply,
    ResetRobot,
    Return,
    RobotState,
    Run,
)
from cell.net.errors import NetError
from cell.net.options import Link
from cell.net.session import CellSession, new_call
from drive_gateway.config import load_drives
from robot_agent.kinematics import Model
from robot_agent.workspace import PlacedRobot

ROOT = Path(__file__).parents[1]
ROBOT, GATEWAY = "left", "left_bus"
READY_S = 90.0
"""An arm that does not move after so long will not."""
REST_S = 6.0
"""Nothing takes so long to stop it."""
CYCLE_S = 0.01
FAST_M_S, EVENLY = 0.2, 0.02
AHEAD_M = 0.1
"""Of the middle of its line: up to there it does not brake for the end of it, for a second at least."""
SPAN = 3
"""Cycles over which a speed is taken."""
_JOG_M_S = 0.24
_SETUP_WAY_RAD = 0.6
_START = "MJ J1=0 J2=-12 J3=65 J4=0 J5=37 J6=0 F=80\n"
_TO_AND_FRO = "LABEL to\nML Y=500 F=300\nML Y=-500 F=300\nGOTO to\n"
PLAIN, FOLLOWING = _START + _TO_AND_FRO, _START + "TRACK seam\n" + _TO_AND_FRO
ADAPTER_GONE, ADAPTER_BACK = signal.SIGUSR1, signal.SIGUSR2
_GATEWAY = """import signal
import can
from can.interfaces.udp_multicast import UdpMulticastBus as Bus
whole = {name: getattr(Bus, name) for name in ("__init__", "send", "_recv_internal")}
def gone(*_, **__): raise can.CanOperationError("the adapter is gone")
def lose(*_): [setattr(Bus, name, gone) for name in whole]
def mend(*_): [setattr(Bus, name, each) for name, each in whole.items()]
signal.signal(signal.SIGUSR1, lose)
signal.signal(signal.SIGUSR2, mend)
from cell.commands.drive_gateway import main
main()
"""
"""A gateway whose bus python-can loses and finds again at a signal, as it does with an adapter that is unplugged."""

Floats = NDArray[np.float64]


@dataclass
class Track:
    """What the gateway told of the arm, when it came [s, time.monotonic()], and where the flange was [m]."""

    cycle_s: float
    at: list[float] = field(default_factory=list)
    said: list[DriveFeedback] = field(default_factory=list)
    places: list[Floats] = field(default_factory=list)

    def speeds(self, newest: int = 0) -> tuple[Floats, Floats]:
        """Moments and speeds [m/s], all or of the newest so many messages.

        A way counts by ticks, so that a message that came late changes no speed.
        """
        if len(self.at) <= SPAN:
            return np.zeros(0), np.zeros(0)
        ticks, places = np.array([each.tick for each in self.said[-newest:]]), np.array(self.places[-newest:])
        way = np.linalg.norm(places[SPAN:] - places[:-SPAN], axis=1)
        times_s = np.maximum(ticks[SPAN:] - ticks[:-SPAN], 1) * self.cycle_s
        return np.array(self.at[-newest:][SPAN:]), way / times_s

    @property
    def rests(self) -> bool:
        """It did not move by 0.2 mm in 0.1 s."""
        count = round(0.1 / self.cycle_s)
        if len(self.places) <= count:
            return False
        recent = np.array(self.places[-count:])
        return bool(np.ptp(recent, axis=0).max() < 2e-4)

    @property
    def steady(self) -> bool:
        """It moves fast and evenly, and will for a while."""
        count = round(0.15 / self.cycle_s)
        if len(self.at) < count or self.said[-count].boot != self.said[-1].boot:
            return False
        _, speeds = self.speeds(count)
        ahead = np.copysign(1.0, self.places[-1][1] - self.places[-SPAN][1]) * self.places[-1][1]
        return bool(speeds.min() > FAST_M_S and np.ptp(speeds) < EVENLY * speeds.max() and ahead < AHEAD_M)


class RestCell:
    """The cell `belt` on free ports, its drives in a process of their own. A context manager.

    What is heard comes over the gateway, which outlives manager and agent. The agent reaches the gateway through a link
    that can be made to lose what comes back.
    """

    def __init__(self, folder: Path, program: str) -> None:
        """`program`: of the arm; with `FOLLOWING` a sensor measures for it."""
        shutil.copytree(ROOT / "cell_configs", folder / "cell_configs", ignore=shutil.ignore_patterns(".zencell"))
        self.file = folder / "cell_configs" / "belt" / "cell.yaml"
        _to_free_ports(self.file)
        self._state_dir = folder / "state"
        (self.file.parent / "programs" / f"{ROBOT}.prog").write_text(program)
        self.settings: CellSettings = load_cell(self.file)
        self.drives = load_drives(self.settings.gateways[GATEWAY].drives, GATEWAY)
        self.simulation = simulation_of(self.settings, GATEWAY)
        self.model: Model = PlacedRobot.of(self.settings.robots[ROBOT]).model
        self.processes: dict[str, subprocess.Popen[bytes]] = {}
        self._stack = ExitStack()
        self._names = ("manager", "drives", "gateway", "agent", *(("sensor",) if program == FOLLOWING else ()))
        self.refused = ""
        """The newest refusal of an order."""
        self.state: RobotState | None = None
        self.gateway: GatewayState | None = None

    def __enter__(self) -> Self:
        self._stack.callback(self._end_all)
        self.link = self._stack.enter_context(LossyLink(self.settings.gateways[GATEWAY].endpoint))
        self.start_all()
        link = Link("client", connect=(self.settings.gateways[GATEWAY].endpoint,), open_timeout_s=READY_S)
        self.session = self._stack.enter_context(CellSession(self.settings.name, link, "bench", "rest", "bench-rest"))
        self._latest = self.session.watch(f"robot/{ROBOT}/state", f"gateway/{GATEWAY}/state")
        self._feedback = self.session.queue(f"robot/{ROBOT}/drives", size=4096)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._stack.close()

    # Processes

    def start_all(self) -> None:
        """Start what does not run; let what is frozen go on and what is cut off be connected."""
        self.link.carry()
        for name in self._names:
            process = self.processes.get(name)
            if process is not None and process.poll() is None:
                process.send_signal(signal.SIGCONT)
                if name == "gateway":
                    process.send_signal(ADAPTER_BACK)
            else:
                self.processes[name] = self._popen(*self._words(name))

    def _words(self, name: str) -> tuple[str, ...]:
        file, state = str(self.file), ("--state-dir", str(self._state_dir))
        ways = (
            "-e",
            self.settings.manager_endpoint,
            "-e",
            self.link.endpoint,
            "--cfg",
            "scouting/gossip/enabled:false",
        )
        module = "cell.commands."
        return {
            "manager": ("-m", module + "main", "manager", file, *state),
            "drives": ("-m", module + "drive_gateway", "simulate", file, GATEWAY, *state),
            "gateway": ("-c", _GATEWAY, "run", file, GATEWAY, *state),
            "agent": ("-m", module + "robot_agent", file, ROBOT, *state, *ways),
            "sensor": ("-m", module + "main", "simulate", "sensor", ROBOT, "seam", "Z=5", "-f", file),
        }[name]

    def freeze(self, name: str) -> None:
        """A process does nothing until `start_all`."""
        self.processes[name].send_signal(signal.SIGSTOP)

    def operate(self, *words: str) -> subprocess.Popen[bytes]:
        """An operator's command, `cell ...`."""
        process = self._popen("-m", "cell.commands.main", *words, "-f", str(self.file))
        self._stack.callback(_end, process)
        return process

    def _popen(self, *words: str) -> subprocess.Popen[bytes]:
        quiet = subprocess.DEVNULL
        return subprocess.Popen([sys.executable, *words], cwd=ROOT, stdin=quiet, stdout=quiet, stderr=quiet)

    def _end_all(self) -> None:
        for process in self.processes.values():
            _end(process)

    # What is heard

    def look(self, track: Track | None = None) -> None:
        """Take the newest states, and add the feedback that came since the last look to `track`."""
        for message in self._latest.take_new():
            if isinstance(message, RobotState):
                self.state = message
            elif isinstance(message, GatewayState):
                self.gateway = message
        arrived = [(one.at, one.message) for one in self._feedback.take_arrived()]
        feedback = [(at, message) for at, message in arrived if isinstance(message, DriveFeedback)]
        if track is None or not feedback:
            return
        joints = np.array([self.model.coupling.joints(message.position) for _, message in feedback])
        track.at += [at for at, _ in feedback]
        track.said += [message for _, message in feedback]
        track.places += list(self.model.forward(joints)[:, :3, 3])

    def record(self, until: Callable[[Track], bool], seconds: float, track: Track | None = None) -> Track:
        """What the flange does from now on, or goes on to do, until something is so, at most for so long."""
        if track is None:
            self.look()
            track = Track(self.drives.cycle_s)
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            count = len(track.at)
            self.look(track)
            if len(track.at) > count and until(track):
                break
            time.sleep(0.002)
        return track

    # What is ordered

    def ask(self, to: str, command: Command, heard: Heard | None) -> Reply | None:
        """An operator's order; what is refused is remembered."""
        call: Call = new_call(command, heard)
        try:
            reply = self.session.ask(to, call, 5.0)
        except NetError as error:
            self.refused = f"{command.verb}: {error}"
            return None
        if not reply.ok:
            self.refused = f"{command.verb}: {reply.text}"
        return reply

    def ask_robot(self, command: Command) -> Reply | None:
        """With the echo of the robot's newest state."""
        self.look()
        return self.ask(f"robot/{ROBOT}", command, self.heard_robot())

    def ask_gateway(self, command: Command) -> Reply | None:
        """With the echo of the gateway's newest state."""
        return self.ask(f"gateway/{GATEWAY}", command, self.heard_gateway())

    def heard_robot(self) -> Heard | None:
        state = self.state
        return None if state is None else Heard(state.boot, state.sequence)

    def heard_gateway(self) -> Heard | None:
        state = self.gateway
        return None if state is None else Heard(state.boot, state.sequence)

    def bring_to(self, wanted: Collection[Mode], orders: dict[Mode, Command]) -> None:
        """Give the order for the mode that the robot is in until it is in one that is wanted."""
        end = time.monotonic() + READY_S
        orders = {Mode.FAULT: ResetRobot(), **orders}
        while time.monotonic() < end:
            self.start_all()
            self.state = None
            self.record(lambda _: self.state is not None, 1.0)
            mode = None if self.state is None else self.state.mode
            if mode in wanted:
                return
            if mode is Mode.ESTOP:
                self.operate("reset").wait()
            elif mode in orders:
                self._obey(orders[mode])
            self.record(lambda _, was=mode: self.state is not None and self.state.mode is not was, 0.5)  # type: ignore[misc]
        raise RuntimeError(
            f"not {' or '.join(mode.value for mode in wanted)} within {READY_S:g} s; {self.refused}; {self.state}"
        )

    def _obey(self, command: Command) -> None:
        """Give an order; after a loss of the drives an operator looks first where they stand."""
        reply = self.ask_robot(command)
        if reply is not None and not reply.ok and "cell accept" in reply.text:
            self.ask_gateway(AcceptPosition(ROBOT, ()))

    # Three kinds of motion

    def bring_up(self) -> None:
        """The drives are enabled."""
        self.bring_to([Mode.READY, Mode.RUNNING, Mode.HALTED], {Mode.DISABLED: Enable(), Mode.OFF_PATH: Return()})

    def run(self) -> None:
        """The program runs."""
        orders: dict[Mode, Command] = {
            Mode.DISABLED: Enable(),
            Mode.READY: Run(),
            Mode.HALTED: Continue(),
            Mode.OFF_PATH: Return(),
        }
        self.bring_to([Mode.RUNNING], orders)

    def jog(self) -> "Held":
        """An operator jogs the arm along its line, fast, and holds the key."""
        enabled: dict[Mode, Command] = {Mode.DISABLED: Enable(), Mode.RUNNING: Halt(), Mode.OFF_PATH: Return()}
        self.bring_to([Mode.READY, Mode.HALTED], enabled)
        press, y = uuid.uuid4().hex, self._y()

        def hold() -> None:
            if (heard := self.heard_robot()) is not None:
                self.session.publish(JogHeld(ROBOT, press, True, heard))

        self.ask_robot(Jog(press, "Y", -np.copysign(_JOG_M_S, y), JogFrame.WORLD))
        return Held(self, hold, 0.03)

    def set_up(self) -> "Held":
        """An operator moves the first axis by its drive's own profile, and holds the motion."""
        at_rest: dict[Mode, Command] = {Mode.READY: Disable(), Mode.HALTED: Disable(), Mode.OFF_PATH: Disable()}
        end = time.monotonic() + READY_S
        while time.monotonic() < end:
            self.bring_to([Mode.DISABLED], {Mode.RUNNING: Halt(), **at_rest})
            way = -np.copysign(_SETUP_WAY_RAD, self._y())
            reply = self.ask_gateway(MoveAxes(ROBOT, {"J1": float(way)}, True, 1.0, False))
            if reply is not None and reply.ok:
                hold = HoldSetup(ROBOT, reply.id)
                return Held(self, partial(self.ask_gateway, hold), 0.1)
            self.record(lambda _: False, 0.2)
        raise RuntimeError(f"no set-up within {READY_S:g} s; {self.refused}; {self.gateway}")

    def _y(self) -> float:
        """[m] of the flange; the arm moves away from the nearer end of its line."""
        track = self.record(lambda track: bool(track.places), 2.0)
        return float(track.places[-1][1])


class Held:
    """An operator who holds something until he lets it go without a word. A context manager."""

    def __init__(self, cell: RestCell, hold: Callable[[], object], period_s: float) -> None:
        self._cell = cell
        self._hold, self._period_s = hold, period_s
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._go_on, daemon=True)

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.let_go()
        self._thread.join()

    def let_go(self) -> None:
        self._over.set()

    def _go_on(self) -> None:
        while not self._over.is_set():
            self._hold()
            self._over.wait(self._period_s)


class LossyLink:
    """A TCP endpoint in front of another one; what comes back from there can be kept back. A context manager."""

    def __init__(self, target: str) -> None:
        host, _, port = target.partition("/")[2].rpartition(":")
        self._target = host, int(port)
        self._server = socket.create_server(("127.0.0.1", 0))
        self.endpoint = f"tcp/127.0.0.1:{self._server.getsockname()[1]}"
        self._open = threading.Event()
        self._open.set()
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._accept, daemon=True)

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._over.set()
        self._open.set()
        self._thread.join()
        self._server.close()

    def carry(self) -> None:
        """Everything goes both ways."""
        self._open.set()

    def keep_back(self) -> None:
        """What the target says waits from now on; what it is told goes through."""
        self._open.clear()

    def _accept(self) -> None:
        while not self._over.is_set():
            if not select.select([self._server], [], [], 0.1)[0]:
                continue
            caller, _ = self._server.accept()
            try:
                target = socket.create_connection(self._target, timeout=1.0)
            except OSError:
                caller.close()
                continue
            for each in (caller, target):
                each.settimeout(None)
                each.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            for source, sink, gate in ((caller, target, None), (target, caller, self._open)):
                threading.Thread(target=_carry, args=(source, sink, gate), daemon=True).start()


def _carry(source: socket.socket, sink: socket.socket, gate: threading.Event | None) -> None:
    try:
        while data := source.recv(65536):
            if gate is not None:
                gate.wait()
            sink.sendall(data)
    except OSError:
        pass
    for each in (source, sink):
        try:
            each.shutdown(socket.SHUT_RDWR)
        except OSError:
            each.close()


def _end(process: subprocess.Popen[bytes]) -> None:
    process.kill()
    process.wait()


def _to_free_ports(file: Path) -> None:
    """Ports that nobody listens on, and a bus that processes can share, in a cycle that a busy computer keeps."""
    text, ports = file.read_text(), list[int]()
    for port in sorted(set(re.findall(r"127\.0\.0\.1:(\d+)", text))):
        with socket.create_server(("127.0.0.1", 0)) as holder:
            ports.append(holder.getsockname()[1])
        text = text.replace(f"127.0.0.1:{port}", f"127.0.0.1:{ports[-1]}")
    file.write_text(text)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    drives = file.parents[1] / "two_arms" / "left_drives.yaml"
    options = f"options: {{port: {port}, hop_limit: 0}}"
    line = f"bus: {{interface: udp_multicast, channel: 239.74.163.4, {options}, bitrate: 1000000}}"
    text = re.sub(r"^bus: .*$", line, drives.read_text(), flags=re.MULTILINE)
    drives.write_text(re.sub(r"^cycle_s: .*$", f"cycle_s: {CYCLE_S}", text, flags=re.MULTILINE))
