"""A planned path as a motion source: samples on the path, and at any instant a way to rest on it."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from robot_agent.paths import JointMove, Line, Sequence
from robot_agent.trajectory import Governor, Hold, Limits, Motion, RateRequest, plan
from robot_agent.trajectory.sources import PathSource, States
from robot_agent.trajectory.sources.sampled import sampled
from tests.unit.six_axis_arm import arm, description

CYCLE_S = 0.004
ARM = arm()
LIMITS = Limits.of(description())
START = np.array([0.3, 0.2, 0.3, 0.1, 0.9, 0.2])


def line() -> Motion:
    target = ARM.forward(START).copy()
    target[:3, 3] += (0.1, 0.4, -0.2)
    blocks = [Line(target, None, 1), JointMove(START, 0.7, 2)]
    return plan(ARM, Sequence(blocks), LIMITS, start=START, cycle_s=CYCLE_S)


MOTION = line()
PATH = MOTION.q(np.linspace(0.0, MOTION.duration_s, 20_000))


def source() -> PathSource:
    governor = Governor(MOTION, LIMITS, CYCLE_S, nominal_s=0.12)
    return PathSource(MOTION, governor, governor.rest(0.0))


def away_from_path(q: np.ndarray) -> float:
    """Largest distance [rad] of joints `(m, n)` from the chords of the densely sampled motion."""
    start, way = PATH[:-1], np.diff(PATH, axis=0)
    worst = 0.0
    for each in q:
        share = np.clip(((each - start) * way).sum(1) / np.maximum((way * way).sum(1), 1e-30), 0.0, 1.0)
        worst = max(worst, float(np.abs(start + share[:, None] * way - each).max(axis=1).min()))
    return worst


def peaks(q: np.ndarray) -> np.ndarray:
    """Largest velocity, acceleration and jerk of samples over what a ramp may use."""
    allowed = (LIMITS.velocity, LIMITS.ramp_acceleration_bounds[1], LIMITS.ramp_jerk)
    return np.array(
        [
            (np.abs(np.diff(q, order, axis=0)) / CYCLE_S**order / limit).max(initial=0.0)
            for order, limit in enumerate(allowed, 1)
        ]
    )


def test_samples_in_any_portions_are_the_motion_as_planned() -> None:
    path, given = source(), States.standing(START, 1)
    for count in (1, 30, 7, 64, 400, 400):
        given = given.then(path.samples(count))
    taus = np.minimum(np.arange(given.count) * CYCLE_S, MOTION.duration_s)
    np.testing.assert_allclose(given.q, MOTION.q(taus), atol=1e-9)
    np.testing.assert_allclose(given.qd, MOTION.qd(taus), atol=1e-6)
    assert path.at_end


def test_states_are_the_derivatives_of_the_samples() -> None:
    path = source()
    path.samples(70)
    path.requests = (RateRequest(0.4, "override"),)
    given = path.samples(80)
    middle = slice(1, -1)
    np.testing.assert_allclose(np.gradient(given.q, CYCLE_S, axis=0)[middle], given.qd[middle], atol=3e-3)
    np.testing.assert_allclose(np.gradient(given.qd, CYCLE_S, axis=0)[middle], given.qdd[middle], atol=0.15)
    assert path.ruled_by == "override"


def test_a_hold_is_never_passed() -> None:
    path = source()
    path.holds = (Hold(0.5, "zone"),)
    path.samples(1000)
    assert 0.5 - 1e-6 < path.tau <= 0.5
    assert path.ruled_by == "zone"


@settings(max_examples=12, deadline=None)
@given(st.lists(st.tuples(st.integers(1, 60), st.floats(0.0, 1.0)), min_size=1, max_size=8))
def test_from_any_state_the_ramp_ends_at_rest_on_the_path_within_the_limits(portions: list[tuple[int, float]]) -> None:
    path, given = source(), States.standing(START, 3)
    for count, rate in portions:
        path.requests = (RateRequest(rate, "override"),)
        given = given.then(path.samples(count))
    whole = given.then(path.brake())
    _, segment = sampled(ARM, whole, given.count - 1, np.stack([START, START]), CYCLE_S, "")
    np.testing.assert_array_equal(segment.q[-3:], np.tile(whole.q[-1], (3, 1)))
    assert not segment.qd[-1].any()
    assert (peaks(whole.q) < 1.01).all()
    assert away_from_path(whole.q[::7]) < 2e-6


def test_a_sampled_motion_passes_through_its_states() -> None:
    path = source()
    given = States.standing(START, 1).then(path.samples(60)).then(path.brake())
    motion, segment = sampled(ARM, given, 60, np.stack([START, START]), CYCLE_S, "key")
    np.testing.assert_allclose(motion.q(segment.tau), segment.q, atol=1e-12)
    moving = segment.tau < motion.duration_s
    np.testing.assert_allclose(motion.qd(segment.tau)[moving], segment.qd[moving], atol=1e-9)
    assert (segment.nominal, segment.ruled_by) == (60, "key")
    assert motion.duration_s == segment.rest_index * CYCLE_S
