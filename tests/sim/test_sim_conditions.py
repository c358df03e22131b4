"""Programs that ask and count do what their text says (`tests.sim.condition_checker`), however they are halted."""

import pytest

from tests.sim.condition_checker import broken


@pytest.mark.parametrize("seed", range(5))
def test_a_program_does_what_its_text_says(seed: int) -> None:
    assert broken(seed)[0] == ""


@pytest.mark.soak
def test_so_do_four_hundred() -> None:
    assert [seed for seed in range(400) if broken(seed)[0]] == []
