"""What an agent owns of the cell's space, where its motions are held, and what it asks for."""

from dataclasses import replace

import numpy as np
import pytest

from cell.messages import Clearance, Refusal, Sections
from robot_agent.agent.planning.passed import Passed, Span
from robot_agent.agent.planning.planner import Planner
from robot_agent.agent.planning.plans import Planned, PlanRequest
from robot_agent.agent.space.shared_space import SharedSpace, Use, onward
from robot_agent.language import JointStep
from robot_agent.workspace import FOLLOWING_M, PlacedRobot, body_message, standing
from tests.unit.six_axis_arm import arm

ARM = arm()
PLANNER = Planner(PlacedRobot.at(ARM, kept_apart=True), 0.004)
BASE = np.eye(4)


def _planned() -> Planned:
    step = JointStep(1, (0.6, None, None, None, None, None), 0.8)
    planned = PLANNER.plan(PlanRequest(1, (step,), ARM.home, ()))
    assert isinstance(planned, Planned), planned
    return planned


PLANNED = _planned()
HOME = standing(ARM, BASE, ARM.home, 0.01)


def _space() -> SharedSpace:
    space = SharedSpace("left", "boot", kept_apart=True)
    space.claimed(1, 5)
    space.way(1, Use(HOME, ARM))
    return space


def _answer(space: SharedSpace, presence: int, number: int, cleared: int, why: str = "", by: str = "right") -> None:
    refused = Refusal(by, why) if why else None
    space.heard(Clearance("left", "m", 5, 1, presence, number, cleared, refused))


def _passed(first_tau: float, last_tau: float, planned: Planned = PLANNED, widen_m: float = 0.0) -> Passed:
    span = Span(planned, first_tau, last_tau)
    pieces = [(planned.sweep, *span.samples)]
    return Passed(body_message(ARM, BASE, pieces, widen_m), [span], pieces, widen_m, 0)


def test_a_motion_is_held_where_its_space_is_not_cleared_and_not_behind() -> None:
    space = _space()
    ahead = onward(PLANNED, 0.0, 0.0, 0.3)
    space.way(2, Use(HOME, ARM, ahead))
    assert [hold.tau for _, hold in space.holds_on(PLANNED, 0.0)] == [0.0]
    _answer(space, 2, 1, 5, "right is in the way")
    space.way(3, Use(HOME, ARM, ahead))
    ((_, hold),) = space.holds_on(PLANNED, 0.0)
    assert PLANNED.sections is not None
    assert hold.tau == PLANNED.sections.taus[5]
    assert hold.until == np.inf
    assert hold.who == "right is in the way"


@pytest.mark.parametrize(
    ("why", "by", "keeps_it"), [("", "", False), ("not heard yet", "", False), ("near", "right", True)]
)
def test_headway_is_kept_behind_another_robot_alone(why: str, by: str, keeps_it: bool) -> None:
    space, ahead = _space(), onward(PLANNED, 0.0, 0.0, 0.3)
    space.way(2, Use(HOME, ARM, ahead))
    _answer(space, 2, 1, 5, why, by)
    space.way(3, Use(HOME, ARM, ahead))
    ((_, hold),) = space.holds_on(PLANNED, 0.0)
    assert (hold.headway_s > 0.0) is keeps_it


def test_what_lies_behind_the_robot_is_given_back_and_closed() -> None:
    space = _space()
    whole = onward(PLANNED, 0.0, 0.0, 0.3)
    space.way(2, Use(HOME, ARM, whole))
    _answer(space, 2, 1, len(whole))
    space.way(3, Use(HOME, ARM, whole))
    assert PLANNED.sections is not None
    used = space.used(_passed(0.1, 0.2))
    way = space.way(4, Use(used, ARM, onward(PLANNED, 0.0, 0.2, 0.3)))
    assert way.owned == len(way.sections)
    behind, before = (hold for _, hold in space.holds_on(PLANNED, 0.0))
    first = PLANNED.sections.index(0.1)
    assert behind.tau == 0.0
    assert behind.until == pytest.approx(PLANNED.sections.taus[first], abs=0.02)
    assert before.tau > 0.2


