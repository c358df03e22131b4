"""Joints that may accelerate one way harder than the other: plans and braking ramps keep both limits."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from ruckig import ControlInterface, InputParameter, Ruckig, Trajectory

from robot_agent.model.description import ProfileKind, Shaping
from robot_agent.paths import JointMove, Sequence
from robot_agent.trajectory import Governor, RateRequest, plan
from tests.unit.random_moves import LIMITS, MODEL, START, sequence

CYCLE_S = 0.004
WEAK = replace(LIMITS, acceleration_down=0.4 * LIMITS.acceleration)
LOWEST, HIGHEST = -WEAK.ramp_factor * 0.4 * LIMITS.acceleration, WEAK.ramp_factor * LIMITS.acceleration
TURN = START + np.array([0.9, -0.5, 0.4, 0.3, 0.2, -0.8])
MOTIONS = [
    plan(MODEL, Sequence([JointMove(TURN, 1.0, 1), JointMove(START, 1.0, 2)]), WEAK, start=START),
    plan(MODEL, sequence(5, longest=3), WEAK, start=START),
]


def fastest_stop_s(velocity: float, acceleration: float) -> float:
    """Of the first joint alone, by Ruckig."""
    request = InputParameter(1)
    request.control_interface = ControlInterface.Velocity
    request.current_velocity, request.current_acceleration = [velocity], [acceleration]
    request.target_velocity = request.target_acceleration = [0.0]
    request.min_acceleration, request.max_acceleration = [LOWEST[0]], [HIGHEST[0]]
    request.max_jerk = [WEAK.ramp_jerk[0]]
    trajectory = Trajectory(1)
    Ruckig(1).calculate(request, trajectory)
    return float(trajectory.duration)


@settings(max_examples=25, deadline=None)
@given(
    number=st.integers(0, 1),
    begin=st.floats(0.0, 1.0),
    wishes=st.lists(
        st.tuples(st.sampled_from([1.0, 0.0, -1.0, 0.4, -0.6]), st.integers(1, 12), st.booleans()),
        min_size=2,
        max_size=8,
    ),
)
def test_everything_that_is_sent_keeps_the_limit_of_each_direction(
    number: int, begin: float, wishes: list[tuple[float, int, bool]]
) -> None:
    motion = MOTIONS[number]
    governor = Governor(motion, WEAK, CYCLE_S, nominal_s=0.12)
    segment, index = governor.rest(begin * motion.duration_s), 0
    played = [segment.q[:1]]
    for rate, calls, stop in wishes:
        for _ in range(calls):
            segment = governor.next(segment, index, (RateRequest(rate, "override"),), (), stop)
            index = 5
            played.append(segment.q[np.minimum(np.arange(1, 6), segment.length - 1)])
    rest = np.arange(index + 1, max(segment.length, index + 1) + 3)
    q = np.concatenate([*played, segment.q[np.minimum(rest, segment.length - 1)]])
    acceleration = np.diff(q, 2, axis=0) / CYCLE_S**2
    assert (acceleration >= 1.01 * LOWEST).all()
    assert (acceleration <= 1.01 * HIGHEST).all()
    assert (np.abs(np.diff(q, 3, axis=0)) / CYCLE_S**3 <= 1.01 * WEAK.ramp_jerk).all()
    assert (np.abs(np.diff(q, axis=0)) / CYCLE_S <= 1.01 * WEAK.velocity).all()


@pytest.mark.parametrize("way", [1.5, -1.5])
def test_a_ramp_uses_what_the_braking_direction_allows(way: float) -> None:
    motion = plan(MODEL, Sequence([JointMove(START + np.array([way, 0, 0, 0, 0, 0]), 1.0, 1)]), WEAK, start=START)
    governor = Governor(motion, WEAK, CYCLE_S, nominal_s=0.12)
    segment, ratios = governor.next(governor.rest(0.0), 0, (), ()), []
    while (tau := float(segment.tau[segment.nominal])) < motion.duration_s - 0.3:
        velocity, acceleration = motion.qd(np.array(tau))[0], motion.qdd(np.array(tau))[0]
        ramp_s = segment.stop_time_s - segment.nominal * CYCLE_S
        ratios.append(ramp_s / fastest_stop_s(velocity, acceleration))
        segment = governor.next(segment, 5, (), ())
    assert np.median(ratios) < 1.15
    assert max(ratios) < 1.45


@pytest.mark.parametrize("kind", [ProfileKind.S_CURVE, ProfileKind.SINUSOIDAL, ProfileKind.QUINTIC])
@pytest.mark.parametrize("synchronised", [True, False])
def test_every_profile_and_the_filter_keep_both(kind: ProfileKind, synchronised: bool) -> None:
    limits = replace(WEAK, shaping=Shaping(kind, 0.02))
    motion = plan(MODEL, Sequence([JointMove(TURN, 1.0, 1, synchronised=synchronised)]), limits, start=START)
    used = motion.pieces.inside(5)[1]
    assert (used >= -limits.acceleration_down * 1.001).all()
    assert (used <= limits.acceleration * 1.001).all()
