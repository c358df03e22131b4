"""Jogs and corrections at full speed towards a border: never beyond its margin, and they stand close in front of it."""

import pytest

from tests.unit.robot_agent.workspace.border_runs import correction, jog, judge


@pytest.mark.parametrize("seed", range(3))
def test_a_jog_at_full_speed_stands_close_in_front_of_a_border(seed: int) -> None:
    judge(jog(seed))


@pytest.mark.parametrize("seed", [4, 9])
def test_a_correction_at_full_speed_stands_close_in_front_of_a_border(seed: int) -> None:
    assert judge(correction(seed))


@pytest.mark.soak
@pytest.mark.timeout(900)
def test_soak_a_hundred_jogs_and_corrections_keep_their_margin() -> None:
    assert sum(judge(jog(seed)) for seed in range(100, 200)) > 60
    assert sum(judge(correction(seed)) for seed in range(100, 200)) > 30
