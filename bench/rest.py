"""How long after each kind of silence or fault a robot begins to brake: the rows of docs/architecture.md, section 6.

Real processes of the cell `belt`, one arm that goes to and fro on a line. A row tells the time from the event until the
flange is slower than before by 3 %: what passes to rest beyond that is its braking.
"""

import re
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path

import can
import numpy as np
from numpy.typing import NDArray

from bench.timing import Row
from cell.config.load import load_cell
from cell.config.settings import CellSettings
from cell.messages import (
    Call,
    Command,
    Continue,
    DriveFeedback,
    Enable,
    Fault,
    FaultDrive,
    GatewayState,
    Heard,
    ResetRobot,
    Return,
    RobotState,
    Run,
)
from cell.net.errors import NetError
from cell.net.options import Link
from cell.net.session import CellSession, new_call
from drive_gateway.config import load_drives
from drive_gateway.gateway.bus import open_bus
from robot_agent.kinematics import Model, load_model

ROOT = Path(__file__).parents[1]
TRIES = 3
READY_S = 90.0
FAST_M_S = 0.2
SLOWER = 0.97
_NODE = 1
_MODULES = {"cell": "main", "robot-agent": "robot_agent", "drive-gateway": "drive_gateway"}
TO_AND_FRO = """LABEL to
ML Y=500 F=300
ML Y=-500 F=300
GOTO to
"""
FOLLOWING = """TRACK seam
LABEL to
ML Y=500 F=300
ML Y=-500 F=300
GOTO to
"""
_START = "MJ J1=0 J2=-12 J3=65 J4=0 J5=37 J6=0 F=80\n"


@dataclass
class _Track:
    """Where the flange was, by the feedback: moments [s, time.monotonic()] and joints."""

    at: list[float] = field(default_factory=list)
    joints: list[NDArray[np.float64]] = field(default_factory=list)

    def speeds(self, model: Model) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Moments and speeds [m/s]; the feedback comes once a cycle, so speeds are taken over five."""
        at, places = np.array(self.at), model.forward(np.array(self.joints))[:, :3, 3]
        way = np.linalg.norm(places[5:] - places[:-5], axis=1)
        return at[5:], way / np.maximum(at[5:] - at[:-5], 1e-6)


class _Cell:
    """The processes, and what is heard of them at the gateway, which outlives the manager."""

    def __init__(self, stack: ExitStack, folder: Path, program: str) -> None:
        shutil.copytree(ROOT / "cell_configs", folder / "cell_configs", ignore=shutil.ignore_patterns(".zencell"))
        file = folder / "cell_configs" / "belt" / "cell.yaml"
        _to_free_ports(file)
        (file.parent / "programs" / "left.prog").write_text(_START + program)
        self.settings: CellSettings = load_cell(file)
        self._folder, self._file = folder, file
        self._stack = stack
        self.drives = load_drives(self.settings.gateways["left_bus"].drives, "left_bus")
        self.model = load_model(self.settings.robots["left"].model)
        self.processes: dict[str, subprocess.Popen[bytes]] = {}
        for name in ("manager", "drives", "gateway", "agent"):
            self.start(name)
        link = Link("client", connect=(self.settings.gateways["left_bus"].endpoint,), open_timeout_s=READY_S)
        self.session = stack.enter_context(CellSession(self.settings.name, link, "bench", "rest", "bench-rest"))
        self._latest = self.session.watch("robot/left/state", "gateway/left_bus/state")
        self._feedback = self.session.queue("robot/left/drives", size=4096)
        self.state: RobotState | None = None
        self.gateway: GatewayState | None = None
        self._listening = threading.Event()

    def start(self, name: str) -> None:
        """Start a process unless it runs."""
        process = self.processes.get(name)
        if process is not None and process.poll() is None:
            return
        file, state = str(self._file), ("--state-dir", str(self._folder / "state"))
        words = {
            "manager": ("cell", "manager", file, *state),
            "drives": ("drive-gateway", "simulate", file, "left_bus", *state),
            "gateway": ("drive-gateway", "run", file, "left_bus", *state),
            "agent": ("robot-agent", file, "left", *state),
        }[name]
        self.processes[name] = self.command(*words)

    def command(self, tool: str, *words: str) -> subprocess.Popen[bytes]:
        """Start a command that is ended with the bench."""
        command = [sys.executable, "-m", f"cell.commands.{_MODULES[tool]}", *words]
        process = subprocess.Popen(
            command, cwd=ROOT, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
        )
        self._stack.callback(process.wait)
        self._stack.callback(process.kill)
        return process

    def operate(self, *words: str) -> subprocess.Popen[bytes]:
        """An operator's command."""
        return self.command("cell", *words, "-f", str(self._file))

    def look(self) -> list[tuple[float, DriveFeedback]]:
        """The newest state, and the feedback that came since the last look."""
        for message in self._latest.take_new():
            if isinstance(message, RobotState):
                self.state = message
            elif isinstance(message, GatewayState):
                self.gateway = message
        now = time.monotonic()
        return [(now, each) for each in self._feedback.take() if isinstance(each, DriveFeedback)]

    def bring_to_speed(self) -> None:
        """Until the arm runs its program fast: start what has ended, do what its mode asks for."""
        orders: dict[str, Command] = {"disabled": Enable(), "ready": Run(), "halted": Continue()}
        orders |= {"fault": ResetRobot(), "off_path": Return()}
        end = time.monotonic() + READY_S
        while time.monotonic() < end:
            for name in self.processes:
                self.start(name)
            mode = self.state.mode.value if self.state is not None else ""
            if mode == "estop":
                self.operate("reset").wait()
            elif mode in orders and self.state is not None:
                self.ask("robot/left", new_call(orders[mode], Heard(self.state.boot, self.state.sequence)))
            track = self.record(lambda: None, 0.6)
            _, speeds = track.speeds(self.model) if len(track.at) > 20 else (np.zeros(1), np.zeros(1))
            # In the middle of a line, so that it does not brake for the end of it.
            if speeds.min() > FAST_M_S and np.ptp(speeds) < 0.02 * speeds.max() and self._far_from_ends(track):
                return
        raise RuntimeError(f"the arm did not come to speed within {READY_S:g} s; its state is {self.state}")

    def _far_from_ends(self, track: _Track) -> bool:
        y = self.model.forward(np.array(track.joints[-2:]))[:, 1, 3]
        return abs(y[-1] + (y[-1] - y[0]) * 100.0) < 0.5 and abs(y[-1]) < 0.15

    def record(self, cause: Callable[[], None], seconds: float) -> _Track:
        """What the flange does from now on; `cause` is called at once."""
        self.look()
        cause()
        track, end = _Track(), time.monotonic() + seconds
        while time.monotonic() < end:
            for at, feedback in self.look():
                track.at.append(at)
                track.joints.append(self.model.coupling.joints(feedback.position))
            time.sleep(0.001)
        return track

    def ask(self, to: str, call: Call) -> None:
        """An operator's order; what is not obeyed is told."""
        try:
            reply = self.session.ask(to, call, 5.0)
        except NetError as error:
            print(f"bench: {call.command.verb}: {error}", file=sys.stderr)
        else:
            if not reply.ok:
                print(f"bench: {call.command.verb}: {reply.text}", file=sys.stderr)

    def heard(self) -> Heard:
        """The echo of the gateway's newest state."""
        if self.gateway is None:
            raise RuntimeError("the gateway was never heard")
        return Heard(self.gateway.boot, self.gateway.sequence)


