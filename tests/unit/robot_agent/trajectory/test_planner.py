"""Planned motions: on their geometry, inside every limit, at rest at both ends, and clear words where that fails."""

import pickle
from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cell.geometry import from_xyz_abc
from robot_agent.model.description import JointLimits, PathSpeeds
from robot_agent.paths import Arc, JointMove, Line, LineGeometry, Move, Sequence, Spline
from robot_agent.trajectory import Limits, Motion, PlanError, plan, s_curve
from robot_agent.trajectory.joints import follow
from tests.unit.six_axis_arm import arm, description

ARM = arm()
LIMITS = Limits.of(description())
START = np.array([0.3, 0.2, 0.3, 0.1, 0.9, 0.2])
OFFSET = st.tuples(*[st.floats(-0.2, 0.2)] * 3)
TURN = st.tuples(*[st.floats(-0.4, 0.4)] * 3)


def moved(offset: tuple[float, ...], turn: tuple[float, ...] = (0.0, 0.0, 0.0)) -> np.ndarray:
    start, target = ARM.forward(START), np.eye(4)
    target[:3, :3] = from_xyz_abc(np.array([0.0, 0.0, 0.0, *turn]))[:3, :3] @ start[:3, :3]
    target[:3, 3] = start[:3, 3] + offset
    return target


def planned(*moves: Move, limits: Limits = LIMITS) -> Motion:
    return plan(ARM, Sequence(moves), limits, start=START)


def assert_inside_limits(motion: Motion, limits: Limits = LIMITS) -> None:
    q, dt = motion.q(np.arange(-3, int(motion.duration_s / 0.004) + 5) * 0.004), 0.004
    for order, limit in enumerate((limits.velocity, limits.acceleration, limits.jerk), 1):
        assert (np.abs(np.diff(q, order, axis=0)).max(axis=0) / dt**order <= 1.001 * limit + 1e-4).all(), order
    peaks = motion.pieces.peaks()
    assert (peaks <= 1.001 * np.stack([limits.velocity, limits.acceleration, limits.jerk])).all()


@settings(max_examples=40, deadline=None)
@given(st.tuples(*[st.floats(-1.5, 1.5)] * 6), st.floats(0.05, 1.0))
def test_joint_move_is_synchronised_inside_limits_and_ends_in_its_target(
    target: tuple[float, ...], speed: float
) -> None:
    motion = planned(JointMove(np.array(target), speed, 1))
    assert_inside_limits(motion)
    np.testing.assert_allclose(motion.q(np.array(motion.duration_s)), target, atol=1e-12)
    whole = np.array(target) - START
    way = motion.q(motion.grid) - START
    leading = np.abs(whole).argmax()
    np.testing.assert_allclose(way * whole[leading], np.outer(way[:, leading], whole), atol=1e-5)


def test_joint_move_keeps_the_limit_of_each_direction() -> None:
    weak = replace(LIMITS, acceleration_down=np.full(6, 3.0))
    motion = planned(JointMove(START + np.array([0.1, -1.2, 0.2, 0, 0, 0.3]), 1.0, 1), limits=weak)
    used = motion.pieces.inside(5)[1]
    assert used.min() >= -3.003
    assert used.max() > 3.5
    alone = planned(JointMove(START + np.array([0, -1.2, 0, 0, 0, 0]), 1.0, 1), limits=weak)
    bounds = (-3.0, LIMITS.acceleration[1])
    assert alone.duration_s == pytest.approx(s_curve(-1.2, LIMITS.velocity[1], bounds, LIMITS.jerk[1]).duration_s)


def test_joint_move_takes_as_long_as_the_slowest_joint_alone() -> None:
    motion = planned(JointMove(START + np.array([0.1, -1.2, 0.2, 0, 0, 0.3]), 1.0, 1))
    assert motion.duration_s == pytest.approx(s_curve(1.2, 2.0, 8.0, 60.0).duration_s, rel=1e-12)


