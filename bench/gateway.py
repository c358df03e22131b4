"""Gateways as they run: two processes, twelve axes at 250 Hz, their drives in processes of their own."""

import os
import re
import shutil
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import numpy as np

from bench.idle import NO_FIFO, IdleLoop
from bench.timing import Row
from cell.config.load import load_cell
from cell.config.settings import CellSettings
from cell.messages import Claim, DriveFeedback, EnableDrives, GatewayState, Reply, SetpointBlock
from cell.messages.gateway_state import BusCounters
from cell.net.errors import NoAnswer
from cell.net.options import Link
from cell.net.runner import scheduling
from cell.net.session import CellSession, new_call

CONFIGS = Path(__file__).parents[1] / "cell_configs"
CYCLE_S, BLOCK_PERIOD_S, SAMPLES = 0.004, 0.02, 45
LEAD = 8
"""Ticks from the newest feedback to the first sample of a block."""
READY_S = 60.0
CORE_SHARE, LATENCY_S = 0.60, 0.5e-3
"""What the project promises: of a core for both gateways, and from a block to its frame beyond the cycle."""
_TICK_S = 1.0 / os.sysconf("SC_CLK_TCK")


class Owner:
    """Claims one robot, enables it and sends it blocks; it keeps how long each took until it was played."""

    def __init__(self, settings: CellSettings, robot: str, stack: ExitStack) -> None:
        self._robot, self._gateway = robot, settings.robots[robot].gateway
        endpoint = settings.gateways[self._gateway].endpoint
        link = Link("client", connect=(endpoint,), open_timeout_s=READY_S)
        self._session = stack.enter_context(CellSession(settings.name, link, "robot", robot, f"bench-{robot}"))
        self._latest = self._session.watch(f"robot/{robot}/drives", f"gateway/{self._gateway}/state")
        self._feedback: DriveFeedback | None = None
        self._state: GatewayState | None = None
        self._sequence, self._sent_at, self._next = 0, 0.0, 0.0
        self.latencies: list[float] = []
        while self._feedback is None or self._state is None or not self._state.ready:
            self._listen()
            time.sleep(0.01)
        reply = self._ask(Claim(robot, f"bench-{robot}", settings.digest))
        if reply.claim is None:
            raise RuntimeError(reply.text)
        self._owner = reply.claim.owner
        deadline = time.monotonic() + READY_S
        while not (enabled := self._ask(EnableDrives(robot, self._owner))).ok:
            # Right after the start, or on a busy computer, the drives may not be there yet.
            if time.monotonic() > deadline:
                raise RuntimeError(enabled.text)
            time.sleep(0.5)

    @property
    def counters(self) -> BusCounters:
        if self._state is None:
            raise RuntimeError(f"gateway {self._gateway} was never heard")
        return self._state.counters

    def step(self) -> None:
        """Listen, and send the next block when it is due."""
        self._listen()
        now, feedback = time.monotonic(), self._feedback
        if now < self._next or feedback is None:
            return
        self._next = now + BLOCK_PERIOD_S
        self._sequence += 1
        position = np.tile(feedback.commanded, (SAMPLES, 1))
        first = feedback.tick + LEAD
        block = SetpointBlock(
            self._robot, self._owner, self._sequence, self._sequence - 1, first, CYCLE_S, 30, position, 0.0 * position
        )
        self._sent_at = time.monotonic()
        self._session.publish(block)

    def _listen(self) -> None:
        for message in self._latest.take_new():
            if isinstance(message, GatewayState):
                self._state = message
            elif isinstance(message, DriveFeedback):
                self._feedback = message
                if self._sent_at and message.block == self._sequence:
                    self.latencies.append(time.monotonic() - self._sent_at)
                    self._sent_at = 0.0

    def _ask(self, command: Claim | EnableDrives) -> Reply:
        deadline = time.monotonic() + READY_S
        while True:
            try:
                return self._session.ask(f"gateway/{self._gateway}", new_call(command), 5.0)
            except NoAnswer:
                if time.monotonic() > deadline:
                    raise


def gateways(seconds: float = 60.0) -> list[Row]:
    """Both gateways of the example cell with and without SCHED_FIFO, beside a loop that does nothing."""
    return [row for fifo in (True, False) for row in _run(seconds, fifo)]


