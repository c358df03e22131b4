"""`cell simulate`: from an operator's words to what a sensor and an encoder say."""

import math

import pytest

from cell.commands.errors import CommandError
from cell.commands.operator.simulate import belt_counts, sensor_offset


def test_offsets_are_in_millimetres_and_turns_in_degrees() -> None:
    assert sensor_offset(["Z=5", "C=-90"]) == pytest.approx((0.0, 0.0, 0.005, 0.0, 0.0, -math.pi / 2))


@pytest.mark.parametrize("word", ["Z", "Q=1", "Z=much", "Z=nan", "z=1"])
def test_other_words_are_refused_with_an_example(word: str) -> None:
    with pytest.raises(CommandError, match="allowed is AXIS=VALUE with one of X, Y, Z, A, B, C, as in Z=5"):
        sensor_offset([word])


def test_a_belt_that_runs_backwards_counts_down_through_the_counters_end() -> None:
    assert [belt_counts(way_m, 10_000.0, None) for way_m in (0.0, -0.0005)] == [(0, None), (2**32 - 5, None)]


@pytest.mark.parametrize(
    ("way_m", "found"), [(0.05, (500, None)), (0.25, (2500, 2000)), (-0.15, (2**32 - 1500, 2**32 - 1000))]
)
def test_parts_pass_at_equal_distances(way_m: float, found: tuple[int, int | None]) -> None:
    assert belt_counts(way_m, 10_000.0, 100.0) == found
