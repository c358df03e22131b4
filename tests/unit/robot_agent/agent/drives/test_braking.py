"""A robot that brakes off its path keeps its zones, and says where it may still come to and how long that takes."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cell.geometry import body_touches
from cell.messages import Disable, Mode, Presence
from robot_agent.workspace import BRAKING_RESERVE, Braking
from tests.unit.agent_runs import INTO_ZONE, enabled, running, until
from tests.unit.agent_world import CYCLE_S, STEP_S, ZONE, AgentWorld
from tests.unit.body_cover import covers

BOX = ZONE.solid()
MOVES = "MJ J1=60 J2=-30 J3=40 J5=60\nMJ J1=-40 J2=40 J4=90 F=60\nMJ J1=20 J3=-30 J5=-40 J6=90\nHOME\nEND"
UNKNOWN_S = 2.0 * STEP_S
"""How long a robot may brake before its agent hears of it and says so."""


def configured(world: AgentWorld) -> np.ndarray:
    """The least deceleration of a quick stop that the check of a cell lets pass."""
    planner = world.planner
    return BRAKING_RESERVE * Braking.of(planner.model, planner.limits, CYCLE_S).deceleration


def into_the_zone() -> AgentWorld:
    """It is on its way into the zone that it holds, and still outside."""
    world = running(INTO_ZONE)
    world.grant()
    until(world, lambda: world.presences[-1].holds != {} and np.abs(world.velocity).max() > 0.3)
    until(world, lambda: body_touches(world.presences[-1].body, BOX))
    return world


def at_rest(world: AgentWorld) -> bool:
    return world.presences[-1].stop_time_s == 0.0


def newest(world: AgentWorld) -> Presence:
    return world.presences[-1]


@given(seed=st.integers(0, 2**32 - 1), share=st.sampled_from([0.5, 1.0, 2.0, None]))
@settings(max_examples=8, deadline=None)
def test_the_real_body_lies_in_the_newest_published_one_until_it_stands_however_each_drive_brakes(
    seed: int, share: float | None
) -> None:
    rng = np.random.default_rng(seed)
    world = running(MOVES)
    world.run(rng.uniform(0.3, 2.5))
    shares = rng.uniform(0.5, 2.0, 6) if share is None else np.full(6, share)
    brakes, began = shares * configured(world), world.tick
    world.brake(brakes)
    while world.braking is not None:
        world.step()
        known_s = (world.tick - began) * CYCLE_S
        # Drives that brake harder than the path leave it before anyone can know.
        apart = 0.5 * brakes.max() * UNKNOWN_S**2 if known_s < UNKNOWN_S else 0.0
        lever = world.planner.model.reach_m * np.count_nonzero(world.velocity)
        assert covers(newest(world).body, world.planner.model.capsules(world.commanded), apart * lever)
        assert newest(world).stop_time_s > 0.0
    world.run(0.2)
    assert at_rest(world)


@pytest.mark.parametrize("share", [0.5, 1.0, 2.0])
def test_a_zone_is_kept_until_the_robot_that_brakes_into_it_is_measured_at_rest(share: float) -> None:
    world = into_the_zone()
    token = newest(world).holds
    world.brake(share * configured(world))
    while world.braking is not None:
        world.step()
        assert newest(world).holds == token
        assert body_touches(newest(world).body, BOX)


def test_a_zone_that_it_did_not_come_into_is_given_back_once_it_stands() -> None:
    world = running(INTO_ZONE)
    world.grant()
    until(world, lambda: newest(world).holds != {})
    world.brake(100.0 * configured(world))
    while world.braking is not None:
        world.step()
        assert newest(world).holds != {}
        assert not body_touches(newest(world).body, BOX)
    until(world, lambda: at_rest(world), 1.0)
    world.run(0.1)
    assert newest(world).holds == {}
    assert len(newest(world).body.poses) == 1


def test_a_robot_that_stands_inside_a_zone_after_a_stop_keeps_it() -> None:
    world = into_the_zone()
    world.run(0.3)
    token = newest(world).holds
    world.brake(configured(world))
    until(world, lambda: at_rest(world), 2.0)
    world.run(0.5)
    assert body_touches(newest(world).body, BOX)
    assert newest(world).holds == token


def test_the_time_to_rest_is_as_long_as_the_drives_need_at_the_most() -> None:
    world = running(MOVES)
    world.run(0.6)
    world.brake(0.5 * configured(world))
    world.step()
    world.step()
    promised_s = newest(world).stop_time_s
    needed_s = 0.0
    while world.velocity.any():
        world.step()
        needed_s += STEP_S
    assert needed_s - STEP_S <= promised_s <= needed_s + 0.1


def test_a_robot_that_stands_says_so_with_a_time_to_rest_of_zero_enabled_or_not() -> None:
    world = enabled(MOVES)
    world.run(0.5)
    assert {presence.stop_time_s for presence in world.presences[-20:]} == {0.0}
    world.call(Disable())
    world.run(0.5)
    assert world.state.mode is Mode.DISABLED
    assert {presence.stop_time_s for presence in world.presences[-40:]} == {0.0}


def test_a_robot_that_moves_on_its_path_has_the_time_to_the_end_of_all_that_was_sent() -> None:
    world = running(MOVES)
    world.run(0.6)
    left_s = len(world.queue) * CYCLE_S
    assert left_s <= newest(world).stop_time_s <= left_s + 2.0 * STEP_S


def test_while_no_feedback_comes_a_robot_that_moved_may_be_anywhere_up_to_the_end_of_what_was_sent() -> None:
    world = running(MOVES)
    world.run(0.6)
    world.feedback_lost = True
    for _ in range(60):
        world.step()
        assert covers(newest(world).body, world.planner.model.capsules(world.commanded))
        assert newest(world).stop_time_s > 0.0
    world.feedback_lost = False
    until(world, lambda: at_rest(world), 1.0)


def test_feedback_that_ends_while_the_drives_brake_leaves_body_and_zones_as_they_are() -> None:
    world = into_the_zone()
    token = newest(world).holds
    world.brake(0.5 * configured(world))
    world.step()
    world.step()
    world.feedback_lost = True
    for _ in range(60):
        world.step()
        assert newest(world).holds == token
        assert covers(newest(world).body, world.planner.model.capsules(world.commanded))
        assert newest(world).stop_time_s > 0.0


def test_a_robot_that_is_moved_without_torque_keeps_its_zone_until_it_is_measured_at_rest() -> None:
    world = into_the_zone()
    token = newest(world).holds
    world.quick_stop()
    for _ in range(40):
        world.push(0.002)
        world.step()
        assert newest(world).holds == token
        assert newest(world).stop_time_s > 0.0
    until(world, lambda: at_rest(world), 0.3)
