"""Steering: whatever the rate does and wherever the robot is, the way to another rate is one in numbers."""

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from robot_agent.trajectory import PathState
from robot_agent.trajectory.governor import rate_bounds
from robot_agent.trajectory.governor.rate_bounds import RateBounds
from robot_agent.trajectory.governor.steering import Steering, _bends, _slopes
from robot_agent.trajectory.governor.travel import Travel
from tests.unit.governor_drive import LIMITS, MOTIONS

WAYS = [
    (motion, Steering(RateBounds(Travel.of(motion, forwards), LIMITS))) for motion in MOTIONS for forwards in (1, 0)
]


@settings(max_examples=300, deadline=None)
@given(
    travel=st.integers(0, len(WAYS) - 1),
    place=st.floats(0.0, 1.0),
    rate=st.floats(0.0, 1.2),
    slope=st.floats(-20.0, 20.0),
    target=st.sampled_from([0.0, 0.3, 1.0]),
    share=st.sampled_from([1.0, 0.5, 0.1]),
)
@example(travel=0, place=0.0, rate=2.2250738585072014e-308, slope=-3.0, target=0.0, share=1.0)
def test_every_way_to_a_rate_ends_there_in_finite_time(
    travel: int, place: float, rate: float, slope: float, target: float, share: float
) -> None:
    motion, steering = WAYS[travel]
    law = steering.change(PathState(place * motion.duration_s, rate, slope), target, share)
    assert np.isfinite(law.states).all()
    assert np.isfinite(law.times).all()
    assert law.target == target
    assert abs(law.advance) < 1e3


def test_joints_that_the_table_leaves_out_rule_nowhere(monkeypatch: pytest.MonkeyPatch) -> None:
    rng, left_out = np.random.default_rng(4), 0
    for motion in MOTIONS:
        kept = RateBounds(Travel.of(motion, forwards=True), LIMITS)
        places = rng.uniform(0.0, motion.duration_s, 300)
        rows = [kept.row(place) for place in places]
        with monkeypatch.context() as patched:
            patched.setattr(rate_bounds, "_may_rule", lambda table: np.ones(table.shape[1:], dtype=bool))
            every = RateBounds(Travel.of(motion, forwards=True), LIMITS)
            whole = [every.row(place) for place in places]
        for row, all_joints, rate, share in zip(rows, whole, rng.uniform(size=300), rng.uniform(size=300), strict=True):
            lowest, highest = _slopes(all_joints, rate)
            slope = lowest + share * (highest - lowest)
            assert _slopes(row, rate) == (lowest, highest)
            assert _bends(row, rate, slope) == _bends(all_joints, rate, slope)
            left_out += len(all_joints) - len(row)
    assert left_out > 2 * 300 * len(MOTIONS)
