"""Two robots meet again and again, whatever is lost, late or halted: nobody leaves alone, nobody is left behind."""

from pathlib import Path

import numpy as np
import pytest

from cell.messages import Continue, DriveFeedback, Event, Halt, Mode, ProgramState, RobotState, SetOverride
from tests.sim.operator import PatientOperator
from tests.sim.scenario import BAD
from tests.sim.world import World, load_bundle
from tests.unit.config_world import CELL, Copy

ROBOTS = ("left", "right")
ROUNDS = 100
CYCLE_S = 0.02
FROM_OUTSIDE = ("cleared space", "has not been heard", "the manager is silent")
"""What a robot says that may leave and has no room yet, because messages were lost."""


def program(robot: str, rounds: int) -> str:
    """Each round takes a time of its own, then the robots leave the meeting by a motion."""
    way = 3 if robot == "left" else 5
    body = f"MJ J1={way} F=60\nWAIT 0.1\nMJ J1=0 F=60\nMEET load"
    return f"MJ J1=1 F=60\nLABEL again\n{body}\nGOTO again {rounds - 1}\nMJ J1=2 F=60\nEND"


class Departures:
    """When each robot leaves each meeting: its first motion after the line of the MEET."""

    def __init__(self, world: World) -> None:
        self._world = world
        self._last: dict[str, np.ndarray] = {}
        self._at: set[str] = set()
        self.of: dict[str, list[float]] = {robot: [] for robot in ROBOTS}
        self._why: list[float] = []
        """When a robot said that it leaves late, or runs and does not move for want of room or of the manager."""
        world.on_feedback.append(self._look)
        world.on_published.append(self._hear)

    def said_between(self, first: float, last: float) -> bool:
        """Whether a robot told why it leaves later than the other."""
        return any(first - 0.1 < moment <= last for moment in self._why)

    def _hear(self, _process: str, message: object) -> None:
        match message:
            case Event(code="late_for_meeting"):
                self._why.append(self._world.clock.now)
            case RobotState(mode=Mode.RUNNING, waiting_for=why) if any(each in why for each in FROM_OUTSIDE):
                self._why.append(self._world.clock.now)

    def _look(self, feedback: DriveFeedback) -> None:
        robot, state = feedback.robot, self._world.seen.robots.get(feedback.robot)
        moved = robot in self._last and not np.array_equal(feedback.commanded, self._last[robot])
        self._last[robot] = feedback.commanded
        if moved and robot in self._at:
            self._at.discard(robot)
            self.of[robot].append(self._world.clock.now)
        elif not moved and state is not None and state.program.text == "MEET load":
            self._at.add(robot)


class Delays:
    """Halts a robot, or slows it down, at random moments; the patient operator lets it go on."""

    def __init__(self, world: World, operator: PatientOperator) -> None:
        self._world, self._operator = world, operator
        self.halts = 0
        world.clock.after(2.0, self._strike)

    def _strike(self) -> None:
        rng, world = self._world.rng, self._world
        to = f"robot/{rng.choice(ROBOTS)}"
        kind = rng.random()
        if kind < 0.4:
            self.halts += 1
            world.operate(to, Halt())
            world.clock.after(rng.uniform(0.1, 1.0), lambda: world.operate(to, Continue()))
        elif kind < 0.7:
            world.operate(to, SetOverride(rng.choice([30.0, 60.0, 100.0])))
        elif kind < 0.9:
            world.network.burst(0.4, rng.uniform(0.1, 0.5))
        else:
            world.network.delay("*", "*", rng.uniform(0.05, 0.2), rng.uniform(0.2, 0.6))
        world.clock.after(rng.expovariate(0.5), self._strike)


def meets(folder: Path, rounds: int, seed: int) -> tuple[Departures, Delays, World]:
    copy = Copy(folder).slow_buses()
    copy.change(CELL, "times: {", "meetings: {load: [left, right]}\ntimes: {")
    for robot in ROBOTS:
        (copy.folder / f"two_arms/programs/{robot}.prog").write_text(program(robot, rounds))
    world = World(load_bundle(copy.cell), seed, BAD)
    departures, operator = Departures(world), PatientOperator(world)
    delays = Delays(world, operator)
    done = world.clock.run_until(world.clock.now + 12.0 * rounds + 60.0, lambda: operator.all_done)
    assert done, {robot: (state.mode, state.waiting_for) for robot, state in world.seen.robots.items()}
    assert {state.program.state for state in world.seen.robots.values()} == {ProgramState.DONE}
    assert all(state.mode is Mode.READY for state in world.seen.robots.values())
    return departures, delays, world


@pytest.mark.soak
def test_a_hundred_meetings(tmp_path: Path) -> None:
    departures, delays, _ = meets(tmp_path, ROUNDS, 11)
    assert [len(times) for times in departures.of.values()] == [ROUNDS, ROUNDS]
    rounds = np.array(list(departures.of.values())).T
    # One bus cycle, and as far as the clocks of the two computers agree.
    apart = [moments for moments in rounds if np.ptp(moments) > CYCLE_S + 0.005]
    unsaid = [moments for moments in apart if not departures.said_between(*sorted(moments))]
    print(f"{delays.halts} halts, {len(apart)} rounds apart: {[round(float(np.ptp(each)), 3) for each in apart]}")
    assert delays.halts > 20
    assert unsaid == []
    assert len(apart) < ROUNDS / 10
