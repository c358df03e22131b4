"""What the agent remembers of the blocks that were played."""

import random
from dataclasses import replace

import numpy as np
import pytest

from robot_agent.agent.blocks.motion_source import SentBlock
from robot_agent.agent.blocks.sources import GovernedPath, Supply
from robot_agent.agent.blocks.timeline import Timeline
from robot_agent.agent.planning.planner import Planner
from robot_agent.agent.planning.plans import Planned, PlanRequest
from robot_agent.language import JointStep
from robot_agent.workspace import PlacedRobot
from tests.unit.agent_world import AgentWorld
from tests.unit.six_axis_arm import arm

LAG_S = 0.1
"""So far behind its command a robot is searched for."""


@pytest.mark.parametrize("cycle_s", [0.0002, 0.001, 0.004, 0.02])
def test_blocks_are_remembered_for_as_long_as_a_robot_may_be_behind_them_whatever_the_cycle(cycle_s: float) -> None:
    planner = Planner(PlacedRobot.at(arm()), cycle_s)
    standing = planner.standstill(np.zeros(6), ())
    supply = Supply(planner, nominal_s=0.1)
    segment, source = supply.governor(standing.motion).rest(0.0), GovernedPath(supply, standing)
    timeline = Timeline(SentBlock(0, 0, source, standing, segment))
    feedback = AgentWorld("END")._feedback()
    between = round(0.02 / cycle_s)
    for number in range(1, 100):
        timeline.sent(SentBlock(number, number * between + 1, source, standing, segment))
        timeline.observe(replace(feedback, tick=number * between, block=number))
    now, lag = 99 * between, round(LAG_S / cycle_s)
    assert timeline.at(now - lag)[0].first_tick <= now - lag


def test_a_robot_stands_whose_blocks_reach_the_same_hold_up_to_rounding() -> None:
    """Where an answer takes two cycles every second block goes on from another one, and both wait at their own place.

    A robot that never rests does not say what it waits for (seed 110016).
    """
    planner = Planner(PlacedRobot.at(arm()), 0.004)
    supply, feedback = Supply(planner, nominal_s=0.1), AgentWorld("END")._feedback()
    planned = planner.plan(PlanRequest(1, (JointStep(1, (0.5, 0.0, 0.0, 0.0, 0.5, 0.0), 0.1),), np.zeros(6), ()))
    assert isinstance(planned, Planned)
    source, waits_at = GovernedPath(supply, planned), 0.4
    places = [supply.governor(planned.motion).rest(tau) for tau in (waits_at, float(np.nextafter(waits_at, 1.0)))]
    timeline = Timeline(SentBlock(0, 0, source, planned, places[0]))
    for number in range(1, 10):
        timeline.sent(SentBlock(number, number + 2, source, planned, places[number % 2]))
        timeline.observe(replace(feedback, tick=number, block=number - 1))
    assert timeline.stands(9)
    assert not timeline.stands(9, SentBlock(10, 12, source, planned, supply.governor(planned.motion).rest(0.401)))


def test_what_was_commanded_over_many_ticks_is_what_each_of_them_had() -> None:
    """Blocks of many lengths, of which some are skipped at once and some play out before the next one begins."""
    rng, planner = random.Random(1), Planner(PlacedRobot.at(arm()), 0.004)
    supply, feedback = Supply(planner, nominal_s=0.1), AgentWorld("END")._feedback()
    planned = planner.plan(PlanRequest(1, (JointStep(1, (0.5, 0.0, 0.0, 0.0, 0.5, 0.0), 0.1),), np.zeros(6), ()))
    assert isinstance(planned, Planned)
    source, tick = GovernedPath(supply, planned), 0
    timeline = Timeline(SentBlock(0, 10, source, planned, supply.governor(planned.motion).rest(0.0)))
    for number in range(1, 30):
        tick += rng.choice([0, 1, 5, 60])
        rows = rng.randint(1, 50)
        rest = supply.governor(planned.motion).rest(0.01 * number)
        turned = rest.q[-1] + np.linspace(0.0, rng.random(), rows)[:, None]
        segment = replace(rest, q=turned, tau=np.repeat(rest.tau[-1:], rows))
        timeline.sent(SentBlock(number, tick + 10, source, planned, segment))
        timeline.observe(replace(feedback, tick=tick, block=number))
        for first, last in ((tick - 80, tick), (tick - 3, tick - 3), (tick, tick + 90), (tick + 5, tick + 20)):
            each = [block.segment.q[index] for block, index in map(timeline.at, range(first, last + 1))]
            np.testing.assert_array_equal(timeline.commanded(first, last), each)
