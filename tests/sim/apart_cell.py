"""The example's arms without zones, two to four of them, kept apart by what the manager clears: other programs."""

from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import combinations
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
BASES = {"left": (-1800, 0, 0), "right": (1800, 0, 180), "front": (0, -1800, 90), "back": (0, 1800, -90)}
"""Where an arm stands, X and Y [mm], and its turn [deg]: all look at the middle. The first two are the example's."""
QUIET = Weather(0.0, 0.0, 0.0)
STEP_S = 0.1


def apart_cell(
    folder: Path,
    programs: dict[str, str],
    margin_mm: float | None = 1000.0 * MARGIN_M,
    drives: Callable[[Copy], object] | None = None,
) -> Path:
    """A copy of the example without zones, on slow buses, with the arms that have programs here, and its own two.

    `margin_mm` None: nothing keeps them apart. `drives` changes what is said of the drives.
    """
    copy = Copy(folder).slow_buses()
    if drives is not None:
        drives(copy)
    text = (copy.folder / CELL).read_text()
    before, _, after = text.partition("zones:\n")
    kept = "separation: off\n" if margin_mm is None else f"separation: {{margin: {margin_mm:g}}}\n"
    (copy.folder / CELL).write_text(f"{before}{kept}{after[after.index('# Everything on one busy') :]}")
    for number, side in enumerate(sorted(programs.keys() - set(SIDES))):
        _add_arm(copy, side, 7460 + number)
    for side, program in programs.items():
        (copy.folder / "two_arms" / "programs" / f"{side}.prog").write_text(program)
    return copy.cell


def _add_arm(copy: Copy, side: str, port: int) -> None:
    """One more arm as the left one."""
    for name in ("drives.yaml", "drives.sim.yaml"):
        text = (copy.folder / "two_arms" / f"left_{name}").read_text()
        text = text.replace("two_arms_left", f"two_arms_{side}").replace("  left:", f"  {side}:")
        (copy.folder / "two_arms" / f"{side}_{name}").write_text(text)
    x, y, turn = BASES[side]
    gateway = f'  {side}_bus: {{endpoint: "tcp/127.0.0.1:{port}", drives: {side}_drives.yaml}}'
    robot = (
        f"  {side}: {{model: ../models/six_axis.yaml, gateway: {side}_bus, program: programs/{side}.prog, "
        f"base: {{X: {x}, Y: {y}, Z: 0, A: 0, B: 0, C: {turn}}}}}"
    )
    copy.change(CELL, "\ngateways:\n", f"\ngateways:\n{gateway}\n").change(CELL, "\nrobots:\n", f"\nrobots:\n{robot}\n")


@dataclass
class Apart:
    """What happens in such a cell, and how near its arms come to each other."""

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
        if len(self._measured) < len(self.world.cell.robots) or feedback.robot != SIDES[0]:
            return
        for (one, its), (other, others) in combinations(map(self._capsules, self._measured), 2):
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
        """Until all programs are done, or for so long; how long it took."""
        start = self.world.clock.now
        while self.world.clock.now < start + seconds and not self.done:
            self.world.clock.run_until(self.world.clock.now + STEP_S)
        return self.world.clock.now - start

    @property
    def done(self) -> bool:
        states = self.world.seen.robots
        return len(states) == len(self.world.cell.robots) and all(
            state.program.state is ProgramState.DONE for state in states.values()
        )
