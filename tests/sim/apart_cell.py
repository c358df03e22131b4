"""The example's two arms without zones, kept apart by what the manager clears: other programs, other distances."""

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from cell.geometry import capsule_distance, transform_points
from cell.messages import Clearance, DriveFeedback, Event, Presence, ProgramState
from tests.sim.network import Weather
from tests.sim.operator import PatientOperator
from tests.sim.world import World, load_bundle
from tests.unit.config_world import CELL, Copy

MARGIN_M = 0.03
SIDES = ("left", "right")
QUIET = Weather(0.0, 0.0, 0.0)
STEP_S = 0.1


def apart_cell(
    folder: Path,
    programs: dict[str, str],
    margin_mm: float | None = 1000.0 * MARGIN_M,
    drives: Callable[[Copy], object] | None = None,
) -> Path:
    """A copy of the example without zones, on slow buses; `margin_mm` None: nothing keeps its arms apart.

    `drives` changes what is said of the drives.
    """
    copy = Copy(folder).slow_buses()
    if drives is not None:
        drives(copy)
    text = (copy.folder / CELL).read_text()
    before, _, after = text.partition("zones:\n")
    kept = "separation: off\n" if margin_mm is None else f"separation: {{margin: {margin_mm:g}}}\n"
    (copy.folder / CELL).write_text(f"{before}{kept}{after[after.index('# Everything on one busy') :]}")
    for side, program in programs.items():
        (copy.folder / "two_arms" / "programs" / f"{side}.prog").write_text(program)
    return copy.cell


@dataclass
class Apart:
    """What happens in a cell of two arms, and how near they come to each other."""

    cell: Path
    seed: int = 1
    weather: Weather = QUIET
    world: World = field(init=False)
    nearest_m: float = np.inf
    forced: list[str] = field(default_factory=list)
    refused: dict[str, str] = field(default_factory=dict)
    """By robot: why the newest clearance was not all of what it asked for."""
    presences: dict[str, Presence] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.world = World(load_bundle(self.cell), self.seed, self.weather)
        self._measured: dict[str, DriveFeedback] = {}
        self.operator = PatientOperator(self.world)
        self.world.on_feedback.append(self._look)
        self.world.on_published.append(self._hear)

    def _look(self, feedback: DriveFeedback) -> None:
        self._measured[feedback.robot] = feedback
        if len(self._measured) < 2 or feedback.robot != SIDES[0]:
            return
        (one, its), (other, others) = (self._capsules(side) for side in SIDES)
        away = capsule_distance(one[:, None], its[:, None], other[None], others[None])
        self.nearest_m = min(self.nearest_m, float(away.min()))

    def _capsules(self, robot: str) -> tuple[np.ndarray, np.ndarray]:
        planner, model = self.world.planners[robot], self.world.models[robot]
        q = model.coupling.joints(self._measured[robot].position)
        return transform_points(planner.pose_world_base, model.capsules(q)), model.capsule_radii

    def _hear(self, _name: str, message: object) -> None:
        match message:
            case Event(code="space_forced", text=text):
                self.forced.append(text)
            case Clearance():
                self.refused[message.robot] = "" if message.refused is None else message.refused.text
            case Presence():
                self.presences[message.robot] = message

    def run(self, seconds: float) -> float:
        """Until both programs are done, or for so long; how long it took."""
        start = self.world.clock.now
        while self.world.clock.now < start + seconds and not self.done:
            self.world.clock.run_until(self.world.clock.now + STEP_S)
        return self.world.clock.now - start

    @property
    def done(self) -> bool:
        states = self.world.seen.robots
        return len(states) == 2 and all(state.program.state is ProgramState.DONE for state in states.values())
