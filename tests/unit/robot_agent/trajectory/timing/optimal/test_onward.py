"""Motions that are extended while they run: the same state at the splice, within all limits, never a stop."""

from dataclasses import replace

import numpy as np
import pytest

from cell.geometry import from_xyz_abc
from robot_agent.model.description import ProfileKind, Shaping
from robot_agent.paths import Arc, JointMove, Line, Move, Passing, Sequence, Spline
from robot_agent.trajectory import Limits, Motion, PlanError, plan, spliced
from robot_agent.trajectory.timing.gaussian_window import gaussian_weights, window_cells
from tests.unit.six_axis_arm import arm, description
from tests.unit.tcp_shares import tcp_shares

ARM = arm()
LIMITS = Limits.of(description())
START = np.array([0.3, 0.2, 0.3, 0.1, 0.9, 0.2])
AHEAD = 3
WORSE = 0.005
"""Relative: what a search may take more where the nodes of the path are others."""


def beside(x: float, y: float) -> np.ndarray:
    pose = ARM.forward(START)
    pose[:3, 3] += (x, y, 0.0)
    return pose


def loop(length: float, radius: float, speed: float) -> list[Line | Arc]:
    """Two lines and two half circles around (-radius, length / 2), from the arm's start."""
    return [
        Line(beside(0, length), speed, 1),
        Arc(beside(-radius, length + radius), beside(-2 * radius, length), 2, speed_m_s=speed),
        Line(beside(-2 * radius, 0), speed, 3),
        Arc(beside(-radius, -radius), beside(0, 0), 4, speed_m_s=speed),
    ]


def planned(*moves: Move, limits: Limits = LIMITS) -> Motion:
    return plan(ARM, Sequence(moves), limits, start=START)


def extended(motion: Motion, tau: float, *moves: Move, limits: Limits = LIMITS) -> Motion:
    return plan(ARM, Sequence(moves), limits, start=motion.state(tau))


def assert_same_state(before: Motion, tau: float, after: Motion) -> None:
    at, begin = np.array(tau), np.array(0.0)
    np.testing.assert_allclose(after.q(begin), before.q(at), atol=1e-9)
    np.testing.assert_allclose(after.qd(begin), before.qd(at), atol=1e-9)
    np.testing.assert_allclose(after.qdd(begin), before.qdd(at), atol=1e-8)


def assert_within(q: np.ndarray, dt: float, limits: Limits) -> None:
    for order, limit in enumerate((limits.velocity, limits.acceleration, limits.jerk), 1):
        assert (np.abs(np.diff(q, order, axis=0)).max(axis=0) / dt**order <= 1.001 * limit + 1e-4).all(), order


def distance_from_loop(places: np.ndarray, length: float, radius: float) -> np.ndarray:
    """Of the flange `(k, 3)` from the programmed curve, in closed form: a stadium is all at one distance of a line."""
    x, y, z = (places - ARM.forward(START)[:3, 3]).T
    across = np.hypot(x + radius, y - np.clip(y, 0.0, length))
    return np.asarray(np.hypot(across - radius, z))


@pytest.mark.parametrize(("speed", "moves"), [(0.25, 12), (2.0, 24)], ids=["at-its-cap", "at-the-joints-limits"])
def test_endless_loop_with_three_blocks_of_look_ahead_never_stops(speed: float, moves: int) -> None:
    length, radius = 0.2, 0.08
    around = loop(length, radius, speed)
    motion, passed, speeds, dt = planned(*around[:AHEAD]), [], [], 0.002
    for number in range(AHEAD, moves):
        # after the middle of the move after the first, on a tick: the move under way and two others are known
        first = motion.ends[0] if len(motion.ends) > AHEAD else 0.0
        tau = np.ceil((first + motion.ends[-AHEAD]) / 2.0 / dt) * dt
        longer = extended(motion, tau, around[number % 4])
        assert_same_state(motion, tau, longer)
        assert len(longer.rests) == 2
        assert (longer.pieces.peaks() <= 1.001 * np.stack([LIMITS.velocity, LIMITS.acceleration, LIMITS.jerk])).all()
        assert tcp_shares(longer, LIMITS.path, [True] * len(longer.ends), every_s=dt).max() <= 1.001
        driven = np.arange(round(tau / dt)) * dt
        passed.append(motion.q(driven))
        speeds.append(motion.tcp_speed(driven))
        motion = longer
    q, moving = np.concatenate(passed), np.concatenate(speeds)
    assert_within(q, dt, LIMITS)
    assert moving[100:].min() > 0.2
    assert moving.max() <= 1.001 * min(speed, LIMITS.path.speed_m_s)
    assert distance_from_loop(ARM.forward(q)[:, :3, 3], length, radius).max() < 1.02e-4


