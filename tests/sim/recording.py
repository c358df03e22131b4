"""A run of a cell as the judge sees it, kept so that it can be judged again with something in it changed."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from types import SimpleNamespace
from typing import Any

from cell.commands.checks import CellBundle
from cell.core import Effect
from tests.sim.clock import Clock
from tests.sim.faults import Item, Play, Stage
from tests.sim.judge import Broken, Judge
from tests.sim.judge.facts import SAMPLE_S, Floats
from tests.sim.network import Weather
from tests.sim.staff import Staff
from tests.sim.world import World


@dataclass(frozen=True, slots=True, eq=False)
class Moment:
    """One thing that a judge is shown."""

    at: float
    kind: str
    """published, delivered, effect, life, planned, sample or space."""
    name: str
    what: Any
    calm_until: float
    """The plan's newest fault has worn off."""


Change = Callable[[list[Moment]], Iterable[Moment]]


class Recording:
    """All moments of one run."""

    def __init__(self, bundle: CellBundle, seconds: float, plan: Sequence[Item]) -> None:
        """Of a cell in calm weather, under a plan."""
        self.world = World(bundle, 1, Weather(loss=0.0, double=0.0, late=0.0))
        self.judge = Judge(self.world)
        self.moments: list[Moment] = []
        self._plans = dict.fromkeys(self.world.cell.robots, 0)
        self._boots = {name: process.boot for name, process in self.world.processes.items()}
        world, facts = self.world, self.judge.facts
        world.on_published.append(lambda name, message: self._keep("published", name, message))
        world.on_delivered.append(lambda name, message: self._keep("delivered", name, message))
        world.on_effect.append(self._effect)
        world.on_life.append(lambda name, what: self._keep("life", name, (what, world.processes[name].boot)))
        staff = Staff(world, facts)
        Play(Stage(world, facts, staff, set()), plan)
        world.clock.after(SAMPLE_S, self._sample)
        world.clock.run_until(world.clock.now + seconds)

    def _keep(self, kind: str, name: str, what: object) -> None:
        now, calm_until = self.world.clock.now, self.judge.facts.troubled_until
        for robot, planned in self.world.seen.planned.items():
            new = planned[self._plans[robot] :]
            self._plans[robot] += len(new)
            self.moments += [Moment(now, "planned", robot, each, calm_until) for each in new]
        self.moments.append(Moment(now, kind, name, what, calm_until))

    def _effect(self, name: str, effect: Effect) -> None:
        self._keep("effect", name, effect)

    def _sample(self) -> None:
        facts = self.judge.facts
        self._keep("sample", "", {robot: facts.measured(robot) for robot in facts.robots})
        if self.world.cell.separation is not None:
            self._keep("space", "", {robot: (facts.queued(robot), facts.reserved(robot)) for robot in facts.robots})
        self.world.clock.after(SAMPLE_S, self._sample)

    def judged(self, change: Change, *only: str) -> Broken | None:
        """What breaks first when the moments are changed so."""
        again = self._stage()
        judge = Judge(again, only or None)  # type: ignore[arg-type]
        try:
            for moment in change(list(self.moments)):
                _show(again, judge, moment)
            judge.flush()
        except Broken as broken:
            return broken
        return None

    def _stage(self) -> SimpleNamespace:
        """What a judge needs of a world, in which nothing happens by itself."""
        world = self.world
        return SimpleNamespace(
            bundle=world.bundle, cell=world.cell, clock=Clock(), network=world.network, models=world.models,
            planners=world.planners, cycle_s=world.cycle_s, buses=world.buses, axes={},
            seen=SimpleNamespace(planned={robot: [] for robot in world.cell.robots}),
            processes={
                name: SimpleNamespace(boot=boot, alive=True, frozen=False) for name, boot in self._boots.items()
            },
            on_published=[], on_delivered=[], on_effect=[], on_life=[],
        )  # fmt: skip


def _show(stage: SimpleNamespace, judge: Judge, moment: Moment) -> None:
    stage.clock.now = moment.at
    judge.facts.troubled_until = moment.calm_until
    match moment.kind:
        case "sample":
            axes: dict[str, Floats] = moment.what
            judge.facts.measured = axes.__getitem__  # type: ignore[method-assign]
            judge.facts.take_sample()
        case "space":
            judge.facts.queued = lambda robot: moment.what[robot][0]  # type: ignore[method-assign]
            judge.facts.reserved = lambda robot: moment.what[robot][1]  # type: ignore[method-assign]
        case "planned":
            stage.seen.planned[moment.name].append(moment.what)
        case "life":
            what, boot = moment.what
            alive, frozen = what not in ("killed", "ended"), what == "frozen"
            stage.processes[moment.name] = SimpleNamespace(boot=boot, alive=alive, frozen=frozen)
            for live in stage.on_life:
                live(moment.name, what)
        case _:
            for look in getattr(stage, f"on_{moment.kind}"):
                look(moment.name, moment.what)


# Changes


def each(kind: str, of: type, change: Callable[[Moment], Any], name: str = "") -> Change:
    """Change each message of a type; None leaves it out, and what is given is put in its place."""

    def changed(moments: list[Moment]) -> Iterator[Moment]:
        for moment in moments:
            mine = moment.kind == kind and isinstance(moment.what, of) and (not name or moment.name == name)
            what = change(moment) if mine else moment.what
            if what is not None:
                yield moment if what is moment.what else replace(moment, what=what)

    return changed


def after(at: float, change: Change) -> Change:
    """A change that begins so late, on the world's clock."""

    def changed(moments: list[Moment]) -> Iterator[Moment]:
        yield from (moment for moment in moments if moment.at < at)
        yield from change([moment for moment in moments if moment.at >= at])

    return changed


def with_one_more(at: float, kind: str, name: str, what: Any) -> Change:
    """One more moment, before the first one at or after this time."""

    def changed(moments: list[Moment]) -> Iterator[Moment]:
        place = next(i for i, moment in enumerate(moments) if moment.at >= at)
        yield from moments[:place]
        yield Moment(moments[place].at, kind, name, what, moments[place].calm_until)
        yield from moments[place:]

    return changed
