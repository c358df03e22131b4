"""The body of a robot that brakes off its path, against drives each of which brakes as it likes."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cell.geometry import transform_points
from robot_agent.kinematics import Model, OpenMechanism, load_model, model_of
from robot_agent.model import Part
from robot_agent.model.description import Capsule, Mounted
from robot_agent.trajectory import Limits
from robot_agent.workspace import BODY_GROWTH_M, BRAKING_RESERVE, Braking, joined, standing_body, unknown_body
from tests.unit.body_cover import covers
from tests.unit.message_kinds import same
from tests.unit.repository import ROOT
from tests.unit.six_axis_arm import with_tip
from tests.unit.six_axis_paths import BASE

CONFIGS = ROOT / "cell_configs"
MODELS = {path.stem: load_model(path) for path in sorted((CONFIGS / "models").glob("*.yaml"))}
MODELS["with_tip"] = with_tip()
CYCLE_S = 0.004


def braking(model: Model) -> Braking:
    return Braking.of(model, Limits.of(model.description), CYCLE_S)


def come_to(model: Model, q: np.ndarray, qd: np.ndarray, late_s: float, brakes: np.ndarray, at_s: float) -> np.ndarray:
    """Joints `at_s` after a measurement: each axis goes on for `late_s`, then brakes by itself."""
    speed = model.coupling.axes(qd)
    braking_s = np.clip(at_s - late_s, 0.0, np.abs(speed) / brakes)
    way = speed * min(at_s, late_s) + speed * braking_s - np.sign(speed) * brakes * braking_s**2 / 2.0
    return q + model.coupling.joints(way)


@pytest.mark.parametrize("name", MODELS)
@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=25, deadline=None)
def test_wherever_its_drives_come_to_rest_with_half_of_their_deceleration_or_more_a_robot_is_in_its_body(
    name: str, seed: int
) -> None:
    model, rng = MODELS[name], np.random.default_rng(seed)
    limits, worst = Limits.of(model.description), braking(model)
    low, high = model.limits.position.T
    q = rng.uniform(low, high)
    qd = limits.velocity * rng.choice([0.0, 0.02, 0.3, 1.0]) * rng.uniform(-1.0, 1.0, model.n)
    body = worst.body(BASE, q, qd)
    for _ in range(30 if body.known else 0):
        brakes = BRAKING_RESERVE * worst.deceleration * rng.choice([0.5, 0.7, 1.0, 2.0, 100.0], model.n)
        late_s = rng.uniform(0.0, worst.reaction_s)
        reached = come_to(model, q, qd, late_s, brakes, rng.uniform(0.0, 1.0) * worst.time_s(qd))
        try:
            points = model.body_and_tcp(reached)
        except OpenMechanism:
            continue  # its links stop it before
        assert covers(body, transform_points(BASE, points))


def test_an_axis_brakes_as_told_or_as_the_ramps_need_if_that_is_more_and_so_do_all_where_some_are_not_told() -> None:
    arm = MODELS["six_axis"]
    ramp = braking(arm).acceleration
    of = Limits.of(arm.description), CYCLE_S
    told = Braking.of(arm, *of, tuple((ramp * [2.0, 0.5, 1.0, 3.0, 0.0, -1.0]).tolist()))
    assert told.quick_stop == pytest.approx(ramp * [2.0, 1.0, 1.0, 3.0, 1.0, 1.0])
    assert (told.deceleration == braking(arm).deceleration).all()
    for too_few in ((), (50.0,), (50.0,) * 7):
        assert (Braking.of(arm, *of, too_few).quick_stop == ramp).all()


def test_a_slow_robot_has_a_body_of_the_growth_of_any_other() -> None:
    arm = MODELS["six_axis"]
    body = braking(arm).body(BASE, arm.home, np.full(arm.n, 0.1))
    assert body.known
    assert max(body.growth_m) < 2.0 * BODY_GROWTH_M


def test_the_present_pose_comes_first_and_is_not_grown() -> None:
    arm = MODELS["six_axis"]
    body = braking(arm).body(BASE, arm.home, np.full(arm.n, 0.5))
    assert (body.poses[0] == standing_body(arm, BASE, arm.home, known=True).poses[0]).all()
    assert body.growth_m[0] < 1e-3


def test_a_way_beyond_all_bounds_is_not_known() -> None:
    arm = MODELS["six_axis"]
    assert same(braking(arm).body(BASE, arm.home, np.full(arm.n, 50.0)), unknown_body(arm, BASE))


def test_two_bodies_are_one_and_not_known_when_one_of_them_is_not() -> None:
    arm = MODELS["six_axis"]
    here, there = (standing_body(arm, BASE, q, known=True) for q in (arm.home, arm.home + 0.1))
    assert np.array_equal(joined(here, there).poses, np.concatenate([here.poses, there.poses]))
    assert same(joined(here, unknown_body(arm, BASE)), unknown_body(arm, BASE))
    assert same(joined(unknown_body(arm, BASE), here), unknown_body(arm, BASE))


def test_bodies_with_and_without_a_part_are_together_all_that_the_robot_may_reach() -> None:
    arm = MODELS["six_axis"]
    rod = Part("rod", 1.0, (0.0, 0.0, 0.0), np.zeros((3, 3)), (Capsule((0, 0, 0), (0.5, 0, 0), 0.05),))
    holding = model_of(replace(arm.description, parts={"rod": rod}, mounted=Mounted(parts=("rod",))))
    bare, larger = (standing_body(model, BASE, arm.home, known=True) for model in (arm, holding))
    for both in (joined(bare, larger), joined(larger, bare)):
        assert same(both, unknown_body(holding, BASE))
