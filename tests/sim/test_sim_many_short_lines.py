"""A CAM program through a shared zone on a bad network: halted, slowed, held in front of the zone, on its lines."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from cell.messages import DriveFeedback, Halt, Mode, ProgramState, RobotState, SetOverride
from tests.sim.invariants import Invariants
from tests.sim.operator import PatientOperator
from tests.sim.scenario import BAD
from tests.sim.world import World, load_bundle
from tests.unit.config_world import Copy

TOLERANCE_M, FEED_M_S, LINE_M = 5e-5, 0.3, 5e-4
WAY = np.arange(0.0, 0.55, LINE_M)
PLACES = np.stack([1.0 + WAY, 0.02 * np.sin(WAY / 0.04), 1.35 + 0.01 * (1.0 - np.cos(WAY / 0.06))], axis=1)
"""Vertices in the base frame of the left arm, the last ones inside the zone."""
START = "MJ J1=0 J2=-12 J3=65 J4=0 J5=37 J6=0 F=80\n"
LINES = "".join(f"ML X={x:.6f} Y={y:.6f} Z={z:.6f}\n" for x, y, z in 1000.0 * PLACES[1:])
LEFT = f"{START}ML X=1000 Y=0 Z=1350 A=0 B=90 C=0 F=300\nTOL 0.05\n{LINES}TOL 0\nML X=980 Y=0 Z=1350 F=900\nEND\n"
RIGHT = f"{START}ML X=1650 Y=0 Z=1350 A=0 B=90 C=0 F=900\nWAIT 20\nML X=980 F=900\nEND\n"
CYCLE_S, HEARD_S = 0.02, 0.4
FIRST, HALTED_AT, FAST_AT = 4, 240, 420
LAST = FIRST + len(PLACES) - 2


def away_from_lines(places: np.ndarray) -> np.ndarray:
    """How far places `(n, 3)` are from the programmed lines [m], each looked for among all of them."""
    begin, way = PLACES[:-1], np.diff(PLACES, axis=0)
    found = []
    for each in places:
        share = np.clip(((each - begin) * way).sum(axis=1) / (way**2).sum(axis=1), 0.0, 1.0)
        found.append(np.linalg.norm(each - begin - share[:, None] * way, axis=1).min())
    return np.array(found)


class Eye:
    """Commanded flange at each cycle while the left arm is on its lines, and why it rests."""

    def __init__(self, world: World) -> None:
        self._world = world
        self.places: list[np.ndarray] = []
        self.reasons: list[str] = []
        world.on_feedback.append(self._look)

    def _look(self, feedback: DriveFeedback) -> None:
        left = self._world.seen.robots.get("left")
        if feedback.robot == "left" and left is not None and FIRST < left.program.line < LAST:
            self.places.append(self._world.models["left"].forward(np.array(feedback.commanded))[:3, 3])
            halted = left.mode is Mode.HALTED
            self.reasons.append("halted" if halted else "waits" if left.waiting_for else "")

    def rests(self) -> list[set[str]]:
        """What the arm told around each of its rests, by states that come some times a second."""
        still = np.append(np.linalg.norm(np.diff(self.places, axis=0), axis=1) < 1e-9, False)
        borders = np.flatnonzero(np.diff(np.concatenate([[False], still, [False]]).astype(int))).reshape(-1, 2)
        near = round(HEARD_S / CYCLE_S)
        return [set(self.reasons[max(a - near, 0) : b + near]) for a, b in borders.tolist() if b - a > 1]


@pytest.mark.soak
def test_short_lines_are_kept_through_a_halt_an_override_losses_and_a_zone(tmp_path: Path) -> None:
    copy = Copy(tmp_path).slow_buses()
    for side, text in (("left", LEFT), ("right", RIGHT)):
        (copy.folder / f"two_arms/programs/{side}.prog").write_text(text)
    world = World(load_bundle(copy.folder / "two_arms/cell.yaml"), 4, BAD)
    Invariants(world)
    eye = Eye(world)
    PatientOperator(world)

    def left() -> RobotState:
        return world.seen.robots["left"]

    def until(line: int) -> None:
        assert world.clock.run_until(
            world.clock.now + 60.0, lambda: "left" in world.seen.robots and left().program.line >= line
        )

    def told(command: Halt | SetOverride, heard: Callable[[], bool]) -> None:
        """An order may be lost."""
        for _ in range(10):
            world.operate("robot/left", command)
            if world.clock.run_until(world.clock.now + 0.4, heard):
                return
        raise AssertionError(f"{command} is not heard")

    until(FIRST + 60)
    told(SetOverride(50.0), lambda: left().pace.override == 0.5)
    until(HALTED_AT)
    told(Halt(), lambda: left().mode is Mode.HALTED)
    until(FAST_AT)
    told(SetOverride(100.0), lambda: left().pace.override == 1.0)
    assert world.clock.run_until(world.clock.now + 60.0, lambda: left().program.state is ProgramState.DONE)
    places = np.array(eye.places)
    assert away_from_lines(places).max() < TOLERANCE_M
    rests = eye.rests()
    assert all(each & {"halted", "waits"} for each in rests), rests
    assert any("halted" in each for each in rests)
    assert any("waits" in each for each in rests)
    assert len(rests) <= 2
    steps = np.linalg.norm(np.diff(places, axis=0), axis=1) / CYCLE_S
    assert steps.max() < 1.01 * FEED_M_S
    assert (steps > 0.98 * FEED_M_S).sum() > 10
