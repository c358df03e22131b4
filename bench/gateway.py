"""Gateways as they run: two processes, twelve axes at 250 Hz, their drives in processes of their own."""

import os
import re
import shutil
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bench.idle import NO_FIFO, IdleLoop
from bench.owner import CYCLE_S, Owner
from bench.timing import Row
from cell.config.load import load_cell
from cell.config.settings import CellSettings
from cell.messages.gateway_state import BusCounters
from cell.net.runner import Priority, scheduling

CONFIGS = Path(__file__).parents[1] / "cell_configs"
CORE_SHARE, LATENCY_S = 0.60, 0.5e-3
"""What the project promises: of a core for both gateways, and from a block to its frame beyond the cycle."""
LOOK_S = 1e-3
_TICK_S = 1.0 / os.sysconf("SC_CLK_TCK")


def gateways(seconds: float = 60.0) -> list[Row]:
    """Both gateways of the example cell with and without SCHED_FIFO, beside a loop that does nothing."""
    rows = []
    for fifo, how in ((True, "SCHED_FIFO"), (False, "no SCHED_FIFO")):
        seen = _measure(seconds, fifo)
        rows += [_share(seen, how), _latency(seen, how), _punctuality(seen, how)]
    return rows


@dataclass(frozen=True)
class _Measured:
    """What was seen in so many seconds."""

    seconds: float
    used_s: float
    """Processor time of all gateways."""
    before: list[BusCounters]
    after: list[BusCounters]
    owners: list[Owner]
    idle_s: list[float]
    """By how much each cycle of the idle loop was late."""


def _measure(seconds: float, fifo: bool) -> _Measured:
    with tempfile.TemporaryDirectory() as folder, ExitStack() as stack:
        settings = load_cell(_on_multicast(Path(folder)))
        masters = [stack.enter_context(_process("run", settings, gateway, fifo)) for gateway in settings.gateways]
        for gateway in settings.gateways:
            stack.enter_context(_process("simulate", settings, gateway, fifo))
        idle = stack.enter_context(IdleLoop(CYCLE_S, fifo))
        # Whoever measures must not wait for a processor, and so its Zenoh threads must not either.
        with scheduling(Priority.FEEDING):
            owners = [Owner(settings, robot, stack) for robot in settings.robots]
        _drive(owners, 2.0)
        before, used_s = [owner.counters for owner in owners], sum(map(_cpu_s, masters))
        for owner in owners:
            owner.forget()
        _drive(owners, seconds)
        used_s = sum(map(_cpu_s, masters)) - used_s
        after = [owner.counters for owner in owners]
        return _Measured(seconds, used_s, before, after, owners, idle.lateness_s()[-round(seconds / CYCLE_S) :])


def _share(seen: _Measured, how: str) -> Row:
    cycles = len(seen.owners) * seen.seconds / CYCLE_S
    share = seen.used_s / seen.seconds
    text = f"12 axes on two buses at 250 Hz, {how}, per cycle"
    return Row(text, seen.used_s / cycles, share / CORE_SHARE, "of 60 % of a core")


def _punctuality(seen: _Measured, how: str) -> Row:
    pairs = list(zip(seen.before, seen.after, strict=True))
    late = sum(new.late_cycles - old.late_cycles for old, new in pairs)
    missing = sum(new.missing_tpdos - old.missing_tpdos for old, new in pairs)
    worst_s = max(new.worst_lateness_s for new in seen.after)
    late_idle = sum(late_s > 0.5 * CYCLE_S for late_s in seen.idle_s)
    return Row(
        f"worst cycle in {seen.seconds:.0f} s, {how}: {late} late, {missing} TPDOs missing",
        worst_s,
        worst_s / CYCLE_S,
        f"of a cycle; idle loop beside it {max(seen.idle_s) / CYCLE_S:.2g}, {late_idle} late",
    )


def _latency(seen: _Measured, how: str) -> Row:
    """From a block to its first frame. A block may wait for the next cycle, so one cycle does not count."""
    latencies = np.concatenate([owner.latencies for owner in seen.owners])
    p99_s = float(np.quantile(latencies, 0.99))
    late, lost = sum(owner.late for owner in seen.owners), sum(owner.lost for owner in seen.owners)
    spread = f"{_spread(latencies)} ms with the wait, {len(latencies)} blocks, {late} a cycle late, {lost} lost"
    beyond_s = max(0.0, p99_s - CYCLE_S)
    return Row(
        f"block to frame beyond the cycle, p99, {how} (p50, p90, p99: {spread})",
        beyond_s,
        beyond_s / LATENCY_S,
        f"of 0.5 ms; cycles of the idle loop beside it are late by {_spread(seen.idle_s)} ms",
    )


def _spread(times_s: Sequence[float] | NDArray[np.float64]) -> str:
    """Median, 90 % and 99 % quantile in ms."""
    return ", ".join(f"{1e3 * value:.2f}" for value in np.quantile(times_s, (0.5, 0.9, 0.99)))


def _drive(owners: list[Owner], seconds: float) -> None:
    end = time.monotonic() + seconds
    # Whoever measures must not wait for a processor itself.
    with scheduling(Priority.BUS):
        while time.monotonic() < end:
            for owner in owners:
                owner.step()
            # What it hears bears the time at which it came, so it need not look often.
            due = min(owner.due for owner in owners)
            time.sleep(min(max(due - time.monotonic(), 0.0), LOOK_S))


def copy_on_free_ports(folder: Path) -> Path:
    """A copy of the example cell."""
    for name in ("two_arms", "models"):
        shutil.copytree(CONFIGS / name, folder / name, ignore=shutil.ignore_patterns(".zencell"))
    cell = folder / "two_arms" / "cell.yaml"
    cell.write_text(re.sub(r"127\.0\.0\.1:\d+", lambda _: f"127.0.0.1:{_free(socket.SOCK_STREAM)}", cell.read_text()))
    return cell


def _on_multicast(folder: Path) -> Path:
    """A copy whose buses are where several processes can be."""
    cell = copy_on_free_ports(folder)
    bus = "bus: {interface: udp_multicast, channel: 239.74.163.2, bitrate: 1000000, options: {port: %d, hop_limit: 0}}"
    for drives in (folder / "two_arms").glob("*_drives.yaml"):
        text = drives.read_text()
        drives.write_text(re.sub(r"^bus: .*$", bus % _free(socket.SOCK_DGRAM), text, flags=re.MULTILINE))
    return cell


def free_endpoint() -> str:
    """Where nobody listens yet."""
    return f"tcp/127.0.0.1:{_free(socket.SOCK_STREAM)}"


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
