import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cell.geometry import WrongShape, transform_points
from robot_agent.workspace import Sweep, body_message, envelope, standing_body, sweep
from tests.unit.six_axis_arm import arm, with_tip
from tests.unit.six_axis_paths import BASE, CYCLE_S, evenly_between, joint_path

ARM = arm()
PARTS = 8
paths = st.fixed_dictionaries(
    {
        "seed": st.integers(0, 10_000),
        "cycle_s": st.sampled_from([CYCLE_S, 0.02]),
        "first": st.integers(0, 60),
        "length": st.integers(0, 60),
    }
)


def swept(q: np.ndarray) -> Sweep:
    return sweep(ARM, BASE, q)


def world_ends(q: np.ndarray) -> np.ndarray:
    return transform_points(BASE, ARM.capsules(q))


def farthest(points: np.ndarray, pose: np.ndarray) -> float:
    """How far any end point is from where it is in a pose: by so much its capsules must grow to cover the points."""
    return float(np.linalg.norm(points - pose, axis=-1).max())


@given(path=paths, straight=st.booleans())
@settings(max_examples=60, deadline=None)
def test_nothing_between_two_chosen_poses_leaves_the_grown_one(path: dict, straight: bool) -> None:
    first, last = path["first"], path["first"] + path["length"]
    samples = path["cycle_s"] * np.arange(121)
    q = joint_path(path["seed"], samples)
    fine = path["cycle_s"] * np.arange(120 * PARTS + 1) / PARTS
    between = world_ends(evenly_between(q, PARTS) if straight else joint_path(path["seed"], fine))
    body = swept(q)
    cover = envelope(body, first, last)
    assert (cover.indices[0], cover.indices[-1]) == (first, last)
    for index, follower, growth in zip(cover.indices, cover.indices[1:], cover.growth, strict=False):
        assert farthest(between[index * PARTS : follower * PARTS + 1], body.points[index]) <= growth


@given(path=paths)
@settings(max_examples=30, deadline=None)
def test_growth_keeps_its_limit_where_single_steps_do(path: dict) -> None:
    body = swept(joint_path(path["seed"], CYCLE_S * np.arange(121)))
    cover = envelope(body, path["first"], path["first"] + path["length"], growth_limit_m=0.03)
    assert max(cover.growth) <= 0.03 + 1e-12


def test_a_step_longer_than_the_limit_is_still_covered() -> None:
    q = np.array([[0.0] * 6, [0.5, 0, 0, 0, 0, 0], [1.0, 0, 0, 0, 0, 0]])
    cover = envelope(swept(q), 0, 2, growth_limit_m=0.02)
    assert cover.indices == (0, 1, 2)
    assert farthest(world_ends(evenly_between(q, PARTS)[: PARTS + 1]), world_ends(q[0])) <= cover.growth[0]


def test_a_standing_robot_is_one_or_two_poses_without_growth() -> None:
    body = swept(np.tile(joint_path(1, np.zeros(1)), (200, 1)))
    assert envelope(body, 0, 199).indices == (0, 199)
    assert envelope(body, 0, 199).growth == (0.0, 0.0)
    assert envelope(body, 7, 7).indices == (7,)


def test_the_distance_to_the_measured_position_widens_every_pose() -> None:
    body = swept(joint_path(2, CYCLE_S * np.arange(121)))
    plain, wide = envelope(body, 0, 120), envelope(body, 0, 120, widen_m=0.004)
    assert wide.indices == plain.indices
    np.testing.assert_allclose(np.subtract(wide.growth, plain.growth), 0.004, atol=1e-15)


def test_the_message_covers_its_envelopes_although_it_is_rounded() -> None:
    bodies = [swept(joint_path(seed, CYCLE_S * np.arange(121))) for seed in (3, 4)]
    message = body_message(ARM, BASE, [(bodies[0], 10, 120), (bodies[1], 0, 50)], widen_m=0.001)
    covers = [envelope(bodies[0], 10, 120, widen_m=0.001), envelope(bodies[1], 0, 50, widen_m=0.001)]
    exact = np.concatenate([body.points[list(c.indices)] for body, c in zip(bodies, covers, strict=True)])
    needed = np.concatenate([c.growth for c in covers])
    moved = np.linalg.norm(message.poses - exact, axis=-1).max(axis=(1, 2))
    assert (needed + moved <= message.growth_m).all()
    assert (message.growth_m <= needed + 1e-6).all()
    assert message.known
    assert message.base == pytest.approx(BASE[:3, 3])
    assert (message.radii_m >= ARM.capsule_radii).all()
    assert (message.radii_m <= ARM.capsule_radii + 1e-6).all()


def test_a_robot_that_is_not_referenced_is_its_whole_reach() -> None:
    message = standing_body(ARM, BASE, np.zeros(6), known=False)
    assert (message.known, len(message.poses), len(message.growth_m)) == (False, 0, 0)
    assert message.reach_m == ARM.reach_m


def test_a_sweep_needs_at_least_one_sample() -> None:
    with pytest.raises(WrongShape, match="m > 0"):
        swept(np.empty((0, 6)))
    assert swept(np.zeros((1, 6))).chords.shape == (0, 7)


@given(seed=st.integers(0, 10_000), first=st.integers(0, 60), length=st.integers(0, 60))
@settings(max_examples=30, deadline=None)
def test_the_balls_of_a_message_cover_the_tcp_between_the_samples_too(seed: int, first: int, length: int) -> None:
    model, taus = with_tip(), CYCLE_S * np.arange(121)
    body = sweep(model, BASE, joint_path(seed, taus))
    message = body_message(model, BASE, [(body, first, first + length)], widen_m=0.001)
    fine = np.linspace(taus[first], taus[first + length], 200)
    tcp = (BASE @ model.forward(joint_path(seed, fine)))[:, :3, 3]
    away = np.linalg.norm(tcp[:, None] - message.tcp_m.astype(float), axis=-1)
    assert (away <= message.growth_m).any(axis=1).all()
    assert message.tcp_m.shape == (len(message.poses), 3)