@settings(max_examples=25, deadline=None)
@given(OFFSET, TURN, st.sampled_from([None, 0.05, 0.4]))
def test_line_stays_on_its_geometry_inside_all_limits(
    offset: tuple[float, ...], turn: tuple[float, ...], speed: float | None
) -> None:
    target = moved(offset, turn)
    motion = planned(Line(target, speed, 1))
    assert_inside_limits(motion)
    line = LineGeometry.between(ARM.forward(START), target)
    poses = motion.pose(np.linspace(0.0, motion.duration_s, 501))
    if line.length_m > 1e-4:
        turns = np.array([pin.log3(pose[:3, :3] @ poses[0, :3, :3].T) for pose in poses])
        ways = np.hstack([poses[:, :3, 3] - poses[0, :3, 3], turns])
        twist = np.concatenate([line.displacement, line.angle * line.axis])
        along = ways @ twist / (twist @ twist)
        np.testing.assert_allclose(poses, line.poses(along), atol=1e-6)
        assert motion.tcp_speed(motion.grid).max() <= (speed or LIMITS.path.speed_m_s) * 1.001
    np.testing.assert_allclose(motion.pose(np.array(motion.duration_s)), target, atol=1e-9)


def test_line_that_no_joint_slows_down_takes_as_long_as_its_s_curve() -> None:
    generous = replace(LIMITS, velocity=np.full(6, 50.0), acceleration=np.full(6, 500.0), jerk=np.full(6, 5e4))
    motion = planned(Line(moved((0.1, 0.1, -0.1)), 0.5, 1), limits=generous)
    assert motion.duration_s == pytest.approx(s_curve(np.sqrt(0.03), 0.5, 4.0, 40.0).duration_s, rel=1e-9)


def test_joints_slow_a_line_down_no_more_than_they_must() -> None:
    weak = replace(LIMITS, velocity=np.full(6, 0.5), acceleration=np.full(6, 2.0), jerk=np.full(6, 10.0))
    motion = planned(Line(moved((0.2, 0.5, -0.2)), None, 1), limits=weak)
    peaks = motion.pieces.peaks() / np.stack([weak.velocity, weak.acceleration, weak.jerk])
    assert peaks.max() == pytest.approx(1.0, abs=2e-3)


def test_motion_is_at_rest_between_its_blocks() -> None:
    there, aside = Line(moved((0.1, 0.0, 0.0)), None, 10), Line(moved((0.0, 0.1, 0.0)), 0.1, 12)
    motion = planned(there, JointMove(START, 0.5, 11), aside)
    assert len(motion.ends) == 3
    np.testing.assert_array_equal(motion.move_at(np.append(0.0, motion.ends)), [0, 0, 1, 2])
    np.testing.assert_allclose(motion.qd(motion.rests), 0.0, atol=1e-9)
    np.testing.assert_allclose(motion.qdd(motion.rests), 0.0, atol=1e-6)
    assert_inside_limits(motion)


def test_velocity_and_acceleration_are_the_derivatives_of_the_joints() -> None:
    motion, h = planned(Line(moved((0.1, 0.1, 0.0), (0.2, 0.0, 0.3)), None, 1)), 1e-5
    tau = np.linspace(0.1, motion.duration_s - 0.1, 7)
    np.testing.assert_allclose(motion.qd(tau), (motion.q(tau + h) - motion.q(tau - h)) / (2 * h), atol=1e-6)
    np.testing.assert_allclose(motion.qdd(tau), (motion.qd(tau + h) - motion.qd(tau - h)) / (2 * h), atol=1e-4)


@pytest.mark.parametrize("move", [JointMove(START, 1.0, 1), Line(ARM.forward(START), None, 1)], ids=["joint", "line"])
def test_move_of_no_length_is_a_no_op(move: JointMove | Line) -> None:
    motion = planned(move)
    assert motion.duration_s == 0.0
    np.testing.assert_allclose(motion.q(motion.grid), np.tile(START, (2, 1)), atol=1e-12)
    assert planned(move, JointMove(START + 0.1, 1.0, 2)).duration_s > 0.0


def test_turn_on_the_spot_keeps_the_angular_limits() -> None:
    motion = planned(Line(moved((0.0, 0.0, 0.0), (0.5, 0.0, 0.0)), None, 1))
    q, qd = motion.q(motion.grid), motion.qd(motion.grid)
    angular = (ARM.jacobian(q)[:, 3:] @ qd[..., None])[..., 0]
    assert np.linalg.norm(angular, axis=1).max() <= LIMITS.path.angular_speed_rad_s * 1.0001


def test_motion_travels_between_processes() -> None:
    motion = planned(Line(moved((0.1, 0.0, 0.0)), None, 1))
    copy = pickle.loads(pickle.dumps(motion))
    np.testing.assert_array_equal(copy.q(motion.grid), motion.q(motion.grid))


