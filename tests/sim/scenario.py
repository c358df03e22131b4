"""One seeded run of the cell: weather, kills and restarts, an operator, and the invariants at every step.

Replay one seed of the tests:  python -m tests.sim.scenario SEED [--faults EVERY_S] --longest S [--cell FILE]
"""

import argparse
from dataclasses import dataclass
from pathlib import Path

from tests.sim.invariants import Invariants
from tests.sim.network import Weather
from tests.sim.operator import PatientOperator, RestlessOperator
from tests.sim.world import TWO_ARMS, World, load_bundle

BAD = Weather(loss=0.05)
"""Programs must end in this weather."""
WORSE = Weather(loss=0.2, double=0.05, late=0.05)
"""Nothing may be unsafe in this one."""
_COME_TO_REST_S = 3.0
_OVERLOAD = 0x2310
"""An EMCY of the simulated drives: continuous overcurrent."""


@dataclass(frozen=True, slots=True)
class Outcome:
    """What a run has shown."""

    all_done: bool
    duration_s: float
    kills: int
    freezes: int
    drive_faults: int
    samples: int
    time_inside_s: dict[str, float]
    world: World


class Trouble:
    """Kills, restarts and freezes agents and the manager, and lets drives fail, at random times."""

    def __init__(self, world: World, every_s: float, drives_share: float = 0.2) -> None:
        """`drives_share` is the share of the troubles that drives have."""
        self._world = world
        self._every_s = every_s
        self._drives_share = drives_share
        self.active = True
        self.kills = 0
        self.freezes = 0
        self.drive_faults = 0
        self._plan()

    def _plan(self) -> None:
        self._world.clock.after(self._world.rng.expovariate(1.0 / self._every_s), self._strike)

    def _strike(self) -> None:
        if self.active and self._world.rng.random() < self._drives_share:
            self.drive_faults += 1
            bus = self._world.buses[self._world.rng.choice(sorted(self._world.buses))]
            bus.nodes[self._world.rng.choice(sorted(bus.nodes))].raise_emergency(_OVERLOAD)
        elif self.active:
            victim = self._world.rng.choice(["manager", *(f"robot/{robot}" for robot in self._world.cell.robots)])
            if self._world.rng.random() < 0.3:
                self.freezes += 1
                self._world.processes[victim].freeze(self._world.rng.uniform(0.05, 0.6))
            elif self._world.processes[victim].alive:
                self.kills += 1
                self._world.kill(victim)
                self._world.clock.after(self._world.rng.uniform(0.3, 2.0), lambda: self._restart(victim))
        self._plan()

    def _restart(self, victim: str) -> None:
        role, _, name = victim.partition("/")
        if role == "manager":
            self._world.start_manager()
        else:
            self._world.start_agent(name)


def run_scenario(
    seed: int,
    weather: Weather,
    longest_s: float,
    trouble_every_s: float | None = None,
    restless: bool = False,
    cell_file: Path = TWO_ARMS,
) -> Outcome:
    """Run a cell under one seed. Raises `invariants.Broken`.

    Without trouble the run ends when all programs have ended; with trouble it lasts `longest_s`, then the network and
    the machines leave the cell in peace, everything is halted and must come to rest. A restless operator changes
    override, manual speed and step mode at random.
    """
    world = World(load_bundle(cell_file), seed, weather)
    invariants, operator = Invariants(world), (RestlessOperator if restless else PatientOperator)(world)
    trouble = Trouble(world, trouble_every_s) if trouble_every_s is not None else None
    start = world.clock.now
    done = world.clock.run_until(start + longest_s, lambda: trouble is None and operator.all_done)
    ended = world.clock.now
    operator.working = False
    if trouble is not None:
        trouble.active = False
    for robot in world.cell.robots:
        world.kill(f"robot/{robot}")
    world.clock.run_until(world.clock.now + _COME_TO_REST_S)
    invariants.check_at_rest()
    had = (0, 0, 0) if trouble is None else (trouble.kills, trouble.freezes, trouble.drive_faults)
    return Outcome(done, ended - start, *had, invariants.samples, invariants.time_inside_s, world)


def _main() -> None:
    parser = argparse.ArgumentParser(description="replay one seed of the cell simulation")
    parser.add_argument("seed", type=int)
    parser.add_argument("--faults", type=float, metavar="EVERY_S", help="20 %% loss, and trouble so often")
    parser.add_argument("--longest", type=float, default=60.0, help="seconds of cell time")
    parser.add_argument("--restless", action="store_true", help="the operator changes the pace at random")
    parser.add_argument("--cell", type=Path, default=TWO_ARMS, help="the cell file")
    options = parser.parse_args()
    weather = BAD if options.faults is None else WORSE
    outcome = run_scenario(options.seed, weather, options.longest, options.faults, options.restless, options.cell)
    for event in outcome.world.seen.events:
        print(f"{event.source:16s} {event.code:16s} {event.text}")
    print(
        f"seed {options.seed}: {'all programs ended' if outcome.all_done else 'stopped'} after "
        f"{outcome.duration_s:.1f} s of cell time, {outcome.kills} kills, {outcome.freezes} freezes, "
        f"{outcome.drive_faults} faults of drives, "
        f"{outcome.samples} samples checked, seconds in the zone {outcome.time_inside_s}"
    )


if __name__ == "__main__":
    _main()