def rests() -> list[Row]:
    """All rows."""
    with tempfile.TemporaryDirectory() as name, ExitStack() as stack:
        cell = _Cell(stack, Path(name), TO_AND_FRO)
        times = cell.settings.times
        nominal_s, drives = times.nominal_s, cell.drives
        return [
            _row(cell, "set-point blocks (agent frozen)", lambda: _stopped(cell, "agent"), nominal_s + 0.02),
            _row(cell, "a fresh manager state (manager killed)", lambda: _killed(cell, "manager"), times.fresh_s),
            _row(cell, "an EMCY", lambda: _fault(cell, Fault.EMERGENCY, 0x2310), 0.02),
            _row(cell, "a node (cable out)", lambda: _fault(cell, Fault.DROP_OUT, None), drives.tpdo_timeout_s),
            _row(cell, "following (encoder jumps)", lambda: _fault(cell, Fault.ENCODER_JUMP, 10**6), 0.1),
            _row(cell, "SYNC (gateway killed)", lambda: _killed(cell, "gateway"), 0.1, _by_sdo),
            _row(cell, "emergency stop, from its command's start", lambda: _order(cell, "estop"), 0.3),
            _row(cell, "halt, from its command's start", lambda: _order(cell, "halt", "left"), 1.0),
        ]


def _row(
    cell: _Cell,
    what: str,
    event: Callable[[], Callable[[], None]],
    deadline_s: float,
    watch: "Callable[[_Cell, Callable[[], None]], tuple[float, float]] | None" = None,
) -> Row:
    """Median over the tries; `event` gives what causes it, `deadline_s` is what the table allows."""
    begins, rests_ = [], []
    for _ in range(TRIES):
        cell.bring_to_speed()
        cause = event()
        begin_s, rest_s = (watch or _by_feedback)(cell, cause)
        begins.append(begin_s)
        rests_.append(rest_s)
        for process in cell.processes.values():
            if process.poll() is None:
                process.send_signal(signal.SIGCONT)
    begin_s, rest_s = float(np.median(begins)), float(np.median(rests_))
    spread = ", ".join(f"{1e3 * each:.0f}" for each in begins)
    return Row(
        f"to braking after: {what} (each: {spread} ms; at rest after {1e3 * rest_s:.0f} ms)",
        begin_s,
        begin_s / deadline_s,
        f"of {1e3 * deadline_s:.0f} ms",
    )


