"""What shared room costs: an agent's step with it and without, a manager with eight robots near each other and far.

`python -m bench shared_room` alone. Whole cells on virtual time, with the cores and the codec that real processes run:
processor time of what they do, without Zenoh's own threads.
"""

import math
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from bench.arms import cell_of
from bench.load import without_end
from bench.timing import Row
from cell.messages import ProgramState
from tests.sim.apart_cell import QUIET, SIDES, apart_cell
from tests.sim.operator import PatientOperator
from tests.sim.world import World, load_bundle
from tests.unit.config_world import TWO_ARMS

ROBOTS = 8
SECONDS = 20.0
_READY_S = 30.0
_NEAR_M, _FAR_M = 2.6, 12.0
"""From the middle of a ring to each robot: neighbours are 2 m apart and share room, or nobody reaches anybody."""


def shared_room() -> Iterator[Row]:
    """Two arms with the example's programs, and a ring of eight that look at its middle."""
    with TemporaryDirectory() as name:
        apart, alone = (_steps_s(Path(name) / str(margin), margin) for margin in (30.0, None))
        for share, named, allowed_s in ((50, "median", 0.4e-3), (99, "99th percentile", 1e-3)):
            more_s = float(np.percentile(apart, share) - np.percentile(alone, share))
            what = f"an agent's step, {named}, kept apart beside not"
            yield Row(what, more_s, more_s / allowed_s, f"of {1e3 * allowed_s:g} ms")
        yield _manager(Path(name) / "near", _NEAR_M, "near each other", 0.25)
        yield _manager(Path(name) / "far", _FAR_M, "out of each other's reach", 0.10)


def _steps_s(folder: Path, margin_mm: float | None) -> list[float]:
    """Each step [s] of both agents while their programs run."""
    folder.mkdir()
    programs = {side: (TWO_ARMS.parent / "programs" / f"{side}.prog").read_text() for side in SIDES}
    cell = apart_cell(folder, programs, margin_mm)
    without_end(cell.parent / "programs")
    world = _moving(cell)
    steps = [_timed(world.processes[f"robot/{side}"].core, "step") for side in SIDES]
    world.clock.run_until(world.clock.now + SECONDS)
    return [took for each in steps for took in each]


def _manager(folder: Path, ring_m: float, where: str, allowed: float) -> Row:
    """Of the manager of a ring of robots, as a share of a core, beside what is `allowed`."""
    folder.mkdir()
    turns = np.arange(ROBOTS) * 2.0 * math.pi / ROBOTS
    bases = [(1e3 * ring_m * math.cos(a), 1e3 * ring_m * math.sin(a), math.degrees(a) + 180.0) for a in turns.tolist()]
    world = _moving(cell_of(bases, folder))
    manager = world.processes["manager"]
    parts = [_timed(manager.session, "take_in"), _timed(manager.core, "step"), _timed(manager.shell, "perform")]
    world.clock.run_until(world.clock.now + SECONDS)
    share = sum(map(sum, parts)) / SECONDS
    moving = sum(state.program.state is ProgramState.RUNNING for state in world.seen.robots.values())
    what = f"manager with {ROBOTS} robots {where}, {moving} programs run, per second"
    return Row(what, share, share / allowed, f"of {100 * allowed:g} % of a core")


def _moving(cell: Path) -> World:
    """A cell in which all programs run."""
    world = World(load_bundle(cell), 1, QUIET)
    PatientOperator(world)
    until = world.clock.now + _READY_S
    if not world.clock.run_until(until, lambda: _all_run(world)):
        raise RuntimeError(f"not all programs of {cell} run after {_READY_S:g} s")
    return world


def _all_run(world: World) -> bool:
    states = world.seen.robots
    running = sum(state.program.state is ProgramState.RUNNING for state in states.values())
    return running == len(world.cell.robots)


def _timed(owner: object, name: str) -> list[float]:
    """How long [s] of the processor each call of a method takes from now on."""
    took: list[float] = []
    method: Callable[..., object] = getattr(owner, name)

    def timed(*args: object) -> object:
        begin = time.thread_time()
        try:
            return method(*args)
        finally:
            took.append(time.thread_time() - begin)

    setattr(owner, name, timed)
    return took
