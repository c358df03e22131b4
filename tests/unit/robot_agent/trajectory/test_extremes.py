"""Programs at the extremes: a motion within its limits, or a refusal in the planner's own words."""

from typing import Any

import numpy as np
import pytest

from cell.geometry import from_xyz_abc
from robot_agent.kinematics import Model, load_model
from robot_agent.paths import Arc, JointMove, Line, Move, Passing, Sequence, Spline
from robot_agent.trajectory import Governor, Limits, Motion, PlanError, plan
from robot_agent.trajectory.joints.pieces import Pieces
from robot_agent.trajectory.timing import tcp_use
from robot_agent.trajectory.timing.optimal import time_optimal
from tests.unit.extreme_moves import ROOM_M, extreme_sequence
from tests.unit.repository import ROOT

STEP_S = 1e-3
EXCESS = 1.001
MODELS = {name: load_model(ROOT / "cell_configs" / "models" / f"{name}.yaml") for name in ROOM_M}
BESIDE = {
    "six_axis": np.radians([10.0, 0.0, 0.0, 20.0, -25.0, 0.0]),
    "cobot": np.radians([10.0, 5.0, -10.0, 5.0, 5.0, 5.0]),
    "scara": np.array([0.2, -0.5, -0.05, 0.0]),
    "palletizer": np.radians([10.0, 5.0, 5.0, 10.0]),
    "delta": np.radians([25.0, 25.0, 25.0, 0.0]),
    "gantry": np.zeros(6),
}
IN_TEST, IN_ALL = 36, 2000
"""Programs in `make test`, and in `make soak`."""


def start_of(name: str) -> np.ndarray:
    """Joints with some room around them."""
    return np.asarray(MODELS[name].home + BESIDE[name])