def test_backwards_the_sections_come_in_the_order_of_travel() -> None:
    back = onward(PLANNED, 0.0, 0.3, 0.1)
    assert back.ids.tolist() == onward(PLANNED, 0.0, 0.1, 0.3).ids.tolist()[::-1]


def test_who_gives_up_what_it_does_not_use_owns_no_more_than_that() -> None:
    space = _space()
    ahead = onward(PLANNED, 0.0, 0.0, 0.3)
    space.way(2, Use(HOME, ARM, ahead))
    _answer(space, 2, 1, len(ahead))
    assert space.way(3, Use(HOME, ARM, ahead)).owned == 1 + len(ahead)
    assert space.way(4, Use(HOME, ARM)).owned == 1
    assert space.way(5, Use(HOME, ARM, ahead)).owned == 1


def test_a_robot_that_stands_stays_in_the_section_in_which_it_was() -> None:
    space = _space()
    at_rest = PLANNER.standstill(ARM.home + 1e-3, ())
    assert space.used(_passed(0.0, 0.0, at_rest)).ids.tolist() == HOME.ids.tolist()
    far = PLANNER.standstill(ARM.home + 0.1, ())
    assert space.used(_passed(0.0, 0.0, far)).ids.tolist() != HOME.ids.tolist()


def test_a_robot_beside_its_path_is_where_its_body_is_measured_and_keeps_what_it_had() -> None:
    space = _space()
    passed = _passed(0.2, 0.25, widen_m=FOLLOWING_M + 1e-3)
    used = space.used(passed)
    assert HOME.ids[0] in used.ids
    assert len(used) == 1 + len(passed.body.poses)
    space.way(2, Use(used, ARM, None, passed.widen_m))
    assert space.beside_path
    assert not space.owns(onward(PLANNED, 0.0, 0.2, 0.25))


def test_samples_that_no_plan_has_cut_are_free_inside_what_is_owned_only() -> None:
    space = _space()
    assert space.outside(PLANNED.sweep.part(0, 1)) == ""
    assert space.outside(PLANNED.sweep) == "cleared space"
    sampled = replace(PLANNED, sections=None)
    assert space.used(_passed(0.0, 0.01, sampled)).ids.tolist() == HOME.ids.tolist()


def test_a_new_claim_begins_without_space_and_keeps_the_highest_epoch() -> None:
    space = _space()
    space.heard(Clearance("left", "m2", 9, 1, 1, 1, 0))
    space.claimed(2, 7)
    assert space.epoch == 9
    assert not space.owns(HOME)


def test_a_correction_needs_room_beside_the_path() -> None:
    narrow, wide = (onward(PLANNED, beside_m, 0.0, 0.1) for beside_m in (0.0, 0.05))
    assert np.allclose(wide.radii, narrow.radii + 0.05, atol=1e-6)
    assert set(wide.ids.tolist()).isdisjoint(narrow.ids.tolist())


def test_where_robots_are_not_kept_apart_all_space_is_free() -> None:
    space = SharedSpace("left", "boot", kept_apart=False)
    assert space.holds_on(PLANNED, 0.0) == []
    assert space.outside(PLANNED.sweep) == ""
    assert len(space.way(1, Use(HOME, ARM, HOME)).sections) == 0
    assert len(space.used(_passed(0.0, 0.2))) == 0


def test_bodies_with_more_capsules_join_those_with_fewer() -> None:
    one, other = standing(ARM, BASE, ARM.home), standing(ARM, BASE, ARM.home + 0.1)
    fewer = Sections(one.ids, one.points[:, :2], one.radii[:, :2])
    joined = fewer.joined(other)
    assert joined.points.shape == (2, *other.points.shape[1:])
    assert (joined.points[0, 2:] == fewer.points[0, 0]).all()
