"""The first motion of an axis: from one unit of its drive upwards, judged at each step."""

import math

import pytest

from drive_gateway.config.drive_units import drive_units
from drive_gateway.gateway.setup.first_motion import FARTHEST, FirstMotion
from tests.unit.gateway_world import axis

CYCLE_S = 0.004
PER_TURN = 4096
REACTION_S = 0.03
"""From what a drive is told to a measurement of what it did, and back."""


def run(
    unit: str, truth: float, direction: int = 1, back: bool = False, linear: bool = False, scale: float = 200_000.0
) -> tuple[str, float, int]:
    """One unit of the drive is `truth` counts/s; answers the problem, the farthest way [rad or m], the most told."""
    units = drive_units(unit, "counts/s^2", PER_TURN, 200_000.0 if linear else 0.0)
    settings = axis("J1", 1, units=units, linear=linear, counts_per_unit=scale)
    motion = FirstMotion(settings, direction, 500, 0.0, back)
    told, place, far, most = [0] * round(REACTION_S / CYCLE_S), 500.0, 0.0, 0
    for cycle in range(2000):
        told.append(motion.step(round(place), cycle * CYCLE_S))
        most = max(most, abs(told[-1]))
        if motion.problem or motion.done:
            break
        place += told[-round(REACTION_S / CYCLE_S)] * truth * CYCLE_S
        far = max(far, abs(place - 500.0))
    assert motion.problem or motion.done
    assert told[-1] == 0
    return motion.problem, far / scale, most


@pytest.mark.parametrize("direction", [1, -1])
@pytest.mark.parametrize("back", [True, False])
@pytest.mark.parametrize("unit", ["counts/s", "rpm", "0.001 rpm", "deg/s"])
def test_a_drive_that_means_what_the_file_says_passes_within_a_degree(unit: str, back: bool, direction: int) -> None:
    truth = drive_units(unit, "counts/s^2", PER_TURN, 0.0).velocity
    problem, far, _ = run(unit, truth, direction, back)
    assert problem == ""
    assert far < math.radians(1.0)


def test_a_slide_passes_within_three_millimetres() -> None:
    problem, far, _ = run("mm/s", 200.0, linear=True)
    assert problem == ""
    assert far <= FARTHEST[True]


@pytest.mark.parametrize(
    ("unit", "truth", "what"),
    [
        ("counts/s", PER_TURN / 60.0, "faster"),
        ("counts/s", PER_TURN / 360.0, "faster"),
        ("0.001 rpm", PER_TURN / 60.0, "faster"),
        ("rpm", 1.0, "slower"),
        ("rpm", PER_TURN / 600.0, "slower"),
    ],
)
def test_a_drive_that_means_another_unit_is_stopped_within_a_degree(unit: str, truth: float, what: str) -> None:
    problem, far, most = run(unit, truth)
    assert problem.startswith(f"moves {what} than it was told: at ")
    assert "correct velocity_unit" in problem
    assert far < math.radians(1.0)
    assert most * truth < 2.0 * PER_TURN


def by_sdo(unit: str, truth: float, answers_s: float, at_once: bool, back: bool) -> tuple[str, float]:
    """As `run`, with a drive that takes each velocity `at_once` or when it answers; it halts until it is to go back."""
    motion = FirstMotion(axis("J1", 1, units=drive_units(unit, "counts/s^2", PER_TURN, 0.0)), 1, 500, 0.0, back)
    told = taken = 0
    answer_at, place, far = 0.0, 500.0, 0.0
    for cycle in range(8000):
        now = cycle * CYCLE_S
        if now < answer_at:
            motion.unconfirmed(now)
        else:
            taken = told
        newest = motion.step(round(place), now)
        if motion.problem or motion.done:
            return motion.problem, far / 200_000.0
        if newest != told:
            told, answer_at = newest, now + answers_s
            taken = told if at_once else taken
        halted = motion.turning and now < answer_at
        place += 0.0 if halted else taken * truth * CYCLE_S
        far = max(far, abs(place - 500.0))
    raise AssertionError("it has no end")


@pytest.mark.parametrize("at_once", [True, False])
@pytest.mark.parametrize("answers_s", [0.1, 0.5, 1.0])
@pytest.mark.parametrize("back", [True, False])
def test_a_drive_that_answers_late_is_judged_as_well(back: bool, answers_s: float, at_once: bool) -> None:
    unit = "0.001 rpm"
    truth = drive_units(unit, "counts/s^2", PER_TURN, 0.0).velocity
    assert by_sdo(unit, truth, answers_s, at_once, back)[0] == ""
    for wrong, what in ((1000.0, "faster"), (60.0, "faster"), (0.1, "slower")):
        problem, far = by_sdo(unit, wrong * truth, answers_s, at_once, back)
        assert problem.startswith(f"moves {what} than it was told")
        assert far < math.radians(1.0)


@pytest.mark.parametrize("wrong", [0.5, 2.0])
def test_a_wrong_number_of_counts_per_turn_shows_where_the_unit_counts_turns(wrong: float) -> None:
    problem, far, _ = run("0.01 rpm", wrong * PER_TURN / 6000.0)
    assert "counts_per_turn" in problem
    assert far < math.radians(1.0)


def test_an_axis_that_turns_the_other_way_round_is_named() -> None:
    problem, far, _ = run("counts/s", -1.0)
    assert "moves against the direction that it was told" in problem
    assert far < math.radians(0.2)


def test_an_axis_that_does_not_move_is_named() -> None:
    problem, _, _ = run("counts/s", 0.0)
    assert "moves slower than it was told" in problem


@pytest.mark.parametrize(("truth", "gear"), [(PER_TURN / 60.0, 1), (PER_TURN / 360.0, 1), (PER_TURN, 20)])
def test_units_of_rpm_without_a_gear_and_of_turns_in_a_second_behind_one_are_found_within_a_degree(
    truth: float, gear: int
) -> None:
    problem, far, _ = run("counts/s", truth, scale=gear * PER_TURN / (2.0 * math.pi))
    assert problem.startswith("moves faster")
    assert far < math.radians(1.0)