class TestWristSingularity:
    """The line X = 1755, Y from -150 to 150, of the textbook's arm: J5 is nearly 0 in its middle."""

    def line(self, z: float) -> tuple[np.ndarray, Line]:
        first, last = np.eye(4), np.eye(4)
        first[:3, 3], last[:3, 3] = (1.755, -0.15, z), (1.755, 0.15, z)
        start = ARM.solve(first, near=np.radians([-5.0, 0.0, 0.0, 90.0, 5.0, -90.0]))
        return start, Line(last, 0.1, 5)

    @pytest.mark.parametrize(
        ("z", "slowest", "duration"),
        [
            (2.65, 0.042679, 3.23189),
            (2.64, 0.085265, 3.02516),
            (2.659, 0.0042722, 3.73872),
            (2.6, 0.1, 3.0),
        ],
    )
    def test_near_it_the_line_is_as_fast_as_the_wrist_allows(self, z: float, slowest: float, duration: float) -> None:
        lifted = PathSpeeds(1.0, 1e3, 1e6, 10.0, 1e3, 1e6)
        free = replace(
            LIMITS, velocity=np.full(6, np.pi), acceleration=np.full(6, 1e3), jerk=np.full(6, 1e6), path=lifted
        )
        start, line = self.line(z)
        motion = plan(arm(position_deg=720.0), Sequence([line]), free, start=start)
        inside = np.linspace(0.3, motion.duration_s - 0.3, 4001)
        assert motion.tcp_speed(inside).min() == pytest.approx(slowest, rel=5e-3)
        assert motion.duration_s == pytest.approx(duration, rel=1e-2)

    def test_a_hair_beside_it_the_motion_slows_down_and_never_stalls(self) -> None:
        start, line = self.line(2.65999)
        motion = plan(arm(position_deg=720.0), Sequence([line]), LIMITS, start=start)
        assert_inside_limits(motion)
        assert motion.duration_s < 10.0

    def test_through_it_planning_fails_and_says_where_and_what_to_do(self) -> None:
        start, line = self.line(2.66)
        with pytest.raises(PlanError, match=r"line 5.*use a joint move") as caught:
            plan(arm(position_deg=720.0), Sequence([line]), LIMITS, start=start)
        assert (caught.value.move, caught.value.joint, caught.value.limit) == (0, "J4", "velocity")
        assert caught.value.pose is not None
        assert abs(caught.value.pose[1, 3]) < 0.02

    def test_through_it_the_wrist_may_flip_when_it_is_allowed_to(self) -> None:
        start, line = self.line(2.66)
        flipping = replace(line, wrist_may_flip=True)
        motion = plan(arm(position_deg=720.0), Sequence([flipping]), LIMITS, start=start)
        assert_inside_limits(motion)
        assert motion.duration_s == pytest.approx(s_curve(0.3, 0.1, 4.0, 40.0).duration_s, rel=1e-2)
        bend = motion.q(np.array([0.0, motion.duration_s]))[:, 4]
        assert bend[0] * bend[1] < 0.0
        poses = motion.pose(motion.grid)
        np.testing.assert_allclose(poses[:, [0, 2], 3], [[1.755, 2.66]] * len(poses), atol=1e-5)

    @pytest.mark.parametrize(("beside_m", "flips"), [(3e-8, False), (1e-6, False), (3e-6, True)])
    def test_beside_it_the_motion_lasts_no_longer_than_the_wrist_needs(self, beside_m: float, flips: bool) -> None:
        """Of half a turn within a hair, to one side of the middle: J4 needs less than 3 s for it."""
        _, line = self.line(2.66 + beside_m)
        first = line.target_pose.copy()
        first[1, 3] = -0.137
        start = ARM.solve(first, near=np.radians([-5.0, 0.0, 0.0, 90.0, 5.0, -90.0]))
        flipping = replace(line, wrist_may_flip=flips)
        motion = plan(arm(position_deg=720.0), Sequence([flipping]), LIMITS, start=start)
        assert_inside_limits(motion)
        assert motion.duration_s < 6.2
        poses = motion.pose(motion.grid)
        np.testing.assert_allclose(poses[:, [0, 2], 3], [[1.755, 2.66 + beside_m]] * len(poses), atol=1e-5)

    @pytest.mark.parametrize("name", ["J4", "J6"])
    def test_a_line_that_begins_in_the_singular_pose_names_the_joint_that_would_have_to_turn(self, name: str) -> None:
        target = ARM.forward(np.zeros(6))
        target[0, 3] -= 0.05
        limits = replace(LIMITS, velocity=np.where(np.array(ARM.joint_names) == name, 1.0, 2.0))
        with pytest.raises(PlanError, match=f"joint {name} would have to turn instantly") as caught:
            plan(ARM, Sequence([Line(target, None, 5)]), limits, start=np.zeros(6))
        assert (caught.value.joint, caught.value.limit) == (name, "velocity")

    def part(self, y: float, flips: bool) -> Line:
        _, line = self.line(2.66)
        pose = line.target_pose.copy()
        pose[1, 3] = y
        return replace(line, target_pose=pose, wrist_may_flip=flips)

    @pytest.mark.parametrize("flips", [[True, False], [False, True, False]])
    def test_a_line_that_goes_on_beside_one_that_may_flip_is_passed_without_a_stop(self, flips: list[bool]) -> None:
        ends = np.linspace(-0.15, 0.15, 2 + len(flips))[2:]
        ends[0] = 0.06 if flips[0] else -0.06
        start, _ = self.line(2.66)
        moves = [self.part(y, flip) for y, flip in zip(ends, flips, strict=True)]
        motion = plan(arm(position_deg=720.0), Sequence(moves), LIMITS, start=start)
        assert_inside_limits(motion)
        np.testing.assert_array_equal(motion.rests, [0.0, motion.duration_s])
        np.testing.assert_allclose(motion.pose(motion.grid)[:, [0, 2], 3] - [1.755, 2.66], 0.0, atol=1e-5)

    def test_only_the_line_that_asks_for_it_may_flip(self) -> None:
        start, _ = self.line(2.66)
        moves = [self.part(-0.06, True), self.part(0.06, False), self.part(0.15, True)]
        with pytest.raises(PlanError, match="use a joint move") as caught:
            plan(arm(position_deg=720.0), Sequence(moves), LIMITS, start=start)
        assert caught.value.move == 1


