"""One seeded run of a generated cell under its plan of faults, judged at every step.

Everything follows from the seed: the cell, the weather, the plan. The faults end, and then a patient operator brings
every program to its end; when all is done nothing may move any more.
"""

import random
import traceback
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, field

from cell.messages import Mode, ZoneState
from tests.sim.cells import GeneratedCell, generated_cell, is_room
from tests.sim.coverage import Coverage
from tests.sim.faults import Item, Play, Stage, draw_plan
from tests.sim.judge import Broken, Judge
from tests.sim.judge.room import KeptApart
from tests.sim.network import Weather
from tests.sim.planning_cache import remember_plans
from tests.sim.staff import Staff
from tests.sim.world import World

SEEDS_PER_CELL = 4
_SHORTEST_S = 6.5
"""It takes some 2 s until robots move."""
_REST_S = 0.6
_HEAL_S = 2.0
"""Processes that are down when the faults end are started by then."""
_LONGEST_BRINGING_BACK_S, _PROGRAMS_LONG = 60.0, 7.0
"""At most so long, or so many times as long as the longest program: robots of a row wait for each other one by one."""
_DRIVES_WAIT_S = (0.0, 0.45)
"""Real drives may have a time-out of their own, or none that matters: then a gateway's own is all there is."""
_WEATHERS = (
    Weather(loss=0.0, double=0.0, late=0.0),
    Weather(loss=0.02, late=0.005),
    Weather(loss=0.05),
    Weather(loss=0.05, late=0.1, late_s=0.3),
    Weather(loss=0.2, double=0.05, late=0.05),
)


@dataclass(slots=True)
class Outcome:
    """What a run has shown."""

    seed: int
    broken: Broken | None
    plan: tuple[Item, ...]
    struck: list[tuple[float, Item]]
    duration_s: float
    families: tuple[str, ...]
    contended: bool
    """Two robots asked for one zone at the same time."""
    coverage: Coverage = field(repr=False)


class Unfinished(Broken):
    """The faults are over, and a patient operator does not bring the cell to its end."""


class Crashed(Broken):
    """The run has ended in an exception, of the product or of the simulation."""

    def __init__(self, error: Exception, at_s: float = 0.0) -> None:
        told = "".join(traceback.format_exception(error))
        super().__init__("no exception", at_s, type(error).__name__, told)


def weather_of(seed: int) -> Weather:
    return random.Random(f"weather {seed}").choice(_WEATHERS)


def cell_of(seed: int) -> GeneratedCell:
    return generated_cell(seed // SEEDS_PER_CELL)


def plan_of(seed: int, seconds: float) -> tuple[Item, ...]:
    """The faults of a seed: in the first part of the run, 12 to `seconds` long for most."""
    return draw_plan(seed, cell_of(seed), _lasting_s(seed, seconds))


def _lasting_s(seed: int, seconds: float) -> float:
    """How long faults may strike; longer in a room, where it takes some time until robots meet."""
    shares = [0.6, 0.8] if is_room(seed // SEEDS_PER_CELL) else [0.25, 0.3, 0.35, 0.5, 0.7]
    return max(_SHORTEST_S, seconds * random.Random(f"length {seed}").choice(shares))


def run_seed(
    seed: int,
    seconds: float = 30.0,
    only: Collection[str] | None = None,
    plan: Sequence[Item] | None = None,
    look: Callable[[World, Judge], None] | None = None,
) -> Outcome:
    """Run a seed, with its own plan or another; `look` may watch the world before it begins.

    An exception out of the cell is an outcome, too.
    """
    cell, weather = cell_of(seed), weather_of(seed)
    plan = plan_of(seed, seconds) if plan is None else tuple(plan)
    world = World(cell.bundle, seed, weather, random.Random(f"drives {seed}").choice(_DRIVES_WAIT_S))
    remember_plans(world)
    judge = Judge(world, only)
    coverage = Coverage(world, judge.facts)
    staff = Staff(world, judge.facts)
    play = Play(Stage(world, judge.facts, staff, set()), plan)
    if look is not None:
        look(world, judge)
    bringing_back_s = max(_LONGEST_BRINGING_BACK_S, _PROGRAMS_LONG * cell.longest_s)
    broken: Broken | None = None
    try:
        _run(world, judge, staff, play, _lasting_s(seed, seconds), bringing_back_s)
    except Broken as error:
        broken = error
    except Exception as error:
        broken = Crashed(error, world.clock.now - judge.facts.start)
    coverage.struck(play.struck)
    duration_s = world.clock.now - judge.facts.start
    return Outcome(seed, broken, plan, play.struck, duration_s, cell.families, coverage.contended, coverage)


def _run(world: World, judge: Judge, staff: Staff, play: Play, lasting_s: float, bringing_back_s: float) -> None:
    clock, facts = world.clock, judge.facts
    clock.run_until(facts.start + lasting_s)
    _heal(world, play)
    clock.run_until(max(facts.troubled_until, clock.now) + _HEAL_S)
    for name in world.processes:
        world.start(name)
    staff.endless = False
    done = clock.run_until(clock.now + bringing_back_s, lambda: staff.all_done)
    if not done and not _stuck_together(judge):
        raise Unfinished("everyone is done in the end", clock.now - facts.start, *_unfinished(world, staff))
    staff.working = False
    clock.run_until(clock.now + _REST_S)
    _at_rest(world, judge)


def _heal(world: World, play: Play) -> None:
    """No more faults, and a network that loses little."""
    play.active = False
    world.network.heal()
    world.network.weather = Weather(loss=min(world.network.weather.loss, 0.05), late=0.01, late_s=0.1)
    world.journal.fill(False)


def _stuck_together(judge: Judge) -> bool:
    """Two robots in one zone, or nearer than their margin: only set-up, or a jog by somebody who looks, parts them.

    Drives that failed have brought them there, or the judge had said so.
    """
    inside = [zone for robot in judge.facts.robots for zone in judge.facts.inside_now(robot)]
    too_near = any(isinstance(each, KeptApart) and each.too_near for each in judge.invariants)
    return too_near or len(inside) > len(set(inside))


def _unfinished(world: World, staff: Staff) -> tuple[str, str]:
    left = sorted(set(world.cell.robots) - staff.done)
    states = [world.seen.robots[robot] for robot in left if robot in world.seen.robots]
    manager = world.seen.manager
    zones = [
        f"{name} {zone.state.value} by {zone.holder or 'nobody'} {zone.reason}"
        for name, zone in (manager.zones.items() if manager is not None else ())
        if zone.state is not ZoneState.FREE or zone.reason
    ]
    what = "; ".join(
        f"{state.robot} is {state.mode.value}, line {state.program.line}, {state.program.state.value}, "
        f"{state.waiting_for or 'waits for nothing'} {' '.join(state.alarms)}"
        for state in states
    )
    return ", ".join(left), f"{what}; zones: {', '.join(zones) or 'all free'}"


def _at_rest(world: World, judge: Judge) -> None:
    for robot in world.cell.robots:
        state = world.seen.robots[robot]
        if judge.facts.moving(robot) and state.mode is not Mode.RUNNING:
            raise Unfinished("everyone rests in the end", world.clock.now - judge.facts.start, robot, "it still moves")
