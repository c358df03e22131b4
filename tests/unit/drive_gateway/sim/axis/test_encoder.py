"""The encoder: whole counts, what it knows after power-on, turns that wrap, noise, a jump."""

from math import degrees, pi, radians
from statistics import stdev
from typing import Any

import pytest

from drive_gateway.cia402.units import AxisUnits
from drive_gateway.sim.axis.encoder import Encoder, EncoderData
from tests.unit.gateway_world import axis
from tests.unit.repository import vectors

VECTORS = vectors("encoders.json")
TURN = 2 * pi


def joint(counts_per_turn: int, gear: float) -> AxisUnits:
    return AxisUnits([axis("J1", 1, counts_per_unit=counts_per_turn * gear / TURN, offset=0.0)])


@pytest.mark.parametrize("vector", VECTORS["steps"], ids=lambda vector: vector["id"])
def test_a_count_is_the_worked_part_of_a_turn(vector: dict[str, Any]) -> None:
    counts, gear = vector["counts_per_turn"], vector["gear"]
    assert degrees(joint(counts, gear).position([1])[0]) == pytest.approx(vector["step"], rel=1e-8)
    encoder = Encoder(EncoderData(counts), 0.0, 1)
    assert [encoder.read(gear * radians(part * vector["step"])) for part in (0.49, 0.51, 1.49)] == [0, 1, 1]


@pytest.mark.parametrize("vector", VECTORS["readings"], ids=lambda vector: vector["id"])
def test_turns_and_place_in_the_turn_are_the_worked_angles(vector: dict[str, Any]) -> None:
    counts, gear = VECTORS["absolute"]["counts_per_turn"], VECTORS["absolute"]["gear"]
    reading = counts * vector["turns"] + vector["single_turn"]
    assert Encoder(EncoderData(counts), 0.0, 1).read(radians(vector["motor"])) == reading
    assert degrees(joint(counts, gear).position([reading])[0]) == pytest.approx(vector["joint"], rel=1e-10)


def test_turns_wrap_after_the_worked_way_of_the_joint() -> None:
    worked = VECTORS["absolute"]
    shaft = worked["wraps_after_joint_turns"] * worked["gear"] * TURN
    assert Encoder(EncoderData(worked["counts_per_turn"]), shaft, 1).read(shaft) == 0


def test_a_joint_turns_by_the_worked_part_of_its_motor() -> None:
    worked = VECTORS["gear"]
    counts = [round(worked["motor_rad"] / TURN * 131072)]
    assert joint(131072, worked["ratio"]).position(counts)[0] == pytest.approx(worked["joint_rad"], rel=1e-6)


def test_counts_are_whole_and_nearest() -> None:
    encoder = Encoder(EncoderData(1000), 0.0, 1)
    assert [encoder.read(TURN * part / 1000) for part in (0.0, 0.4, 0.6, -0.6, 250.0)] == [0, 0, 1, -1, 250]


def test_absolute_encoder_knows_its_turns_without_power() -> None:
    assert Encoder(EncoderData(131072), 17.25 * TURN, 1).read(17.25 * TURN) == 17 * 131072 + 32768


def test_absolute_encoder_wraps_its_turns_when_it_is_switched_on() -> None:
    encoder = Encoder(EncoderData(1000, turns=8), 0.0, 1)
    assert encoder.read(4.5 * TURN) == 4500
    encoder.switch_on(4.5 * TURN)
    assert encoder.read(4.5 * TURN) == -3500


def test_noise_has_its_deviation_and_repeats_with_its_seed() -> None:
    readings = [Encoder(EncoderData(131072, noise_counts=8.0), 0.0, 7)] * 2000
    noise = [encoder.read(0.0) for encoder in readings]
    assert 7.5 < stdev(noise) < 8.5
    again = Encoder(EncoderData(131072, noise_counts=8.0), 0.0, 7)
    assert [again.read(0.0) for _ in range(2000)] == noise


def test_jump_stays() -> None:
    encoder = Encoder(EncoderData(1000), 0.0, 1)
    encoder.jump(37)
    assert encoder.read(TURN) == 1037