def test_target_outside_a_joints_range_is_named() -> None:
    with pytest.raises(PlanError, match=r"joint J3 would need 229.18 deg, allowed -180.00 to") as caught:
        planned(JointMove(START, 1.0, 3), JointMove(np.array([0, 0, 4.0, 0, 0, 0]), 1.0, 4))
    assert (caught.value.move, caught.value.line, caught.value.joint, caught.value.limit) == (1, 4, "J3", "position")


def test_joint_that_stands_outside_its_range_may_stay_and_may_come_back() -> None:
    outside = START + np.array([0.0, 0.0, 3.0, 0.0, 0.0, 0.0])
    stay, back = JointMove(outside, 1.0, 1), JointMove(START, 1.0, 2)
    assert plan(ARM, Sequence([stay]), LIMITS, start=outside).duration_s == 0.0
    assert plan(ARM, Sequence([back]), LIMITS, start=outside).duration_s > 0.0


class Gantry:
    """Three linear axes: the smallest robot that has fewer joints than a pose has degrees of freedom."""

    n, joint_names = 3, ("X", "Y", "Z")
    linear, reach_m = np.ones(3, dtype=bool), 9.0
    limits = JointLimits(np.array([[-5.0, 5.0]] * 3), np.full(3, 1.0), np.full(3, 5.0), np.full(3, 50.0), 1.5)

    def forward(self, q: np.ndarray) -> np.ndarray:
        poses = np.broadcast_to(np.eye(4), (*q.shape[:-1], 4, 4)).copy()
        poses[..., :3, 3] = q
        return poses

    def jacobian(self, q: np.ndarray) -> np.ndarray:
        return np.broadcast_to(np.eye(6)[:, :3], (*q.shape[:-1], 6, 3))

    def jacobian_derivative(self, _q: np.ndarray, qd: np.ndarray) -> np.ndarray:
        return np.zeros((*qd.shape[:-1], 6, 3))

    def track(self, poses: np.ndarray, start: np.ndarray) -> np.ndarray:
        return start + (poses[:, :3, 3] - poses[0, :3, 3])


