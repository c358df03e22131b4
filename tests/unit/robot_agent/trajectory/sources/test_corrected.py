"""A path with a live correction: it follows, keeps the limits, ends at rest in the world, and says why it stops."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robot_agent.kinematics import model_of
from robot_agent.model import Mounted
from robot_agent.paths import JointMove, Line, Sequence
from robot_agent.paths.caps import Tolerance
from robot_agent.trajectory import Governor, Motion, RateRequest, plan
from robot_agent.trajectory.sources import (
    Conveyor,
    CorrectedSource,
    CorrectionFrame,
    Target,
)
from tests.unit.repository import vectors
from tests.unit.robot_agent.trajectory.sources.corrected_moves import (
    ARM,
    CHANGES,
    CYCLE_S,
    FAST,
    LIMITS,
    NOMINAL,
    SLOW,
    START,
    STEP,
    line,
)
from tests.unit.robot_families import TORCH

BLOCK_S = STEP * CYCLE_S
COUNT_M = 1e-4


OUT = np.array([0.3, 0.55, -1.0, 0.09, 1.8, 0.3])
STRETCHED = plan(ARM, Sequence([JointMove(OUT + 0.2 * np.eye(6)[0], 0.3, 1)]), LIMITS, start=OUT, cycle_s=CYCLE_S)


class Followed:
    """Plays the source's blocks, each joined five ticks after the one before."""

    def __init__(
        self,
        motion: Motion = SLOW,
        frame: CorrectionFrame = CorrectionFrame.BASE,
    ) -> None:
        governor = Governor(motion, LIMITS, CYCLE_S, nominal_s=NOMINAL * CYCLE_S)
        self.motion = motion
        self.source = CorrectedSource(motion.model, LIMITS, governor, governor.rest(0.0), CHANGES, frame)
        self.played = [motion.q(np.array(0.0))] * 3
        self.taus = [0.0]
        self.ramp = self.source.brake()

    def block(self, target: Target, ticks: int = STEP) -> None:
        """Give the block for `target`, and play it for some ticks."""
        self.source.target = target
        given = self.source.samples(NOMINAL).then(self.source.brake())
        self.played += list(given.first(ticks).q)
        self.ramp = given.after(ticks)
        assert not given.qd[-1].any()
        assert not np.any(given.q[-1] != given.q[-2])
        self.source.resume(ticks)
        self.taus.append(self.source.tau)

    def shares(self) -> np.ndarray:
        """The largest shares of speed, ramp acceleration and ramp jerk in what was played and its ramp to rest."""
        q = np.concatenate([np.array(self.played), self.ramp.q])
        allowed = (LIMITS.velocity, LIMITS.ramp_acceleration_bounds[1], LIMITS.ramp_jerk)
        return np.array(
            [
                (np.abs(np.diff(q, order, axis=0)) / CYCLE_S**order / limit).max()
                for order, limit in enumerate(allowed, 1)
            ]
        )

    def places(self) -> np.ndarray:
        """TCP `(blocks, 3)` at the ticks where blocks were joined."""
        return np.asarray(self.motion.model.forward(np.array(self.played)[2::STEP])[:, :3, 3])

    def planned(self) -> np.ndarray:
        """Where the path alone would be there."""
        return np.asarray(self.motion.pose(np.array(self.taus))[:, :3, 3])


def test_without_a_correction_it_is_the_path() -> None:
    followed = Followed(FAST)
    for _ in range(60):
        followed.block(Target.none())
    np.testing.assert_allclose(followed.places(), followed.planned(), atol=1e-7)
    assert followed.taus[-1] == pytest.approx(60 * BLOCK_S)


def test_a_correction_that_turns_the_tool_turns_it_about_its_tcp() -> None:
    model = model_of(replace(ARM.description, tools={"torch": TORCH}, mounted=Mounted(("torch",))))
    target = model.forward(START).copy()
    target[:3, 3] += (0.05, 0.15, -0.1)
    motion = plan(model, Sequence([Line(target, 0.1, 1)]), LIMITS, start=START, cycle_s=CYCLE_S)
    followed = Followed(motion)
    for _ in range(80):
        followed.block(Target(np.array([0.0, 0.0, 0.0, 0.0, 0.1, 0.2]), np.zeros(6)))
    poses = ARM.links(np.array(followed.played)[2::STEP])[:, -1] @ TORCH.pose_flange_tcp
    np.testing.assert_allclose(poses[:, :3, 3], followed.planned(), atol=1e-5)
    turned = poses[-1, :3, :3] @ motion.pose(np.array(followed.taus[-1]))[:3, :3].T
    assert np.arccos((np.trace(turned) - 1.0) / 2.0) == pytest.approx(np.hypot(0.1, 0.2), abs=1e-3)