def test_the_old_motion_stays_and_the_new_one_has_its_unfinished_blocks_first() -> None:
    moves = loop(0.2, 0.08, 0.25)
    motion = planned(*moves[:3])
    tau = float(motion.ends[0] + 0.1)
    longer = extended(motion, tau, moves[3])
    assert len(longer.ends) == 3
    assert longer.ends[0] == pytest.approx(motion.ends[1] - tau, abs=1e-3)
    np.testing.assert_allclose(motion.qd(np.array(motion.duration_s)), 0.0, atol=1e-12)
    np.testing.assert_allclose(longer.pose(np.array(longer.duration_s)), moves[3].target_pose, atol=1e-6)


def test_what_is_told_of_via_points_of_the_move_under_way_stays() -> None:
    points = np.tile(beside(0.0, 0.0), (3, 1, 1))
    points[:, 1, 3] += [0.05, 0.1, 0.15]
    points[1, :3, :3] = from_xyz_abc(np.array([0, 0, 0, 0, 0, 0.2]))[:3, :3] @ points[1, :3, :3]
    motion = planned(Spline(points, 1, 0.2))
    vias = [each for each in motion.transitions if each.before == each.move == 0]
    ahead = points[2].copy()
    ahead[2, 3] += 0.1
    longer = extended(motion, 0.3, Line(ahead, 0.2, 2))
    assert max(each.deviation_rad for each in vias) > 0.01
    for told in (longer.transitions, spliced(motion, 0.3, longer).transitions):
        assert set(vias) <= set(told)


@pytest.mark.parametrize("ahead", ["spline", "line", "arc", "joint move"])
def test_spline_that_is_led_towards_what_comes_is_the_same_curve_as_in_one_plan(ahead: str) -> None:
    point, corner, end = (beside(*place)[None] for place in ((0.05, 0.1), (0.0, 0.2), (0.1, 0.25)))
    following: dict[str, Move] = {
        "spline": Spline(end, 3, 0.2),
        "line": Line(end[0], 0.2, 3),
        "arc": Arc(beside(0.05, 0.2), end[0], 3, speed_m_s=0.2),
        "joint move": JointMove(START + np.array([0.4, 0.1, 0.0, 0.1, 0.0, 0.0]), 0.2, 3),
    }
    moves = Spline(point, 1, 0.2), Spline(corner, 2, 0.2), following[ahead]
    whole = planned(*moves)
    begun = plan(ARM, Sequence(moves[:2], beyond=moves[2:]), LIMITS, start=START)
    longer = spliced(begun, 0.5, extended(begun, 0.5, moves[2]))
    assert len(longer.rests) == len(whole.rests) == 2
    known, found = (each.pose(np.linspace(0.0, each.duration_s, 10_001))[:, :3, 3] for each in (whole, longer))
    away = np.linalg.norm(found[::100, None] - known, axis=2).min(axis=1)
    assert away.max() < 2.5e-4  # the border is blended once here and once there, by 0.1 mm at most


def test_spline_does_not_mind_what_comes_where_that_cannot_be_planned() -> None:
    bend = Spline(beside(0.05, 0.1)[None], 1, 0.2)
    nowhere = Arc(beside(0.05, 0.2), beside(0.05, 0.3), 2)  # three points on one line
    led = plan(ARM, Sequence([bend], beyond=[nowhere]), LIMITS, start=START)
    np.testing.assert_array_equal(led.pieces.coefficients, planned(bend).pieces.coefficients)


def test_splices_are_the_old_motion_up_to_them_and_the_new_one_behind() -> None:
    """Of motions that are spliced themselves, too, and without what lies before `first`."""
    moves = loop(0.1, 0.05, 0.25)
    whole, at, first = planned(*moves[:3]), 0.7, 0.4
    for number in range(3, 8):
        onward = extended(whole, at, moves[number % 4])
        longer = spliced(whole, at, onward, first)
        before, behind = np.linspace(first, at, 20), np.linspace(0.0, onward.duration_s, 20)
        for value in (Motion.q, Motion.qd, Motion.qdd):
            np.testing.assert_allclose(value(longer, before[1:-1] - first), value(whole, before[1:-1]), atol=1e-9)
            np.testing.assert_allclose(value(longer, behind[1:] + at - first), value(onward, behind[1:]), atol=1e-9)
        ended = whole.ends[(whole.ends > first) & (whole.ends <= at)]
        np.testing.assert_allclose(longer.ends, [*ended - first, *onward.ends + at - first], atol=1e-9)
        assert (np.diff(longer.ends) > 0.1).all()
        assert len(longer.rests) == 2
        borders = [(each.before, each.move) for each in longer.transitions]
        assert borders == [(k, k + 1) for k in range(len(longer.ends) - 1)]
        whole, at, first = longer, float(longer.ends[-2]) - 0.1, 0.3


