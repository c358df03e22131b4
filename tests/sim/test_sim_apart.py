"""Two arms share room without a zone: they never touch, and come to the end of what they can do."""

import random
import re
from pathlib import Path

import numpy as np
import pytest

from cell.messages import (
    GovernorStatus,
    Halt,
    Heard,
    Jog,
    JogFrame,
    JogHeld,
    Mode,
    RobotState,
    SetOverride,
)
from tests.sim.apart_cell import MARGIN_M, SIDES, Apart, apart_cell
from tests.sim.network import Weather
from tests.sim.random_rooms import LONGEST_S, rooms
from tests.unit.config_world import TWO_ARMS

TO_THE_MIDDLE = """MJ J1={turn:g} J2=-12 J3=65 J4=0 J5=37 J6=0 F=100
ML X={x:g} Y={y:g} Z={z:g} A=0 B=90 C=0 F=1500
WAIT 0.2
ML X=980 F=1500
HOME F=100
"""


def _towards(x: float, y: float, z: float, turn: float = 0.0) -> str:
    return TO_THE_MIDDLE.format(x=x, y=y, z=z, turn=turn)


def _to_the_middle_and_stay(x: float) -> str:
    return "\n".join(_towards(x, 0, 1250).splitlines()[:2]) + "\n"


HEAD_ON = {"left": _towards(2000, 0, 1250), "right": _towards(2000, 0, 1250)}
PROGRAMS = {side: (TWO_ARMS.parent / "programs" / f"{side}.prog").read_text() for side in ("left", "right")}


def _at_each_other(rng: random.Random) -> dict[str, str]:
    """Both come at full speed from some direction to one place of the room, both at the same time."""
    x, y, z = rng.uniform(-100, 100), rng.uniform(-300, 300), rng.uniform(1000, 1450)
    places = {"left": (1900 + x, y), "right": (1900 - x, -y)}
    return {side: _towards(*place, z, turn=rng.uniform(-25, 25)) for side, place in places.items()}


def _collides(cell: Apart) -> bool:
    until = cell.world.clock.now + 5.0
    return cell.world.clock.run_until(until, lambda: cell.nearest_m < 0.0)


def _never_meet(seeds: range, folder: Path) -> None:
    for seed in seeds:
        rng = random.Random(seed)
        for draw in range(20):
            programs = _at_each_other(rng)
            try:
                free = Apart(apart_cell(folder / f"free {seed} {draw}", programs, None))
            except AssertionError:
                continue  # `cell check` found something that one of them cannot do
            if _collides(free):
                break
        else:
            raise AssertionError(f"seed {seed}: in 20 draws no two that collide")
        kept = Apart(apart_cell(folder / f"kept {seed}", programs))
        kept.run(30.0)
        assert kept.done, (seed, kept.refused)
        assert kept.nearest_m >= MARGIN_M, seed
        assert kept.forced == [], seed


def test_arms_that_would_collide_go_one_after_the_other(tmp_path: Path) -> None:
    _never_meet(range(1), tmp_path)


@pytest.mark.soak
def test_arms_that_are_driven_at_each_other_from_any_direction_never_meet(tmp_path: Path) -> None:
    _never_meet(range(1, 201), tmp_path)


def test_arms_that_want_to_end_at_one_place_stop_in_front_of_each_other_and_say_so(tmp_path: Path) -> None:
    cell = Apart(apart_cell(tmp_path, {side: _to_the_middle_and_stay(2000) for side in SIDES}))
    cell.run(8.0)
    assert MARGIN_M <= cell.nearest_m < 0.12
    waits = cell.world.seen.robots["left"].waiting_for
    assert waits.startswith("left's link")
    assert "of where right's link" in waits
    (event,) = [each for each in cell.world.seen.events if each.code == "space_standoff"]
    assert event.text.startswith("left and right wait for each other: left's link")
    assert re.search(r"the TCP of left is at X -\d+, Y 0, Z \d+ mm; the TCP of right is at X -\d+, Y 0", event.text)
    assert "no way back frees them" in event.remedy, "both want to stay there: no way back frees them"


_START = "MJ J1=0 J2=-12 J3=65 J4=0 J5=37 J6=0 F=100\n"
_LEADS = f"{_START}ML X=2100 Y=0 Z=1250 A=0 B=90 C=0 F=1500\nWAIT 1.5\nML X=1100 F={{speed}}\nHOME F=100\n"
_FOLLOWS = f"{_START}WAIT 0.5\nML X=2000 Y=0 Z=1250 A=0 B=90 C=0 F=1500\nML X=1000 F=1500\nHOME F=100\n"


