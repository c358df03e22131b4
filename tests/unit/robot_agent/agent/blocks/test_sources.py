"""Whatever moves a robot answers alike: from where the accepted block leads, the next samples, or a ramp at once."""

from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from robot_agent.agent.blocks.corrections import Correcting
from robot_agent.agent.blocks.motion_source import Join, MotionSource, SentBlock, Wishes
from robot_agent.agent.blocks.sources import CorrectedPath, GovernedPath, Jogged, Supply
from robot_agent.agent.planning.planner import Planner
from robot_agent.agent.planning.plans import Planned, PlanRequest
from robot_agent.language import JointStep
from robot_agent.trajectory.sources import CorrectionFrame, CorrectionLimits, JogSource, JogWish, JointAxes, Target
from robot_agent.workspace import PlacedRobot
from tests.unit.six_axis_arm import arm

CYCLE_S = 0.004
STEP = 5
"""Ticks from one block to the next."""
ARM = arm()
START = np.array([0.3, 0.2, 0.3, 0.1, 0.9, 0.2])
PLANNER = Planner(PlacedRobot.at(ARM), CYCLE_S)
SUPPLY = Supply(PLANNER, nominal_s=0.12)
OFFSET = np.array([0.0, 0.02, 0.0, 0.0, 0.0, 0.0])
CORRECTING = Correcting(
    CorrectionLimits(0.1, 1.0, 10.0, 0.5, 3.0, 30.0), CorrectionFrame.BASE, Target(OFFSET, np.zeros(6)), lambda _: ""
)
WISHES = Wishes((), stop=False, holds=lambda _planned, _segment, _index: [], correction=CORRECTING)


def path() -> Planned:
    step = JointStep(1, tuple((START + np.radians([40.0, 5.0, 0.0, 0.0, 10.0, 0.0])).tolist()), 0.1)
    planned = PLANNER.plan(PlanRequest(1, (step,), START, ()))
    assert isinstance(planned, Planned)
    return planned


def jog() -> JogSource:
    return JogSource(ARM, PLANNER.limits, CYCLE_S, JointAxes(PLANNER.limits), JogWish(0, 0.2))


SOURCES: dict[str, Callable[[], MotionSource]] = {
    "path": lambda: GovernedPath(SUPPLY, path()),
    "correction": lambda: CorrectedPath(SUPPLY, path()),
    "jog": lambda: Jogged(SUPPLY, jog()),
}


def standing() -> SentBlock:
    planned = PLANNER.standstill(START, ())
    segment = SUPPLY.governor(planned.motion).rest(0.0)
    return SentBlock(0, 0, GovernedPath(SUPPLY, planned), planned, segment)


def join(base: SentBlock, wishes: Wishes = WISHES) -> Join:
    return Join(base, base.first_tick + STEP, base.path_rest_tick, STEP * CYCLE_S, base.sequence + 1, wishes)


def moving(source: MotionSource, blocks: int = 20) -> list[SentBlock]:
    """The blocks of a source that begins at rest; each joins the one before a few ticks on."""
    assert source.begin(join(standing()))
    sent = [source.samples()]
    while len(sent) < blocks:
        sent[-1].source.resume(join(sent[-1]))
        sent.append(sent[-1].source.samples())
    return sent


@pytest.mark.parametrize("kind", SOURCES)
def test_each_block_joins_the_one_before_and_ends_at_rest(kind: str) -> None:
    sent = moving(SOURCES[kind]())
    for before, block in pairwise(sent):
        at = before.index(block.first_tick)
        np.testing.assert_allclose(block.segment.q[0], before.segment.q[at], atol=1e-12)
        np.testing.assert_allclose(block.segment.qd[0], before.segment.qd[at], atol=1e-9)
        assert not block.segment.qd[-1].any()
        assert block.rest_tick > block.first_tick + SUPPLY.nominal


@pytest.mark.parametrize("kind", SOURCES)
def test_a_brake_comes_to_rest_no_later_than_the_block_before_and_before_any_more_samples_would(kind: str) -> None:
    newest = moving(SOURCES[kind]())[-1]
    source = newest.source
    source.resume(join(newest))
    further = source.samples()
    source.resume(join(newest, replace(WISHES, stop=True)))
    braked = source.brake()
    assert braked.rest_tick <= newest.rest_tick < further.rest_tick
    assert not braked.segment.qd[-1].any()


@pytest.mark.parametrize("kind", ["path", "correction"])
def test_a_motion_that_is_not_due_leaves_the_robot_to_what_moves_it(kind: str) -> None:
    wishes = replace(WISHES, not_before_tick=1000)
    assert not SOURCES[kind]().begin(join(standing(), wishes))


@pytest.mark.parametrize("kind", ["correction", "jog"])
def test_what_is_not_planned_is_a_motion_through_its_samples(kind: str) -> None:
    block = moving(SOURCES[kind]())[-1]
    segment, motion = block.segment, block.planned.motion
    np.testing.assert_allclose(motion.q(segment.tau), segment.q, atol=1e-12)
    on_the_way = segment.tau < motion.duration_s
    np.testing.assert_allclose(motion.qd(segment.tau)[on_the_way], segment.qd[on_the_way], atol=1e-9)
    assert motion.duration_s == segment.rest_index * CYCLE_S
