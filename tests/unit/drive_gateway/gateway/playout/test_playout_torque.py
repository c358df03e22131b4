"""Playout of torques: with their samples, then what carries the robot at rest, and never more than a drive takes."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from cell.messages import SetpointBlock
from drive_gateway.cia402.units import AxisUnits
from drive_gateway.config.settings import TorqueSettings
from drive_gateway.gateway.playout.joining import JoinRule, RefusedBlock
from drive_gateway.gateway.playout.playout import Accepted, Ignored, Playout
from tests.unit.gateway_world import CYCLE_S, axis, block, s_motion

RATED = TorqueSettings(rated_mnm=2000, per_mille=-1000 / (50 * 2.0), rpm=50 * 30 / np.pi)
"""2 Nm behind a gear of 50, turning the other way round: per mille of 100 Nm."""
AXES = (axis("J1", 1, torque=RATED, torque_offset=True), axis("J2", 2))
START = np.array([0.1, -0.2])
CARRYING = np.array([30.0, -4.0])


def live() -> Playout:
    playout = Playout(AXES, CYCLE_S, START, tick=100)
    playout.own(7)
    playout.go_live()
    return playout


def move(first_tick: int = 101, sequence: int = 1) -> SetpointBlock:
    """Its torques tell the samples apart."""
    position, velocity = s_motion(0.4, 0.2)
    torque = CARRYING + np.arange(len(position))[::-1, None] * [1.0, 0.5]
    return replace(block(7, sequence, first_tick, START + position, velocity), torque=torque)


def torques(playout: Playout, cycles: int) -> np.ndarray:
    played = []
    for _ in range(cycles):
        playout.advance()
        played.append(playout.torque)
    return np.array(played)


def sign_of_life(owner: int = 7, torque: np.ndarray = CARRYING) -> SetpointBlock:
    still = np.tile(START, (3, 1))
    return replace(block(owner, 1, 101, still, np.zeros((3, 2))), torque=np.tile(torque, (3, 1)))


def test_torques_are_played_with_their_samples_and_the_last_one_is_kept() -> None:
    playout, offered = live(), move(103)
    assert playout.offer(offered) == Accepted(1)
    assert offered.torque is not None
    played = torques(playout, 2 + len(offered.torque) + 50)
    np.testing.assert_array_equal(played[2 : 2 + len(offered.torque)], offered.torque)
    np.testing.assert_array_equal(played[-1], CARRYING)


def test_before_the_drives_are_on_the_owners_sign_of_life_says_what_will_carry_the_robot() -> None:
    playout = Playout(AXES, CYCLE_S, START, tick=100)
    playout.own(7)
    assert playout.offer(sign_of_life()) == Ignored()
    playout.follow(START)
    np.testing.assert_array_equal(torques(playout, 1)[0], CARRYING)
    playout.go_live()
    np.testing.assert_array_equal(torques(playout, 1)[0], CARRYING)


@pytest.mark.parametrize(
    "stranger", [sign_of_life(owner=6), sign_of_life(torque=np.full(2, np.nan)), sign_of_life(torque=np.full(2, 1e9))]
)
def test_a_stranger_or_an_impossible_torque_carries_nothing(stranger: SetpointBlock) -> None:
    playout = Playout(AXES, CYCLE_S, START, tick=100)
    playout.own(7)
    playout.offer(stranger)
    playout.follow(START)
    assert not torques(playout, 1).any()


@pytest.mark.parametrize("stop", [Playout.stop, Playout.fail])
def test_after_a_stop_of_the_drives_own_the_robot_is_still_carried(stop: Callable[[Playout], None]) -> None:
    playout = live()
    playout.offer(move())
    torques(playout, 30)
    stop(playout)
    np.testing.assert_array_equal(torques(playout, 3), np.tile(CARRYING, (3, 1)))


def test_a_block_without_torques_leaves_all_to_the_drives() -> None:
    playout = live()
    playout.offer(replace(move(), torque=None))
    assert not torques(playout, 20).any()


@pytest.mark.parametrize(
    ("torque", "reason", "text"),
    [
        (np.zeros((3, 2)), JoinRule.SHAPE, "torque (3, 2)"),
        (np.array([3300.0, 0.0]), JoinRule.TORQUE, "axis J1 has a torque beyond 3277 Nm or N"),
        (np.array([np.nan, 0.0]), JoinRule.TORQUE, "axis J1 has a torque beyond 3277 Nm or N"),
        (np.array([0.0, np.inf]), JoinRule.TORQUE, "axis J2 has a torque beyond"),
    ],
)
def test_a_torque_that_no_drive_can_be_told_is_refused(torque: np.ndarray, reason: JoinRule, text: str) -> None:
    offered = move()
    whole = torque if torque.ndim == 2 else np.tile(torque, (len(offered.position), 1))
    outcome = live().offer(replace(offered, torque=whole))
    assert isinstance(outcome, RefusedBlock)
    assert outcome.reason is reason
    assert text in outcome.text


def test_a_torque_becomes_per_mille_of_the_rated_one_and_nothing_where_that_is_not_known() -> None:
    assert AxisUnits(AXES).per_mille(np.array([25.04, 1e300])) == [-250, 0]