@pytest.mark.parametrize("speed", [300, 150])
def test_who_follows_another_one_goes_on_at_its_pace(tmp_path: Path, speed: int) -> None:
    cell = Apart(apart_cell(tmp_path, {"left": _LEADS.format(speed=speed), "right": _FOLLOWS}))
    rates = [0.0]

    def look(_name: str, message: object) -> None:
        match message:
            case RobotState(robot="right", governor=GovernorStatus() as governor, program=program):
                if program.line == 3 and (len(rates) > 1 or "left's link" in governor.ruled_by):
                    rates.append(governor.rate)

    cell.world.on_published.append(look)
    cell.run(20.0)
    assert cell.done
    assert cell.nearest_m >= MARGIN_M
    # The first second brings it near, in the last one the other one has gone.
    followed = np.array(rates[50:-50])
    assert len(followed) > 50
    assert followed.mean() == pytest.approx(speed / 1500, abs=0.02)
    assert np.abs(followed - followed.mean()).max() < 0.05


@pytest.mark.soak
def test_with_lost_and_late_messages_programs_come_to_their_end(tmp_path: Path) -> None:
    cell = Apart(apart_cell(tmp_path, PROGRAMS), weather=Weather(loss=0.05))
    cell.run(40.0)
    assert cell.done
    assert cell.nearest_m > MARGIN_M


def test_a_killed_manager_and_a_killed_agent_cost_time_and_nothing_else(tmp_path: Path) -> None:
    cell = Apart(apart_cell(tmp_path, PROGRAMS))
    cell.run(3.0)
    cell.world.kill("manager")
    cell.run(1.0)
    assert {state.waiting_for for state in cell.world.seen.robots.values()} == {"the manager is silent"}
    cell.world.start_manager()
    cell.run(2.0)
    cell.world.kill("robot/left")
    cell.run(1.0)
    cell.world.start_agent("left")
    cell.run(40.0)
    assert cell.done
    assert cell.nearest_m > MARGIN_M


def test_a_robot_goes_back_at_half_of_the_planned_speed_at_most_whatever_the_override(tmp_path: Path) -> None:
    cell, rates = Apart(apart_cell(tmp_path, HEAD_ON)), list[tuple[float, str]]()
    world, clock = cell.world, cell.world.clock

    def under_way() -> bool:
        state = world.seen.robots.get("left")
        governor = None if state is None else state.governor
        return governor is not None and governor.rate > 0.99 and governor.tau_s > 0.4

    assert clock.run_until(clock.now + 10.0, under_way)
    world.operate("robot/left", SetOverride(-100.0))

    def goes_back() -> bool:
        governor = world.seen.robots["left"].governor
        assert governor is not None
        rates.append((governor.rate, governor.ruled_by))
        return len(rates) > 3 and governor.rate == 0.0 and min(rates)[0] < 0.0

    assert clock.run_until(clock.now + 10.0, goes_back)
    assert min(rates)[0] == pytest.approx(-0.5, abs=0.01)
    assert (min(rates)[0], "robots are kept apart") in rates
    assert cell.forced == []


def _jog(cell: Apart, speed_m_s: float, seconds: float) -> float:
    """How far the left arm's tool goes along X of its base [m] while its key is held."""
    world, press = cell.world, f"press at {cell.world.clock.now:g}"
    start, until = world.seen.robots["left"].tcp_position_m, world.clock.now + seconds
    world.operate("robot/left", Jog(press, "X", speed_m_s, JogFrame.BASE))
    while world.clock.now < until:
        state = world.seen.robots["left"]
        world.press(JogHeld("left", press, True, Heard(state.boot, state.sequence)))
        world.clock.run_until(world.clock.now + 0.03)
    world.clock.run_until(world.clock.now + 1.0)
    end = world.seen.robots["left"].tcp_position_m
    assert start is not None
    assert end is not None
    return end[0] - start[0]


def test_a_jog_stands_in_front_of_the_other_arm_and_leads_away_from_it(tmp_path: Path) -> None:
    cell = Apart(apart_cell(tmp_path, {side: _to_the_middle_and_stay(2000) for side in ("left", "right")}))
    cell.run(6.0)
    cell.operator.working = False
    for robot in ("left", "right"):
        cell.world.operate(f"robot/{robot}", Halt())
    cell.world.clock.run_until(cell.world.clock.now + 1.0)
    assert abs(_jog(cell, 0.2, 1.5)) < 0.1
    assert _jog(cell, -0.2, 1.5) < -0.15
    assert _jog(cell, 0.2, 3.0) > 0.1
    assert cell.nearest_m >= MARGIN_M
    assert cell.forced == []
    assert cell.world.seen.robots["left"].mode is not Mode.FAULT


def _all_complete(seeds: range, folder: Path, arms: int = 2) -> None:
    for seed, _, cell in rooms(seeds, folder, arms):
        cell.run(arms * LONGEST_S / 2)
        waits = {name: state.waiting_for for name, state in cell.world.seen.robots.items()}
        assert cell.done, (seed, waits, [each.text for each in cell.world.seen.events if each.code == "space_standoff"])
        assert cell.nearest_m >= MARGIN_M, seed
        assert cell.forced == [], seed


@pytest.mark.soak
@pytest.mark.parametrize(("arms", "count"), [(2, 200), (3, 60), (4, 30)])
def test_random_programs_that_can_be_done_one_after_another_are_done_together(
    tmp_path: Path, arms: int, count: int
) -> None:
    _all_complete(range(2, 2 + count), tmp_path, arms)
