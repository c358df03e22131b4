"""The cell of the tutorial from its start to its end: two parts go from the tray over the stand into their nests."""

from dataclasses import dataclass

import numpy as np
import pytest
from numpy.typing import NDArray

from cell.messages import DriveFeedback, ProgramState
from tests.sim.network import Weather
from tests.sim.operator import PatientOperator
from tests.sim.world import World, load_bundle
from tests.unit.config_world import CONFIGS
from tests.unit.turned_arm import tcp

CELL = CONFIGS / "pick_and_place" / "cell.yaml"
GRIPPER_M = 0.25
VALVE, SENSOR = 16, 18
JAWS_S = 0.15
"""So long after its valve a gripper has closed or opened; the programs wait for 0.2 s."""
NEAR_M = 1e-4
"""Of what the drives measure then from where the program says."""
TRAY, STAND = (-1.2, -1.4, 0.66), (0.0, 0.0, 0.96)
NESTS = ((1.3, -1.35, 0.66), (1.3, -1.5, 0.66))
"""In the world, as cell file, points and bases have them: 60 mm above tray and stand."""
NEXT_PART_S = 1.0


@dataclass
class Part:
    place: NDArray[np.float64]
    held_by: str = ""


class Parts:
    """Grippers that close take the part that lies between their jaws, and let it lie where they open."""

    def __init__(self, world: World, number: int) -> None:
        self._world = world
        self._coming = number
        self._closed = {"left": False, "right": False}
        self._at: dict[str, NDArray[np.float64]] = {}
        self.parts: list[Part] = []
        self.came: list[tuple[str, str, NDArray[np.float64]]] = []
        """Who took and laid what, where, in that order."""
        self._put()
        world.on_feedback.append(self._look)

    def _put(self) -> None:
        """The next part lies in the tray."""
        if self._coming > 0:
            self._coming -= 1
            self.parts.append(Part(np.array(TRAY)))
            self._sensor(True)

    def _sensor(self, on: bool) -> None:
        self._world.buses["gateway/left_bus"].nodes[6].set_input(SENSOR, on)

    def _look(self, feedback: DriveFeedback) -> None:
        robot = feedback.robot
        at = tcp(feedback.position[None], GRIPPER_M)[0]
        self._at[robot] = at - (1.5, 0.0, 0.0) if robot == "left" else at * (-1.0, -1.0, 1.0) + (1.5, 0.0, 0.0)
        on = bool(self._world.buses[f"gateway/{robot}_bus"].nodes[6].outputs[0].on & 1 << VALVE)
        if on is not self._closed[robot]:
            self._closed[robot] = on
            self._world.clock.after(JAWS_S, self._takes if on else self._lays, robot)
        for part in self.parts:
            if part.held_by == robot:
                part.place = self._at[robot]

    def _takes(self, robot: str) -> None:
        at = self._at[robot]
        (taken,) = (part for part in self.parts if np.linalg.norm(part.place - at) < NEAR_M)
        assert not taken.held_by, f"{robot} takes what {taken.held_by} holds"
        taken.held_by = robot
        self.came.append((robot, "takes", at))
        if robot == "left":
            self._sensor(False)
            self._world.clock.after(NEXT_PART_S, self._put)

    def _lays(self, robot: str) -> None:
        (laid,) = (part for part in self.parts if part.held_by == robot)
        laid.held_by = ""
        self.came.append((robot, "lays", laid.place))


@pytest.mark.soak
def test_two_parts_go_from_the_tray_over_the_stand_into_their_nests() -> None:
    world = World(load_bundle(CELL), 4, Weather(loss=0.0, double=0.0, late=0.0))
    parts, operator = Parts(world, 2), PatientOperator(world)
    done = world.clock.run_until(world.clock.now + 120.0, lambda: operator.all_done)
    assert done, {robot: (state.mode, state.waiting_for) for robot, state in world.seen.robots.items()}
    assert {state.program.state for state in world.seen.robots.values()} == {ProgramState.DONE}
    moved = [(robot, what) for robot, what, _ in parts.came]
    assert moved == 2 * [("left", "takes"), ("left", "lays"), ("right", "takes"), ("right", "lays")]
    first, second = [TRAY, STAND, STAND, NESTS[0]], [TRAY, STAND, STAND, NESTS[1]]
    np.testing.assert_allclose([place for _, _, place in parts.came], first + second, atol=NEAR_M)
    np.testing.assert_allclose([part.place for part in parts.parts], NESTS, atol=NEAR_M)
