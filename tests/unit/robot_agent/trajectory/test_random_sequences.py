"""Random sequences of 2 to 20 moves of all kinds: no limit exceeded, on the geometry, at rest at both ends."""

from collections.abc import Callable, Container
from dataclasses import replace

import numpy as np
import pytest

from robot_agent.paths import JointMove, Move, Sequence
from robot_agent.trajectory import Motion, PlanError, plan
from robot_agent.trajectory.joints.joint_path import JointPath
from robot_agent.trajectory.planner import _Paths
from robot_agent.trajectory.timing.dispatch import in_time
from robot_agent.trajectory.timing.optimal.reachability import fastest_speeds, times
from robot_agent.trajectory.timing.path_limits import PathLimits
from tests.unit.commanded_geometry import blended_m, curves, deviations_m, outside_of_corners, stopping_as
from tests.unit.random_moves import LIMITS, MODEL, START, decorated, sequence
from tests.unit.tcp_shares import tcp_shares

DT = 0.004
ALLOWED = np.stack([LIMITS.velocity, LIMITS.acceleration, LIMITS.jerk])
EXCESS = 1.001
IN_TEST, IN_ALL = range(10), 216
DECORATED_IN_TEST, DECORATED_IN_ALL = (10, 22, 56), 203
WORSE = 1.01
"""What a search may take more on another processor, whose last digits differ: 0.7 % were seen."""
SLOWER = {
    0: 1.063,
    1: 1.092,
    2: 1.051,
    3: 1.133,
    4: 1.019,
    5: 1.024,
    6: 1.011,
    7: 1.022,
    8: 1.024,
    10: 1.066,
    11: 1.012,
    12: 0.985,
    14: 1.063,
    15: 1.103,
    16: 1.090,
    17: 1.025,
    18: 1.034,
    19: 1.049,
    20: 1.005,
    21: 1.026,
    22: 1.058,
    23: 0.995,
    24: 1.072,
    25: 0.999,
    26: 1.068,
    27: 1.201,
    28: 1.104,
    29: 1.059,
    30: 1.010,
    31: 1.051,
    32: 1.048,
    33: 1.032,
    34: 0.969,
    35: 0.961,
    36: 1.009,
    37: 0.997,
    38: 1.107,
    39: 1.032,
    40: 1.033,
    41: 1.099,
    42: 1.078,
    43: 1.033,
    44: 1.056,
    45: 1.117,
    46: 1.043,
    47: 1.015,
    49: 0.934,
    50: 1.023,
    51: 1.007,
    52: 1.068,
}
"""What 50 sequences take, a/j for each start and stop taken off, by the time without a limit of jerk."""
BUILD_S = float((LIMITS.acceleration / LIMITS.jerk).max())


def planned(number: int, drawn: Callable[[int], Sequence] = sequence) -> tuple[Sequence, Motion]:
    """A sequence and its motion; poses out of reach or range are drawn again."""
    for draw in range(20):
        moves = drawn(number + 1000 * draw)
        try:
            return moves, plan(MODEL, moves, LIMITS, start=START, cycle_s=DT)
        except PlanError:
            continue
    raise AssertionError("none of 20 sequences can be planned")


def assert_joints_inside_limits(motion: Motion) -> None:
    q = motion.q(np.arange(-3, int(motion.duration_s / DT) + 6) * DT)
    for order in (1, 2, 3):
        reached = np.abs(np.diff(q, order, axis=0)).max(axis=0) / DT**order
        assert (reached <= EXCESS * ALLOWED[order - 1]).all(), f"samples, order {order}"
    between = np.abs(motion.pieces.inside(9)).max(axis=(1, 2))
    assert (between <= EXCESS * ALLOWED).all(), f"between samples {between / ALLOWED}"


def assert_smooth_and_at_rest(motion: Motion) -> None:
    knots = motion.pieces.knots[1:-1]
    np.testing.assert_allclose(motion.qd(knots - 1e-9), motion.qd(knots + 1e-9), atol=1e-6)
    np.testing.assert_allclose(motion.q(knots - 1e-9), motion.q(knots + 1e-9), atol=1e-7)
    np.testing.assert_allclose(motion.qd(motion.rests), 0.0, atol=1e-9)
    np.testing.assert_array_equal(motion.rests[[0, -1]], [0.0, motion.duration_s])


def assert_flange_inside_its_speeds(moves: Sequence, motion: Motion, taus: list[np.ndarray]) -> None:
    for move, tau in zip(moves.moves, taus, strict=True):
        if isinstance(move, JointMove):
            continue
        cap = LIMITS.path.speed_m_s if move.speed_m_s is None else min(move.speed_m_s, LIMITS.path.speed_m_s)
        twist = (MODEL.jacobian(motion.q(tau)) @ motion.qd(tau)[..., None])[..., 0]
        speeds = np.linalg.norm(twist.reshape(-1, 2, 3), axis=2)
        assert (speeds <= EXCESS * np.array([cap, LIMITS.path.angular_speed_rad_s])).all(), f"move {move.line}"