def _run(seconds: float, fifo: bool) -> list[Row]:
    how = "SCHED_FIFO" if fifo else "no SCHED_FIFO"
    with tempfile.TemporaryDirectory() as folder, ExitStack() as stack:
        settings = load_cell(_on_multicast(Path(folder)))
        masters = [stack.enter_context(_process("run", settings, gateway, fifo)) for gateway in settings.gateways]
        for gateway in settings.gateways:
            stack.enter_context(_process("simulate", settings, gateway, fifo))
        owners = [Owner(settings, robot, stack) for robot in settings.robots]
        idle = stack.enter_context(IdleLoop(CYCLE_S, fifo))
        _drive(owners, 2.0)
        before, used = [owner.counters for owner in owners], sum(map(_cpu_s, masters))
        for owner in owners:
            owner.latencies.clear()
        _drive(owners, seconds)
        used = sum(map(_cpu_s, masters)) - used
        after = [owner.counters for owner in owners]
        late_idle, worst_idle_s = idle.counted()
    late = sum(new.late_cycles - old.late_cycles for old, new in zip(before, after, strict=True))
    missing = sum(new.missing_tpdos - old.missing_tpdos for old, new in zip(before, after, strict=True))
    worst_s = max(new.worst_lateness_s for new in after)
    latencies = np.concatenate([owner.latencies for owner in owners])
    beyond_s = max(0.0, float(np.quantile(latencies, 0.99)) - CYCLE_S)
    cycles = 2 * seconds / CYCLE_S
    share = used / seconds
    late_text = f"worst cycle in {seconds:.0f} s, {how}: {late} late, {missing} TPDOs missing"
    idle_text = f"of a cycle; idle loop beside it {worst_idle_s / CYCLE_S:.2g}, {late_idle} late"
    return [
        Row(
            f"12 axes on two buses at 250 Hz, {how}, per cycle", used / cycles, share / CORE_SHARE, "of 60 % of a core"
        ),
        Row(f"block to frame and back, beyond the cycle, p99, {how}", beyond_s, beyond_s / LATENCY_S, "of 0.5 ms"),
        Row(late_text, worst_s, worst_s / CYCLE_S, idle_text),
    ]


def _drive(owners: list[Owner], seconds: float) -> None:
    end = time.monotonic() + seconds
    # Whoever measures must not wait for a processor itself.
    with scheduling(realtime=True):
        while time.monotonic() < end:
            for owner in owners:
                owner.step()
            time.sleep(1e-4)


def _on_multicast(folder: Path) -> Path:
    """A copy of the example cell on free ports, its buses where several processes can be."""
    for name in ("two_arms", "models"):
        shutil.copytree(CONFIGS / name, folder / name, ignore=shutil.ignore_patterns(".zencell"))
    cell = folder / "two_arms" / "cell.yaml"
    cell.write_text(re.sub(r"127\.0\.0\.1:\d+", lambda _: f"127.0.0.1:{_free(socket.SOCK_STREAM)}", cell.read_text()))
    bus = "bus: {interface: udp_multicast, channel: 239.74.163.2, bitrate: 1000000, options: {port: %d, hop_limit: 0}}"
    for drives in (folder / "two_arms").glob("*_drives.yaml"):
        text = drives.read_text()
        drives.write_text(re.sub(r"^bus: .*$", bus % _free(socket.SOCK_DGRAM), text, flags=re.MULTILINE))
    return cell


def _free(kind: socket.SocketKind) -> int:
    with socket.socket(socket.AF_INET, kind) as free:
        free.bind(("127.0.0.1", 0))
        port: int = free.getsockname()[1]
        return port


@contextmanager
def _process(verb: str, settings: CellSettings, gateway: str, fifo: bool) -> Iterator[int]:
    """A `drive-gateway` command; its process id. Without `fifo` the system refuses it real-time scheduling."""
    code = f"{'' if fifo else NO_FIFO}from cell.commands.drive_gateway import main\nmain()"
    state = str(settings.file.parent / f"state-{verb}-{gateway}")
    words = [sys.executable, "-c", code, verb, str(settings.file), gateway, "--state-dir", state]
    process = subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        yield process.pid
    finally:
        process.terminate()
        process.wait()


def _cpu_s(pid: int) -> float:
    """Processor time of a process so far."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) * _TICK_S