def test_lines_within_a_tolerance_are_followed_on_a_moving_conveyor() -> None:
    """Some 600 chords of a circle at their feed, as near to them as the tolerance and the belt's own lag allow."""
    turn, tolerance = np.arange(1, 629) * 0.01, Tolerance(5e-5, np.radians(0.5))
    poses = np.tile(ARM.forward(START), (628, 1, 1))
    poses[:, :3, 3] += 0.05 * np.stack([0.0 * turn, np.sin(turn), np.cos(turn) - 1.0], axis=1)
    lines = [Line(pose, 0.1, k + 1, tolerance=tolerance) for k, pose in enumerate(poses)]
    motion = plan(ARM, Sequence(lines), LIMITS, start=START, cycle_s=CYCLE_S)
    assert len(motion.rests) == 2
    conveyor = Conveyor("belt", np.eye(4), COUNT_M, settle_s=0.1, fresh_s=0.1, largest_speed_m_s=0.5)
    followed, blocks, belt_m_s = Followed(motion), 140, 0.08
    for k in range(blocks):
        at = k * BLOCK_S
        conveyor.measured(round(belt_m_s * at / COUNT_M) % 2**32, at)
        followed.block(conveyor.target(at))
    moved = np.outer(np.arange(blocks + 1) * BLOCK_S * belt_m_s, [1.0, 0.0, 0.0])
    places = (followed.places() - moved)[60:] - ARM.forward(START)[:3, 3] + [0.0, 0.0, 0.05]
    across = np.hypot(np.hypot(places[:, 1], places[:, 2]) - 0.05, places[:, 0])
    assert across.max() < tolerance.distance_m + 0.2e-3
    assert followed.taus[-1] - followed.taus[-41] == pytest.approx(40 * BLOCK_S, rel=1e-6)
    assert (followed.shares() < 1.01).all()


@pytest.mark.parametrize("belt_m_s", [0.08, -0.15])
def test_on_a_moving_conveyor_the_tool_keeps_to_the_moving_path_within_a_fifth_of_a_millimetre(belt_m_s: float) -> None:
    belt = np.eye(4)
    belt[:3, :3] = [[0, -1, 0], [1, 0, 0], [0, 0, 1]]
    conveyor = Conveyor("belt", belt, COUNT_M, settle_s=0.1, fresh_s=0.1, largest_speed_m_s=0.5)
    followed, blocks = Followed(), 150
    for k in range(blocks):
        at = k * BLOCK_S
        conveyor.measured(round(belt_m_s * at / COUNT_M) % 2**32, at)
        followed.block(conveyor.target(at))
    moved = np.outer(np.arange(blocks + 1) * BLOCK_S * belt_m_s, [0.0, 1.0, 0.0])
    away = np.linalg.norm(followed.places() - followed.planned() - moved, axis=1)
    assert away[60:].max() < 0.2e-3
    assert away[:60].max() > 1e-3
    assert (followed.shares() < 1.01).all()


def test_a_line_across_a_conveyor_takes_no_longer_and_its_tool_is_faster_than_the_line_asks_for() -> None:
    worked = vectors("paths.json")["conveyor"]
    belt_m_s, length = worked["belt"] / 1000.0, worked["length"] / 1000.0
    path = replace(LIMITS.path, acceleration_m_s2=worked["acceleration"] / 1000.0, jerk_m_s3=worked["jerk"] / 1000.0)
    start = np.array([-0.2, 0.0, 0.2, 0.0, 0.8, 0.0])
    first, last = ARM.forward(start).copy(), ARM.forward(start).copy()
    first[:3, 3] += 0.0, 0.0, -0.05
    last[:3, 3] += -length, 0.0, -0.05
    blocks = Sequence([Line(first, 0.06, 1), Line(last, worked["speed"] / 1000.0, 2)])
    motion = plan(ARM, blocks, replace(LIMITS, path=path), start=start, cycle_s=CYCLE_S)
    _, begins_s, ends_s = motion.rests
    assert ends_s - begins_s == pytest.approx(worked["duration_s"], abs=1e-6)
    belt = np.eye(4)
    belt[:3, :3] = [[0, -1, 0], [1, 0, 0], [0, 0, 1]]
    conveyor = Conveyor("belt", belt, COUNT_M, settle_s=0.1, fresh_s=0.1, largest_speed_m_s=0.5)
    followed, blocks_played = Followed(motion), int(ends_s / BLOCK_S)
    for k in range(blocks_played):
        at = k * BLOCK_S
        conveyor.measured(round(belt_m_s * at / COUNT_M), at)
        followed.block(conveyor.target(at))
    np.testing.assert_allclose(followed.taus, BLOCK_S * np.arange(blocks_played + 1), atol=1e-9)
    taus = np.array(followed.taus)
    inside = (taus >= begins_s) & (taus <= ends_s)
    beside = (followed.places() - followed.planned())[inside]
    way = (beside[-1] - beside[0]) / np.ptp(taus[inside]) * worked["duration_s"]
    np.testing.assert_allclose(1000.0 * way, [0.0, worked["extra"], 0.0], atol=0.1)
    places = np.asarray(ARM.forward(np.array(followed.played))[:, :3, 3])
    speeds = 1000.0 * np.linalg.norm(np.diff(places, axis=0), axis=1) / CYCLE_S
    assert speeds.max() == pytest.approx(worked["top_speed"], rel=1e-3)