def test_corner_behind_the_old_end_is_a_stop_or_round_as_programmed() -> None:
    first, aside = Line(beside(0, 0.2), 0.25, 1), Line(beside(0.2, 0.2), 0.25, 2)
    sharp = planned(first)
    stopped = extended(sharp, 0.5, aside)
    assert_same_state(sharp, 0.5, stopped)
    np.testing.assert_allclose(stopped.pose(stopped.rests[1:2])[0, :3, 3], beside(0, 0.2)[:3, 3], atol=1e-6)
    (stop,) = stopped.transitions
    assert (stop.before, stop.move, stop.passing) == (0, 1, Passing.STOPS)
    assert stop.reason == "the path turns by 90.0 deg; there is no round edge"
    rounded = planned(replace(first, round_m=0.02))
    flowing = extended(rounded, 0.5, aside)
    assert_same_state(rounded, 0.5, flowing)
    assert len(flowing.rests) == 2


def test_joint_moves_go_on_while_the_last_one_already_brakes() -> None:
    way = np.array([0.2, 0.1, -0.1, 0.3, 0.1, 0.2])
    motion = planned(JointMove(START + way, 0.5, 1))
    tau = motion.duration_s - 0.2
    longer = extended(motion, tau, JointMove(START + 2.0 * way, 0.5, 2))
    assert_same_state(motion, tau, longer)
    assert len(longer.rests) == 2
    assert_within(longer.q(np.arange(0.0, longer.duration_s, 0.002, dtype=np.float64)), 0.002, LIMITS)


def test_state_at_rest_is_a_beginning_like_any_other() -> None:
    first, second, third = loop(0.2, 0.08, 0.25)[:3]
    motion, whole = planned(first, second), planned(first, second, third)
    from_start = extended(motion, 0.0, third)
    np.testing.assert_allclose(from_start.ends, whole.ends, rtol=WORSE)
    behind = plan(ARM, Sequence([third]), LIMITS, start=motion.q(np.array(motion.duration_s)))
    for tau in (motion.duration_s, 99.0):
        from_end = extended(motion, tau, third)
        np.testing.assert_allclose(from_end.ends, behind.ends, atol=1e-6)
        np.testing.assert_allclose(from_end.rests, behind.rests, atol=1e-6)


@pytest.mark.parametrize("tau", [0.0, 0.3, 1.0])
def test_what_lies_before_the_last_rest_stays_as_it_is(tau: float) -> None:
    motion = planned(Line(beside(0, 0.2), 0.25, 1), Line(beside(0.2, 0.2), 0.25, 2))
    rest, further = motion.rests[1], Line(beside(0.3, 0.2), 0.25, 3)
    assert rest < 1.0 + 0.1
    longer = extended(motion, tau, further)
    assert_same_state(motion, tau, longer)
    assert len(longer.ends) == 3 - (motion.ends[0] <= tau)
    kept = np.arange(0.0, max(rest - tau, 0.0), 0.01, dtype=np.float64)
    np.testing.assert_allclose(longer.q(kept), motion.q(kept + tau), atol=1e-9)
    assert len(longer.rests) == len(motion.rests) - (motion.rests[1] <= tau)


@pytest.mark.parametrize(("left_s", "rests"), [(0.699, 2), (0.05, 3), (0.001, 3)])
def test_first_and_last_moments_of_a_move_can_be_gone_on_from(left_s: float, rests: int) -> None:
    """While the last ramp of braking ends there is no way but to rest first."""
    motion = planned(Line(beside(0, 0.2), 0.4, 1))
    tau = motion.duration_s - left_s
    longer = extended(motion, tau, Line(beside(0, 0.4), 0.4, 2))
    assert len(longer.rests) == rests
    (border,) = longer.transitions
    assert ("no timing" in border.reason) is (border.passing is Passing.STOPS) is (rests == 3)
    assert_same_state(motion, tau, longer)
    assert_within(longer.q(np.arange(0.0, longer.duration_s, 0.002, dtype=np.float64)), 0.002, LIMITS)
    np.testing.assert_allclose(longer.pose(np.array(longer.duration_s)), beside(0, 0.4), atol=1e-6)