def _by_feedback(cell: _Cell, cause: Callable[[], None]) -> tuple[float, float]:
    began: list[float] = []
    before = cell.record(lambda: None, 0.1)

    def now() -> None:
        began.append(time.monotonic())
        cause()

    after = cell.record(now, 2.5)
    at, speeds = _Track(before.at + after.at, before.joints + after.joints).speeds(cell.model)
    return _first_slower(at, speeds, began[0])


def _first_slower(at: NDArray[np.float64], speeds: NDArray[np.float64], event: float) -> tuple[float, float]:
    """When the robot brakes for good, and when it rests, both from the event [s]."""
    usual = float(np.median(speeds[at < event]))
    fast = np.flatnonzero(speeds > SLOWER * usual)
    moving = np.flatnonzero(speeds > 0.002)
    return float(at[fast[-1]]) - event, float(at[moving[-1]]) - event


def _by_sdo(cell: _Cell, cause: Callable[[], None]) -> tuple[float, float]:
    """Without a master nobody sends SYNC: the position of the first axis is read from its drive."""
    bus = open_bus(cell.drives.bus)
    axis = cell.drives.robots["left"].axes[0]
    at, counts = list[float](), list[int]()
    try:
        end, event = time.monotonic() + 2.5, 0.0
        while time.monotonic() < end:
            if event == 0.0 and len(at) > 40:
                event = time.monotonic()
                cause()
            bus.send(
                can.Message(arbitration_id=0x600 + _NODE, data=b"\x40\x64\x60\x00" + bytes(4), is_extended_id=False)
            )
            answer = _sdo_answer(bus)
            if answer is not None:
                at.append(time.monotonic())
                counts.append(answer)
    finally:
        bus.shutdown()
    moments, turns = np.array(at), np.array(counts) / axis.counts_per_unit
    steps = max(1, round(0.02 / float(np.median(np.diff(moments)))))
    speeds = np.abs(turns[steps:] - turns[:-steps]) / (moments[steps:] - moments[:-steps])
    return _first_slower(moments[steps:], speeds, event)


def _sdo_answer(bus: can.BusABC) -> int | None:
    end = time.monotonic() + 0.05
    while (left := end - time.monotonic()) > 0.0:
        message = bus.recv(left)
        if message is not None and message.arbitration_id == 0x580 + _NODE and message.data[1:3] == b"\x64\x60":
            return int.from_bytes(message.data[4:8], "little", signed=True)
    return None


# Events: each gives what causes it


def _stopped(cell: _Cell, name: str) -> Callable[[], None]:
    return lambda: cell.processes[name].send_signal(signal.SIGSTOP)


def _killed(cell: _Cell, name: str) -> Callable[[], None]:
    return cell.processes[name].kill


def _order(cell: _Cell, *words: str) -> Callable[[], None]:
    return lambda: _ignore(cell.operate(*words))


def _ignore(_: object) -> None:
    """What was started goes on."""


def _fault(cell: _Cell, fault: Fault, value: int | None) -> Callable[[], None]:
    seconds = 1.0 if fault is not Fault.EMERGENCY else None

    def cause() -> None:
        call = new_call(FaultDrive(_NODE, 1, fault, value, seconds), cell.heard())
        threading.Thread(target=cell.ask, args=("gateway/left_bus", call), daemon=True).start()

    return cause


def _to_free_ports(file: Path) -> None:
    """Ports that nobody listens on, and a bus that several processes can share."""
    text = file.read_text()
    for port in sorted(set(re.findall(r"127\.0\.0\.1:(\d+)", text))):
        with socket.create_server(("127.0.0.1", 0)) as holder:
            text = text.replace(f"127.0.0.1:{port}", f"127.0.0.1:{holder.getsockname()[1]}")
    file.write_text(text)
    drives = file.parents[1] / "two_arms" / "left_drives.yaml"
    options = f"options: {{port: {_port(text)}, hop_limit: 0}}"
    line = f"bus: {{interface: udp_multicast, channel: 239.74.163.4, {options}, bitrate: 1000000}}"
    drives.write_text(re.sub(r"^bus: .*$", line, drives.read_text(), flags=re.MULTILINE))


def _port(text: str) -> int:
    found = re.search(r"127\.0\.0\.1:(\d+)", text)
    return 20000 + int(found.group(1)) % 20000 if found else 20000


if __name__ == "__main__":
    for row in rests():
        print("  ".join(row.cells()))