def on_a_fast_belt(blocks: int) -> Followed:
    """Onto a line at 0.25 m/s and along it, on a belt of 0.2 m/s, at a tenth of the joints' speed."""
    path = replace(LIMITS.path, acceleration_m_s2=1.0, jerk_m_s3=10.0)
    ways = Sequence([line((0.0, 0.0, -0.05), 0.06), line((-0.3, 0.0, -0.05), 0.25)])
    followed = Followed(plan(ARM, ways, replace(LIMITS, path=path), start=START, cycle_s=CYCLE_S))
    speed = np.array([0, 0.2, 0, 0, 0, 0])
    for k in range(blocks):
        followed.block(Target(k * BLOCK_S * speed, speed))
    return followed


def test_the_ramps_of_path_and_correction_share_the_limits_so_the_path_does_not_wait_for_a_harmless_belt() -> None:
    followed = on_a_fast_belt(70)
    np.testing.assert_allclose(followed.taus, BLOCK_S * np.arange(71), atol=1e-9)
    assert (followed.shares() < 1.01).all()


def test_a_halt_on_a_belt_does_not_wait_for_the_end_of_the_block_before() -> None:
    followed = on_a_fast_belt(60)
    before = followed.ramp.count
    followed.source.requests = (RateRequest(0.0, "halted"),)
    followed.block(Target.none())
    assert followed.ramp.count < before - STEP - NOMINAL // 3
    assert (followed.shares() < 1.01).all()


def test_a_ramp_stops_in_the_world_although_the_conveyor_runs_on() -> None:
    followed = Followed()
    for k in range(80):
        followed.block(Target(np.array([0, 0.1 * k * BLOCK_S, 0, 0, 0, 0]), np.array([0, 0.1, 0, 0, 0, 0])))
    followed.source.requests = (RateRequest(0.0, "halted"),)
    for k in range(80, 110):
        followed.block(Target(np.array([0, 0.1 * k * BLOCK_S, 0, 0, 0, 0]), np.array([0, 0.1, 0, 0, 0, 0])))
    assert followed.source.ruled_by == "halted"
    np.testing.assert_array_equal(followed.played[-1], followed.played[-40])
    assert 0.0 < followed.source.tau < SLOW.duration_s


@pytest.mark.parametrize("frame", list(CorrectionFrame))
def test_an_offset_is_meant_in_its_frame(frame: CorrectionFrame) -> None:
    followed = Followed(FAST, frame)
    target = Target(np.array([0.01, 0.0, 0.02, 0.0, 0.0, 0.1]), np.zeros(6))
    for _ in range(110):
        followed.block(target)
    path, found = FAST.pose(np.array(FAST.duration_s)), ARM.forward(followed.played[-1])
    turn = np.array([[np.cos(0.1), -np.sin(0.1), 0], [np.sin(0.1), np.cos(0.1), 0], [0, 0, 1]])
    in_tool = frame is CorrectionFrame.TOOL
    moved = target.offset[:3] if not in_tool else path[:3, :3] @ target.offset[:3]
    np.testing.assert_allclose(found[:3, 3], path[:3, 3] + moved, atol=1e-6)
    np.testing.assert_allclose(found[:3, :3], path[:3, :3] @ turn if in_tool else turn @ path[:3, :3], atol=1e-6)


def test_it_stops_by_name_where_the_corrected_path_leaves_the_reach_and_goes_on_when_it_returns() -> None:
    followed = Followed(STRETCHED)
    reasons: list[str] = []
    for _ in range(70):
        followed.block(Target(np.array([0.0, 0.0, 3.0, 0, 0, 0]), np.zeros(6)))
        reasons.append(followed.source.ruled_by)
    assert "correction: at the edge of the robot's reach" in reasons
    assert all(reason.startswith("correction: ") for reason in reasons[-10:])
    np.testing.assert_array_equal(followed.played[-1], followed.played[-10])
    lowest = 0.0
    for _ in range(110):
        followed.block(Target.none())
        lowest = min(lowest, followed.source.offset[2])
    assert followed.source.ruled_by == ""
    assert followed.source.tau == STRETCHED.duration_s
    assert abs(followed.source.offset[2]) < 1e-6
    assert lowest > -5e-3
    assert (followed.shares() < 1.01).all()


SIGNALS = st.lists(
    st.tuples(
        st.lists(st.floats(-0.3, 0.3), min_size=6, max_size=6),
        st.lists(st.floats(-0.3, 0.3), min_size=6, max_size=6),
        st.integers(1, 15),
        st.integers(1, 12),
    ),
    min_size=1,
    max_size=6,
)


@settings(max_examples=6, deadline=None)
@given(st.sampled_from([SLOW, FAST]), st.sampled_from(list(CorrectionFrame)), SIGNALS)
def test_any_correction_keeps_the_limits_and_every_block_ends_at_rest(
    motion: Motion, frame: CorrectionFrame, signals: list[tuple[list[float], list[float], int, int]]
) -> None:
    followed = Followed(motion, frame)
    for place, speed, blocks, ticks in signals:
        for k in range(blocks):
            followed.block(Target(np.array(place) + k * BLOCK_S * np.array(speed), np.array(speed)), ticks)
    assert (followed.shares() < 1.01).all()
