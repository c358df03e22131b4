"""The encoder: whole counts, what it knows after power-on, turns that wrap, noise, a jump."""

from math import pi
from statistics import stdev

from drive_gateway.sim.axis.encoder import Encoder, EncoderData

TURN = 2 * pi


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