@pytest.mark.parametrize(
    ("shaping", "speed"),
    [(Shaping(filter_s=0.02), 2.0), (Shaping(ProfileKind.TRAPEZOIDAL, 0.1), 0.25)],
    ids=["at-the-joints-limits", "trapezoids-at-its-cap"],
)
def test_endless_loop_behind_a_filter_never_stops_and_what_is_sent_is_the_mean_of_what_was_planned(
    shaping: Shaping, speed: float
) -> None:
    length, radius, limits, dt = 0.2, 0.08, replace(LIMITS, shaping=shaping), 0.002
    around = loop(length, radius, speed)
    motion, passed, away_m = planned(*around[:AHEAD], limits=limits), [], 0.0
    for number in range(AHEAD, 9):
        first = motion.ends[0] if len(motion.ends) > AHEAD else 0.0
        tau = np.ceil((first + motion.ends[-AHEAD]) / 2.0 / dt) * dt
        longer = extended(motion, tau, around[number % 4], limits=limits)
        assert_same_state(motion, tau, longer)
        assert len(longer.rests) == 2
        passed.append(motion.q(np.arange(round(tau / dt)) * dt))
        away_m = max(away_m, motion.filter_deviation_m)
        motion = longer
    q = np.concatenate([*passed, motion.q(np.arange(0.0, motion.duration_s, dt))])
    assert_within(q, dt, limits)
    places = ARM.forward(q)[:, :3, 3]
    speeds = np.linalg.norm(np.diff(places, axis=0), axis=1)[150:-300] / dt
    assert speeds.min() > 0.2
    assert speeds.max() <= 1.001 * min(speed, LIMITS.path.speed_m_s)
    assert distance_from_loop(places, length, radius).max() < 1.02e-4 + away_m
    run = motion.last
    assert run is not None
    raw = run.raw
    assert raw is not None
    taus = np.linspace(run.begins, motion.duration_s, 40)
    weights = gaussian_weights(window_cells(raw.window_s))
    shares = (np.arange(16 * len(weights)) + 0.5) / (16 * len(weights)) * raw.window_s
    own = raw.lead_s + (taus - run.begins) / raw.slower
    mean = np.einsum("s,tsj->tj", np.repeat(weights, 16) / 16.0, raw.pieces.position(own[:, None] - shares))
    np.testing.assert_allclose(motion.q(taus), mean, atol=1e-6)


@pytest.mark.parametrize("filter_s", [(0.02, 0.0), (0.0, 0.02), (0.0, 0.0)])
def test_where_another_filter_begins_and_behind_joints_that_go_by_themselves_the_robot_rests_first(
    filter_s: tuple[float, float],
) -> None:
    before, after = (replace(LIMITS, shaping=Shaping(filter_s=each)) for each in filter_s)
    first = Line(beside(0, 0.2), 0.4, 1) if any(filter_s) else JointMove(START + 0.2, 1.0, 1, synchronised=False)
    motion = planned(first, limits=before)
    longer = extended(motion, 0.2, Line(beside(0, 0.4), 0.4, 2), limits=after)
    assert_same_state(motion, 0.2, longer)
    end = motion.duration_s - 0.2
    np.testing.assert_allclose(longer.rests[:2], [0.0, end], atol=1e-9)
    np.testing.assert_allclose(longer.q(np.array(end)), motion.q(np.array(motion.duration_s)), atol=1e-9)
    np.testing.assert_allclose(longer.pose(np.array(longer.duration_s)), beside(0, 0.4), atol=1e-6)
    stops = [(each.before, each.move, each.reason) for each in longer.transitions]
    assert stops == ([] if any(filter_s) else [(0, 1, "where joints are not in step each arrives by itself")])


def test_limits_that_are_lower_than_the_state_uses_are_a_plan_error() -> None:
    motion = planned(Line(beside(0, 0.2), None, 1))
    weak = replace(LIMITS, velocity=LIMITS.velocity * 0.1)
    with pytest.raises(PlanError, match=r"line 2.*do not keep these limits"):
        extended(motion, motion.duration_s / 2.0, Line(beside(0, 0.4), None, 2), limits=weak)
