"""How many arms a host holds: cells that grow by an arm, until their cycles are late where an idle loop's are not.

`python -m bench arms` alone; each cell is run for half a minute.
"""

import os
import re
import shutil
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from pathlib import Path

from bench.gateway import copy_on_free_ports, free_endpoint
from bench.idle import IdleLoop
from bench.load import family, running, used
from bench.owner import CYCLE_S
from bench.timing import Row
from cell.config.load import load_cell
from cell.config.settings import CellSettings
from cell.messages import GatewayState, ProgramState, RobotState
from cell.net.options import Link
from cell.net.session import CellSession

MOST = 8
"""What the project promises on two cores."""
_READY_S = 120.0
_SETTLE_S = 5.0
_APART_MM = 6000.0
"""In a row, out of one another's reach."""
_CHANCE = 1e-3
"""Of the cycles: a few late ones more are what the host did meanwhile."""
_PROGRAM = """LABEL again
MJ J1=-40 J2=-8 J3=62 J4=-30 J5=36 J6=-10 F=80
ML Z=1250 F=500
MJ J1=40 J2=-12 J3=65 J4=0 J5=37 J6=0 F=80
GOTO again
"""


def arms(seconds: float = 20.0) -> Iterator[Row]:
    """Cells of two arms and more, six axes each at 250 Hz, simulated drives without the wire's time."""
    for count in range(2, MOST + 1):
        row, kept = _measure(count, seconds)
        yield row
        if not kept:
            return


def _measure(count: int, seconds: float) -> tuple[Row, bool]:
    """A row, and whether all programs go on and no more cycles were late than of the loop beside it."""
    with tempfile.TemporaryDirectory() as folder, ExitStack() as stack:
        cell = cell_of([(_APART_MM * number, 0.0, 0.0) for number in range(count)], Path(folder))
        idle = stack.enter_context(IdleLoop(CYCLE_S, fifo=True))
        parent = stack.enter_context(running(cell))
        watcher = _Watcher(load_cell(cell), stack)
        up = watcher.wait_for_motion()
        time.sleep(_SETTLE_S)
        before = watcher.late()
        share = sum(each.seconds for each in used(family(parent), seconds)) / seconds
        late, run = watcher.late() - before, watcher.running()
        idle_late = sum(late_s > 0.5 * CYCLE_S for late_s in idle.lateness_s()[-round(seconds / CYCLE_S) :])
    cores = os.cpu_count() or 1
    cycles = round(count * seconds / CYCLE_S)
    told = f"{late} of {cycles} cycles late, {idle_late} of the idle loop's" if up else "not all of them came to move"
    told += f", {run} programs run at the end"
    row = Row(f"{count} arms at 250 Hz, all processes, per second", share, share / cores, f"of {cores} cores; {told}")
    return row, up and run == count and late <= count * idle_late + _CHANCE * cycles


class _Watcher:
    """What the gateways of a cell say."""

    def __init__(self, settings: CellSettings, stack: ExitStack) -> None:
        self._gateways, self._robots = list(settings.gateways), list(settings.robots)
        link = Link("client", connect=(settings.manager_endpoint,), open_timeout_s=_READY_S)
        self._session = stack.enter_context(CellSession(settings.name, link, "observer", "arms", "bench-arms"))
        self._latest = self._session.watch("gateway/*/state")
        self._newest: dict[str, GatewayState] = {}

    def _look(self) -> None:
        for message in self._latest.take_new():
            if isinstance(message, GatewayState):
                self._newest[message.gateway] = message

    def wait_for_motion(self) -> bool:
        """Until every gateway plays blocks."""
        deadline = time.monotonic() + _READY_S
        while time.monotonic() < deadline:
            self._look()
            if sum(each.counters.blocks_accepted > 100 for each in self._newest.values()) == len(self._gateways):
                return True
            time.sleep(0.1)
        return False

    def late(self) -> int:
        """Cycles that were late since the gateways started."""
        time.sleep(0.5)
        self._look()
        return sum(each.counters.late_cycles for each in self._newest.values())

    def running(self) -> int:
        """How many robots' programs run now."""
        latest, states = self._session.watch("robot/*/state"), dict[str, ProgramState]()
        deadline = time.monotonic() + _SETTLE_S
        while time.monotonic() < deadline and len(states) < len(self._robots):
            time.sleep(0.1)
            new = latest.take_new()
            states |= {each.robot: each.program.state for each in new if isinstance(each, RobotState)}
        return sum(state is ProgramState.RUNNING for state in states.values())


def cell_of(bases: Sequence[tuple[float, float, float]], folder: Path) -> Path:
    """A cell of arms as the example's left one, which wave: X, Y [mm] and turn [deg] of each."""
    cell = copy_on_free_ports(folder)
    home = cell.parent
    drives = (home / "left_drives.yaml").read_text().replace("wire_time: true", "wire_time: false")
    shutil.rmtree(home / "programs")
    (home / "again.prog").write_text(_PROGRAM)
    gateways, robots = [], []
    for number, (x, y, turn) in enumerate(bases):
        name = f"arm{number}"
        text = re.sub(r"\bleft\b", name, drives).replace("two_arms_left", f"arms_{number}")
        (home / f"{name}.yaml").write_text(text)
        gateways.append(f'  {name}_bus: {{endpoint: "{free_endpoint()}", drives: {name}.yaml}}')
        robots.append(
            f"  {name}: {{model: ../models/six_axis.yaml, gateway: {name}_bus, program: again.prog,"
            f" base: {{X: {x:.1f}, Y: {y:.1f}, Z: 0, A: 0, B: 0, C: {turn:g}}}}}"
        )
    names = ", ".join(f"arm{number}" for number in range(len(bases)))
    cell.write_text(
        "cell: arms\nunits: {length: mm, angle: deg}\n"
        f'manager: {{endpoint: "{free_endpoint()}"}}\n'
        + "\n".join(["gateways:", *gateways, "robots:", *robots])
        + "\nzones: {aside: {size: [100, 100, 100], pose: {X: 0, Y: 9000, Z: 0, A: 0, B: 0, C: 0}, "
        + f"robots: [{names}]}}}}\n"
        "times: {feedback_lost_s: 0.8, owner_silent_s: 2}\n"
    )
    return cell