def test_line_of_a_gantry_keeps_its_axes_limits() -> None:
    model, target = Gantry(), np.eye(4)
    target[:3, 3] = 0.0, 2.0, 0.5
    limits = Limits(model.limits.velocity, model.limits.acceleration, model.limits.jerk, LIMITS.path, 1.5)
    path = replace(limits.path, speed_m_s=10.0, acceleration_m_s2=100.0, jerk_m_s3=1e4)
    motion = plan(model, Sequence([Line(target, None, 1)]), replace(limits, path=path), start=np.zeros(3))
    np.testing.assert_allclose(motion.q(np.array(motion.duration_s)), target[:3, 3], atol=1e-12)
    assert motion.pieces.peaks()[0, 1] <= 1.0 + 1e-9
    np.testing.assert_allclose(motion.q(motion.grid) @ [1, 0.25, -1], 0.0, atol=1e-12)


def test_line_out_of_reach_is_a_plan_error_with_its_pose() -> None:
    with pytest.raises(PlanError, match=r"too far; move the line into the robot's reach") as caught:
        planned(Line(moved((3.0, 0.0, 0.0)), None, 8))
    assert caught.value.line == 8
    assert caught.value.pose is not None


@pytest.mark.parametrize("target", [np.zeros(5), np.full(6, np.nan)], ids=["five joints", "not a number"])
def test_target_that_is_no_joint_vector_is_refused(target: np.ndarray) -> None:
    with pytest.raises(PlanError, match="6 finite joint values"):
        planned(JointMove(target, 1.0, 1))


def test_a_path_that_would_need_joints_without_end_is_refused_where_they_are_missing(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(follow, "_TOLERANCE", 1e-17)  # nothing is as exact
    monkeypatch.setattr(follow, "_MOST_OF_ALL", 1000)
    monkeypatch.setattr(follow, "_ROUNDS", 1000)
    with pytest.raises(PlanError, match=r"line 4 at X .*cannot follow this path closely enough") as caught:
        planned(Line(moved((0.3, 0.6, -0.3), (0.3, 0.4, 0.3)), None, 4))
    assert caught.value.pose is not None


TURNED = moved((0.1, 0.0, 0.0))
MIRRORED = TURNED @ np.diag([-1.0, 1.0, 1.0, 1.0])


@pytest.mark.parametrize(
    ("move", "defect"),
    [
        (
            Line(TURNED @ np.diag([2.0, 2.0, 2.0, 1.0]), None, 4),
            "target_pose: the axes are not orthogonal",
        ),
        (Line(MIRRORED, None, 4), "target_pose: the axes are left-handed"),
        (Line(np.full((4, 4), np.nan), None, 4), "target_pose: a value is not finite"),
        (Line(np.eye(3), None, 4), "target_pose: found shape"),
        (Arc(MIRRORED, TURNED, 4), "via_pose: the axes are left-handed"),
        (Spline(np.stack([TURNED, MIRRORED]), 4), r"points\[1\]: the axes are left-handed"),
        (Spline(TURNED, 4), r"shape \(4, 4\); give"),
        (Spline(np.zeros((0, 4, 4)), 4), "at least one"),
    ],
)
def test_pose_that_no_flange_can_have_is_refused_by_name(move: Move, defect: str) -> None:
    with pytest.raises(PlanError, match=f"line 4: .*{defect}"):
        planned(move)


@pytest.mark.parametrize("start", [START[:5], np.append(START[:5], np.nan)], ids=["five joints", "not a number"])
def test_start_that_is_no_joint_vector_is_refused(start: np.ndarray) -> None:
    with pytest.raises(PlanError, match=r"line 1: the start .* is not 6 finite joint values"):
        plan(ARM, Sequence([JointMove(START, 1.0, 1)]), LIMITS, start=start)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("velocity", np.zeros(6)),
        ("jerk", np.full(6, np.inf)),
        ("acceleration_down", np.full(6, -1.0)),
        ("ramp_factor", 0.9),
    ],
)
def test_limits_within_which_nothing_can_move_are_refused_by_name(name: str, value: object) -> None:
    with pytest.raises(ValueError, match=f"limits: {name} .* found, allowed"):
        replace(LIMITS, **{name: value})


def test_a_period_that_is_none_is_refused() -> None:
    with pytest.raises(ValueError, match="cycle_s 0"):
        plan(ARM, Sequence([JointMove(START, 1.0, 1)]), LIMITS, start=START, cycle_s=0)


def test_error_travels_between_processes() -> None:
    error = PlanError(1, 2, "too fast", "go slower", joint="J1", limit="velocity", pose=np.eye(4))
    copy = pickle.loads(pickle.dumps(error))
    assert (str(copy), copy.joint, copy.line) == (str(error), "J1", 2)
