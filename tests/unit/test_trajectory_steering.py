"""Steering: whatever the rate does and wherever the robot is, the way to another rate is one in numbers."""

import numpy as np
from governor_drive import LIMITS, MOTIONS
from hypothesis import given, settings
from hypothesis import strategies as st

from robot_agent.trajectory import PathState
from robot_agent.trajectory.rate_bounds import RateBounds
from robot_agent.trajectory.steering import Steering
from robot_agent.trajectory.track import Track

WAYS = [(motion, Steering(RateBounds(Track.of(motion, forwards), LIMITS))) for motion in MOTIONS for forwards in (1, 0)]


@settings(max_examples=300, deadline=None)
@given(
    st.integers(0, len(WAYS) - 1),
    st.floats(0.0, 1.0),
    st.floats(0.0, 1.2),
    st.floats(-20.0, 20.0),
    st.sampled_from([0.0, 0.3, 1.0]),
    st.sampled_from([1.0, 0.5, 0.1]),
)
def test_every_way_to_a_rate_ends_there_in_finite_time(
    track: int, place: float, rate: float, slope: float, target: float, share: float
) -> None:
    motion, steering = WAYS[track]
    law = steering.change(PathState(place * motion.duration_s, rate, slope), target, share)
    assert np.isfinite(law.states).all()
    assert np.isfinite(law.times).all()
    assert law.target == target
    assert abs(law.advance) < 1e3