def turned_by(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Angles [rad] between orientations `(k, 3, 3)`: those of their chords, exact for small ones."""
    chord = np.linalg.norm(second - first, axis=(1, 2)) / np.sqrt(8.0)
    return np.asarray(2.0 * np.arcsin(np.minimum(chord, 1.0)))


def caps(move: Move, limits: Limits) -> np.ndarray:
    """What a move allows of the TCP's speed and rotation and of the joints' own speed."""
    asked = np.array([move.speed_m_s, move.rotation_rad_s, move.joint_speed_rad_s], dtype=float)
    path = limits.path
    own = [np.inf, np.inf] if isinstance(move, JointMove) else [path.speed_m_s, path.angular_speed_rad_s]
    return np.fmin(asked, [*own, np.inf])


def used(model: Model, moves: tuple[Move, ...], motion: Motion) -> dict[str, float]:
    """The most of each limit, by differences of joints and poses alone."""
    limits = Limits.of(model.description)
    t = np.arange(-3, int(motion.duration_s / STEP_S) + 5) * STEP_S
    q = motion.q(t)
    lower, upper = limits.acceleration_bounds
    rates = [np.diff(q, order, axis=0) / STEP_S**order for order in (1, 2, 3)]
    found = {
        "speed": float((np.abs(rates[0]) / limits.velocity).max()),
        "acceleration": float(np.maximum(rates[1] / upper, rates[1] / lower).max()),
        "jerk": float((np.abs(rates[2]) / limits.jerk).max()),
    }
    poses = model.forward(q)
    speed = np.linalg.norm(np.diff(poses[:, :3, 3], axis=0), axis=1) / STEP_S
    turn = turned_by(poses[:-1, :3, :3], poses[1:, :3, :3]) / STEP_S
    own = np.linalg.norm(rates[0][:, limits.turning], axis=1)
    move = motion.move_at(t)
    inside = move[:-1] == move[1:]
    allowed = np.array([caps(each, limits) for each in moves])[move[:-1]]
    for name, rate, cap in zip(("F", "FA", "FJ"), (speed, turn, own), allowed.T, strict=True):
        found[name] = float((rate / cap * inside).max())
    return found


def longest_stand_s(motion: Motion) -> float:
    """The longest time for which nothing moves while the motion is not at one of its rests."""
    t = np.arange(0.0, motion.duration_s, STEP_S)
    away = np.abs(t[:, None] - motion.rests).min(axis=1) > 0.02
    stands = away & (np.abs(motion.qd(t)).max(axis=1) < 1e-9)
    runs = np.diff(np.flatnonzero(np.diff(np.concatenate([[False], stands, [False]]).astype(int))))[::2]
    return STEP_S * float(runs.max(initial=0))


def judge(number: int) -> bool:
    """Plan a program and judge the motion; False where the planner refuses it."""
    name = list(MODELS)[number % len(MODELS)]
    model, start = MODELS[name], start_of(name)
    sequence = extreme_sequence(model, start, number)
    try:
        motion = plan(model, sequence, Limits.of(model.description), start=start)
    except PlanError:
        return False
    found = used(model, sequence.moves, motion)
    assert max(found.values()) <= EXCESS, f"{name} {number}: {found}"
    knots = motion.pieces.knots[1:-1]
    np.testing.assert_allclose(motion.q(knots - 1e-9), motion.q(knots + 1e-9), atol=1e-7)
    assert longest_stand_s(motion) <= 0.05, f"{name} {number}"
    stops = [each for each in motion.transitions if each.passing is Passing.STOPS]
    assert all(each.reason for each in stops)
    assert len(motion.rests) - 2 <= len(stops) + sum(_turns_first(each) for each in sequence.moves)
    return True


def _turns_first(move: Move) -> bool:
    return not isinstance(move, JointMove) and move.tangential_rad is not None


def test_programs_at_the_extremes_keep_all_limits_or_are_refused() -> None:
    assert sum(judge(number) for number in range(IN_TEST)) > IN_TEST / 2


@pytest.mark.soak
@pytest.mark.parametrize("first", range(IN_TEST, IN_ALL, 50))
def test_soak_programs_at_the_extremes_keep_all_limits_or_are_refused(first: int) -> None:
    assert sum(judge(number) for number in range(first, min(first + 50, IN_ALL))) > 0


def beside(name: str, offset: tuple[float, float, float], turn: float = 0.0) -> np.ndarray:
    """A pose beside the start of a robot [m], turned [rad] about the vertical."""
    pose = MODELS[name].forward(start_of(name))
    pose[:3, :3] = from_xyz_abc(np.array([0, 0, 0, 0, 0, turn]))[:3, :3] @ pose[:3, :3]
    pose[:3, 3] += offset
    return np.asarray(pose)


def planned(name: str, *moves: Move) -> Motion:
    return plan(MODELS[name], Sequence(moves), Limits.of(MODELS[name].description), start=start_of(name))


@pytest.mark.parametrize("name", MODELS)
@pytest.mark.parametrize("way_m", [5e-8, 2e-7, 9e-7, 1.1e-6, 4e-6])
def test_a_move_of_a_micrometre_between_two_round_edges_is_one_motion_that_a_governor_plays(
    name: str, way_m: float
) -> None:
    side = 0.5 * ROOM_M[name]
    places = (side, 0.0, 0.0), (side, way_m, 0.0), (side, way_m, 0.8 * side)
    motion = planned(name, *(Line(beside(name, at), 0.2, k, round_m=0.005) for k, at in enumerate(places, 1)))
    knots = motion.pieces.knots[1:-1]
    np.testing.assert_allclose(motion.q(knots - 1e-9), motion.q(knots + 1e-9), atol=1e-8)
    governor = Governor(motion, Limits.of(MODELS[name].description), 0.001, 0.12)
    segment, played = governor.rest(0.0), 0
    for _ in range(int(motion.duration_s / 0.02) + 20):
        segment, played = governor.next(segment, played, [], []), 20
        if segment.stop_tau >= motion.duration_s:
            return
    pytest.fail(f"stands at {segment.stop_tau} of {motion.duration_s}")


def test_moves_that_are_too_short_one_by_one_add_up() -> None:
    steps = [Line(beside("six_axis", (0.05, 4e-7 * k, 0.0)), 0.1, k) for k in range(20)]
    motion = planned("six_axis", *steps)
    end = motion.pose(np.array(motion.duration_s))
    np.testing.assert_allclose(end[:3, 3], steps[-1].target_pose[:3, 3], atol=1e-6)


@pytest.mark.parametrize(("turn_deg", "round_m", "cap_deg_s"), [(20, 0.05, 2.0), (20, 0.05, 10.0), (40, 0.02, 5.0)])
def test_rotation_keeps_its_cap_where_the_turn_reverses_in_a_round_edge(
    turn_deg: float, round_m: float, cap_deg_s: float
) -> None:
    cap = np.radians(cap_deg_s)
    there, back = beside("scara", (0.08, 0.0, 0.0), np.radians(turn_deg)), beside("scara", (0.08, 0.08, 0.0))
    moves = Line(there, None, 1, round_m=round_m, rotation_rad_s=cap), Line(back, None, 2, rotation_rad_s=cap)
    assert used(MODELS["scara"], moves, planned("scara", *moves))["FA"] == pytest.approx(1.0, abs=0.003)


def test_the_flange_keeps_its_jerk_where_it_nearly_reverses_in_a_round_edge() -> None:
    model = MODELS["palletizer"]
    limits = Limits.of(model.description)
    away, there, back = (
        from_xyz_abc(np.array([*place, 0.0, 0.0, turn]))
        for place, turn in (
            ((0.872, -0.007, 1.417), 0.294),
            ((0.853, 0.032, 1.393), 0.195),
            ((0.877, 0.011, 1.441), -0.207),
        )
    )
    first = plan(model, Sequence([Line(away, None, 1), Line(there, None, 2, round_m=0.000318)]), limits, model.home)
    last = Line(back, 0.186, 3, rotation_rad_s=0.313)
    motion = plan(model, Sequence([last]), limits, first.state(first.ends[0] / 2.0))
    assert [each.passing for each in motion.transitions] == [Passing.STOPS, Passing.ROUNDED]
    step_s = 1e-4
    t = np.arange(motion.rests[1] + 0.01, motion.duration_s - 0.01, step_s)
    speed = np.linalg.norm(np.diff(model.forward(motion.q(t))[:, :3, 3], axis=0), axis=1) / step_s
    assert 1e-3 < speed[2000:-2000].min() < 5e-3
    assert np.abs(np.diff(speed, 2)).max() / step_s**2 < EXCESS * limits.path.jerk_m_s3


@pytest.mark.parametrize("segment_m", [1e-4, 1e-3])
def test_feeds_are_kept_on_moves_shorter_than_a_cycle(segment_m: float) -> None:
    radius_m, count = 0.08, 100
    angles = np.arange(1, count + 1) * segment_m / radius_m
    feeds = np.where(np.arange(count) % 10 == 5, 0.02, 0.3)
    motion = planned(
        "six_axis",
        *(
            Spline(beside("six_axis", (radius_m * (np.cos(a) - 1.0), radius_m * np.sin(a), 0.0))[None], k, feed)
            for k, (a, feed) in enumerate(zip(angles, feeds.tolist(), strict=True), 1)
        ),
    )
    begins = np.append(0.0, motion.ends[:-1])
    t = begins + (motion.ends - begins) * np.linspace(0.01, 0.99, 50)[:, None]
    assert (motion.tcp_speed(t) <= EXCESS * feeds).all()


@pytest.mark.parametrize("name", ["six_axis", "scara", "palletizer"])
@pytest.mark.parametrize("feed_m_s", [0.005, 0.02])
def test_creeping_feeds_are_kept_in_round_edges_and_arcs(name: str, feed_m_s: float) -> None:
    side = 0.5 * ROOM_M[name]
    moves = (
        Line(beside(name, (-side, 0.0, 0.0)), feed_m_s, 1, round_m=0.01),
        Arc(beside(name, (-1.3 * side, side, 0.0)), beside(name, (-side, 1.5 * side, 0.0)), 2, speed_m_s=feed_m_s),
    )
    assert used(MODELS[name], moves, planned(name, *moves))["F"] == pytest.approx(0.9995, abs=0.0015)


def test_an_arc_without_a_way_is_none() -> None:
    via, target = beside("six_axis", (0.05, 0.05, 0.0)), beside("six_axis", (0.1, 0.0, 0.0))
    arc = Arc(via, target, 1, angle_rad=np.radians(1e-10))
    motion = planned("six_axis", arc, Line(beside("six_axis", (0.0, 0.05, 0.0)), None, 2))
    assert motion.ends[0] == 0.0
    assert motion.duration_s > 0.1


def test_a_start_outside_the_range_of_a_joint_is_told_as_that() -> None:
    model, start = MODELS["six_axis"], start_of("six_axis")
    start[5] = model.limits.position[5, 1] + 0.05
    target = model.forward(start)
    target[1, 3] += 0.02
    with pytest.raises(PlanError, match=r"begins outside the range of a joint: joint J6 is at 452\.86 deg"):
        plan(model, Sequence([Line(target, 0.1, 1)]), Limits.of(model.description), start=start)


def test_a_cap_with_which_a_move_would_last_for_months_is_refused() -> None:
    Line(beside("six_axis", (0.001, 0.0, 0.0)), 1e-6, 1)
    with pytest.raises(ValueError, match="speed 1e-09 found, allowed from 1e-07"):
        Line(beside("six_axis", (0.001, 0.0, 0.0)), 1e-9, 1)


@pytest.mark.parametrize("offset_m", [6.888452318938949e-07, 1e-6])
def test_a_line_beside_the_wrists_singular_pose_is_not_refused_because_it_may_flip(offset_m: float) -> None:
    model = MODELS["six_axis"]
    rng = np.random.default_rng([32, 53])
    q = np.radians([*(rng.uniform(-k, k) for k in (40, 20)), rng.uniform(-40, 10), 0.0, 0.0, 0.0])
    q[3], q[5] = rng.uniform(-1, 1), rng.uniform(-1, 1)
    singular = model.forward(q)
    ahead, aside = singular[:3, 0], rng.normal(size=3)
    aside -= ahead * (aside @ ahead)
    aside /= np.linalg.norm(aside)
    way = np.cross(ahead, aside)
    rng.uniform()
    length = rng.uniform(0.05, 0.2)
    begin, end = singular.copy(), singular.copy()
    begin[:3, 3] += offset_m * aside - length * way
    end[:3, 3] += offset_m * aside + length * way
    start = model.solve(begin, near=q)
    limits = Limits.of(model.description)
    for flips in (False, True):
        motion = plan(model, Sequence([Line(end, 0.2, 1, wrist_may_flip=flips)]), limits, start=start)
        np.testing.assert_allclose(motion.pose(np.array(motion.duration_s)), end, atol=1e-6)


def test_three_rounds_of_a_circle_of_half_a_millimetre_are_planned_in_few_pieces(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """On which the tool turns by 20 degrees: a coarse search is far from keeping its limits. 77 000 pieces before."""
    model, pieces = MODELS["palletizer"], list[int]()
    start = np.radians([4.832, -28.076, 13.482, 3.558])
    places = [[0.8518253, 0.0721697, 1.7896402, 0, 0, 20.0471], [0.8521945, 0.0723671, 1.7895711, 0, 0, 8.3896]]
    via, target = from_xyz_abc(np.array(places) * np.array([1.0, 1.0, 1.0, *3 * [np.pi / 180.0]]))

    def counted(model: Model, fitted: Pieces, *more: Any) -> np.ndarray:
        pieces.append(len(fitted.knots))
        return tcp_use.near_use(model, fitted, *more)

    monkeypatch.setattr(time_optimal, "near_use", counted)
    arc = Arc(via, target, 1, angle_rad=6.0 * np.pi, speed_m_s=0.3)
    motion = plan(model, Sequence([arc]), Limits.of(model.description), start=start)
    assert max(pieces) < 40_000
    assert motion.duration_s < 3.75