def assert_flange_inside_its_acceleration_and_jerk(moves: Sequence, motion: Motion) -> None:
    used = tcp_shares(motion, LIMITS.path, [not isinstance(each, JointMove) for each in moves.moves], every_s=0.003)
    assert (used <= EXCESS).all(), f"along, across, jerk: {np.sort(used, axis=0)[-3:]} of the flange's limits"


def caps(move: Move) -> np.ndarray:
    """What a move allows the flange's speed and rotation and the joints' own speed, the path's limits included."""
    asked = np.array([move.speed_m_s, move.rotation_rad_s, move.joint_speed_rad_s], dtype=float)
    path = LIMITS.path
    own = [np.inf, np.inf] if isinstance(move, JointMove) else [path.speed_m_s, path.angular_speed_rad_s]
    return np.fmin(asked, [*own, np.inf])


def assert_caps_kept_at_every_millisecond(moves: Sequence, motion: Motion) -> None:
    """In corners too: each half of one keeps what its move asks for."""
    tau = np.arange(0.0, motion.duration_s, 0.001)
    move, qd = motion.move_at(tau), motion.qd(tau)
    twist = (MODEL.jacobian(motion.q(tau)) @ qd[..., None])[..., 0]
    speeds = [np.linalg.norm(each, axis=1) for each in (twist[:, :3], twist[:, 3:], qd)]
    allowed = np.array([[*caps(each), getattr(each, "speed", 1.0)] for each in moves.moves])[move]
    share = (np.abs(qd) / LIMITS.velocity).max(axis=1)
    used = np.column_stack([*speeds, share]) / np.fmax(allowed, 1e-300)
    worst = np.unravel_index(used.argmax(), used.shape)
    assert used.max() <= EXCESS, f"{used.max()} of cap {worst[1]}, move {move[worst[0]]}, at {tau[worst[0]]} s"


def some(number: int, of_test: Container[int]) -> object:
    return pytest.param(number, marks=[] if number in of_test else [pytest.mark.soak])


@pytest.mark.parametrize("number", [some(number, IN_TEST) for number in range(IN_ALL)])
def test_random_sequence_keeps_its_limits_and_its_geometry(number: int) -> None:
    moves, motion = planned(number)
    assert_joints_inside_limits(motion)
    assert_smooth_and_at_rest(motion)
    moves = stopping_as(motion, moves)
    commanded = curves(MODEL, moves, START)
    taus = outside_of_corners(moves, commanded, motion, each=12)
    assert_flange_inside_its_speeds(moves, motion, taus)
    assert_flange_inside_its_acceleration_and_jerk(moves, motion)
    away, told = deviations_m(commanded, motion, taus), blended_m(commanded, motion)
    assert (told <= 1e-4).all()
    assert (away < told + 10e-6).all()


@pytest.mark.parametrize("number", [some(number, DECORATED_IN_TEST) for number in range(DECORATED_IN_ALL)])
def test_random_sequence_keeps_its_caps_and_limits_everywhere(number: int) -> None:
    moves, motion = planned(number, decorated)
    assert_joints_inside_limits(motion)
    assert_smooth_and_at_rest(motion)
    assert_caps_kept_at_every_millisecond(moves, motion)


def quickest(path: JointPath, shape: bool) -> float:
    """Duration [s] under limits of speed and acceleration.

    With `shape` also below the speed at which the path's own shape takes all of the jerk: its third derivative times
    the cube of the speed.
    """
    grid = np.linspace(0.0, path.length, int(800 + 1600 * path.length))
    rows = PathLimits(path, LIMITS).rows(grid)
    rows = rows if shape else replace(rows, third_jerk=np.zeros_like(rows.third_jerk))
    return float(times(grid, fastest_speeds(grid, rows))[-1])


def durations(number: int) -> np.ndarray | None:
    """What a sequence takes [s], less a/j for each start and stop; and `quickest` without and with the path's shape.

    None if it leads out of reach.
    """
    try:
        runs = [run for run in _Paths(MODEL, sequence(number), LIMITS).runs(START) if isinstance(run, JointPath)]
    except PlanError:
        return None
    lasts = sum(timed.pieces.duration_s - 2.0 * BUILD_S for timed in in_time(MODEL, runs, LIMITS))
    return np.array([lasts, *[sum(quickest(run, shape) for run in runs) for shape in (False, True)]])


@pytest.mark.parametrize("number", [some(number, range(6, 53, 7)) for number in SLOWER])
def test_limits_of_jerk_cost_little_more_than_starts_stops_and_the_shape_of_the_path(number: int) -> None:
    """49 of the 50 are within 1.15 of the time without jerk; by the shape of the path all are within 1.04.

    At a constant speed v a path with third derivative d already needs the jerk d v^3. For the one that is slower the
    speed at which that is all of the jerk makes the bound 1.17 times as long.
    """
    found = durations(number)
    assert found is not None
    slower = found[0] / found[1]
    assert slower <= WORSE * SLOWER[number]
    assert slower <= 1.15 or (number == 27 and found[2] > 1.15 * found[1])
    assert found[0] <= 1.04 * found[2]
