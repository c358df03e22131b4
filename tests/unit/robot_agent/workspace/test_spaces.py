"""Where a motion leaves its spaces, against points all over the body at every other millisecond."""

import pickle
from itertools import product

import numpy as np
import pytest
from hypothesis import example, given, reject, settings
from hypothesis import strategies as st

from cell.config.settings import (
    BoxShape,
    HullShape,
    OrientationSettings,
    PoseSettings,
    Shape,
    SpaceKind,
    SpaceSettings,
    SphereShape,
)
from cell.geometry import Box, SpaceOf, capsule_box_distance, quaternion
from robot_agent.paths import JointMove
from robot_agent.trajectory import Motion, PlanError
from robot_agent.trajectory.sources import JogSource, States
from robot_agent.workspace import Breach, Spaces, sweep
from tests.unit.jog_world import ARM, Jogged
from tests.unit.jog_world import START as JOG_START
from tests.unit.planned_moves import planned
from tests.unit.random_moves import MODEL, START, sequence

MARGIN_M = 0.005
UPRIGHT = (0.0, 0.0, 0.0, 1.0)
FINE_S = 2e-3
FAR_M = 50.0
MOVING = np.array([capsule.link > 0 for capsule in MODEL.body])
WORLD = np.eye(4)


def at(position: np.ndarray) -> PoseSettings:
    return PoseSettings(tuple(np.asarray(position, float).tolist()), UPRIGHT)


def between(low: np.ndarray, high: np.ndarray) -> tuple[Shape, PoseSettings]:
    return BoxShape(tuple((high - low).tolist())), at((low + high) / 2.0)


def safe(name: str, low: np.ndarray, high: np.ndarray, of: SpaceOf = SpaceOf.BODY) -> SpaceSettings:
    return SpaceSettings(name, SpaceKind.SAFE, *between(np.asarray(low), np.asarray(high)), MARGIN_M, of)


def forbidden(shape: Shape, place: np.ndarray, of: SpaceOf = SpaceOf.BODY, margin_m: float = 0.0) -> SpaceSettings:
    return SpaceSettings("shelf", SpaceKind.FORBIDDEN, shape, at(place), margin_m, of)


def first_breach(
    motion: Motion, *spaces: SpaceSettings, off: tuple[str, ...] = (), cone: OrientationSettings | None = None
) -> Breach | None:
    mine = pickle.loads(pickle.dumps(Spaces(MODEL, spaces, cone)))
    q = motion.q(motion.grid)
    body = mine.watched(sweep(MODEL, WORLD, q), WORLD, MODEL.forward(q))
    found = mine.first_breach(body, motion.grid, lambda taus: mine.points(WORLD, motion.q(taus)), off)
    pickle.dumps(mine)  # it goes to the planning process
    assert found is None or isinstance(found, Breach)
    return found


def directions(count: int) -> np.ndarray:
    """All over the sphere (Fibonacci), and along the axes."""
    k = np.arange(count) + 0.5
    z, turn = 1.0 - 2.0 * k / count, np.pi * (1.0 + 5.0**0.5) * k
    ring = np.sqrt(1.0 - z * z)
    return np.concatenate([np.stack([ring * np.cos(turn), ring * np.sin(turn), z], -1), np.eye(3), -np.eye(3)])


def skin(motion: Motion, taus: np.ndarray, grown_m: float, along: int = 9, around: int = 80) -> np.ndarray:
    """Points `(m, p, 3)` of the moving body's surface and beyond it."""
    ends = MODEL.capsules(motion.q(taus))[:, MOVING]
    axis = ends[:, :, None, 0] + np.linspace(0.0, 1.0, along)[:, None] * (ends[:, :, 1] - ends[:, :, 0])[:, :, None]
    outwards = (MODEL.capsule_radii[MOVING, None] + grown_m)[..., None] * directions(around)
    return np.asarray((axis[:, :, :, None] + outwards[:, None]).reshape(len(taus), -1, 3))


def is_in(points: np.ndarray, *boxes: SpaceSettings) -> np.ndarray:
    inside = np.zeros(points.shape[:-1], dtype=bool)
    for box in boxes:
        assert isinstance(box.shape, BoxShape)
        away = np.abs(points - np.array(box.pose.position_m))
        inside |= (away <= np.array(box.shape.size_m) / 2.0 + 1e-7).all(axis=-1)
    return inside


def room_left(motion: Motion, taus: np.ndarray, *boxes: SpaceSettings) -> float:
    """How far the moving body is from all that lies outside of upright boxes, exactly: from boxes that fill it."""
    middles = np.array([box.pose.position_m for box in boxes])
    halves = np.array([box.shape.size_m for box in boxes if isinstance(box.shape, BoxShape)]) / 2.0
    cuts = [np.unique([-FAR_M, *(middles - halves)[:, k], *(middles + halves)[:, k], FAR_M]) for k in range(3)]
    ends, radii = MODEL.capsules(motion.q(taus))[:, MOVING], MODEL.capsule_radii[MOVING]
    least = np.inf
    for corner in product(*(range(len(cut) - 1) for cut in cuts)):
        low, high = (np.array([cut[i + step] for cut, i in zip(cuts, corner, strict=True)]) for step in (0, 1))
        middle = (low + high) / 2.0
        if not (np.abs(middle - middles) < halves).all(axis=-1).any():
            outside = Box.at(tuple((high - low).tolist()), tuple(middle.tolist()), UPRIGHT)
            least = min(least, float(capsule_box_distance(ends, radii, outside).min()))
    return least


def body_bounds(motion: Motion) -> tuple[np.ndarray, np.ndarray]:
    points = skin(motion, motion.grid[::5], MARGIN_M).reshape(-1, 3)
    return points.min(axis=0), points.max(axis=0)


@given(
    seed=st.integers(0, 10_000), cut=st.floats(0.3, 0.7), overlap=st.sampled_from([0.0, 0.1]),
    lower_by=st.sampled_from([-0.05, 0.0, 0.1, 0.3]), axis=st.sampled_from([0, 1, 2]),
)  # fmt: skip
@example(seed=25, cut=0.5234375, overlap=0.1, lower_by=0.1, axis=0)  # an inner edge, between points of the skin
@settings(max_examples=4, deadline=None)
def test_two_boxes_that_only_together_hold_the_arm_are_one_space(
    seed: int, cut: float, overlap: float, lower_by: float, axis: int
) -> None:
    try:
        motion = planned(*sequence(seed, 3).moves)
    except PlanError:
        reject()
    low, high = body_bounds(motion)
    low, high = low - 0.01, high + 0.01
    seam = low[axis] + cut * (high[axis] - low[axis])
    one_high, other_low = high.copy(), low.copy()
    one_high[axis], other_low[axis] = seam + overlap, seam - overlap
    other_high = high - np.where(np.arange(3) == (axis + 1) % 3, lower_by, 0.0)
    one, other = safe("one", low, one_high), safe("other", other_low, other_high)
    taus = np.arange(0.0, motion.duration_s, 20 * FINE_S)
    breach = first_breach(motion, one, other)
    inside = is_in(skin(motion, taus, MARGIN_M - 1e-4), one, other).all(axis=-1)
    if breach is None:
        assert inside.all()
        return
    assert breach.tau <= taus[~inside].min(initial=np.inf) + 1e-9
    here = np.clip(breach.tau + np.array([0.0, FINE_S]), 0.0, motion.duration_s)
    assert room_left(motion, here, one, other) < MARGIN_M + 1.5e-3
    assert "too far out of safe spaces one, other (margin 5 mm)" in str(breach)


def test_neither_of_two_boxes_holds_the_arm_alone() -> None:
    motion = planned(*sequence(5, 3).moves)
    low, high = body_bounds(motion)
    low, high = low - 0.01, high + 0.01
    seam = (low + high) / 2.0
    one = safe("one", low, np.array([high[0], high[1], seam[2]]))
    other = safe("other", np.array([low[0], low[1], seam[2]]), high)
    assert first_breach(motion, one, other) is None
    for off in ("one", "other"):
        assert first_breach(motion, one, other, off=(off,)) is not None
    nothing = first_breach(motion, one, other, off=("one", "other"))
    assert nothing is not None
    assert "none of the robot's safe spaces is on" in str(nothing)


def test_a_wall_thinner_than_a_step_is_not_jumped_over() -> None:
    motion = planned(*sequence(3, 6).moves)
    place = MODEL.forward(motion.q(motion.grid))[:, :3, 3]
    steps = np.diff(place, axis=0)
    step = int(np.linalg.norm(steps, axis=-1).argmax())
    along = int(np.abs(steps[step]).argmax())
    assert abs(steps[step, along]) > 0.002
    size = np.where(np.arange(3) == along, 1e-5, 0.5)
    wall = forbidden(BoxShape(tuple(size.tolist())), place[step : step + 2].mean(axis=0), SpaceOf.TCP)
    breach = first_breach(motion, wall)
    assert breach is not None
    assert breach.tau <= motion.grid[step + 1]
    assert "the TCP comes" in str(breach)


def test_an_elbow_that_goes_through_a_forbidden_space_is_seen_while_the_tcp_is_where_it_was() -> None:
    """From one elbow to the other with the same pose of the TCP before and after."""
    pose = MODEL.forward(START)
    solutions = [q for q in MODEL.inverse(pose).joints.reshape(-1, MODEL.n) if np.isfinite(q).all()]
    limits = MODEL.limits.position
    usable = [q for q in solutions if (q >= limits[:, 0]).all() and (q <= limits[:, 1]).all()]
    target = max(usable, key=lambda q: float(np.abs(q[1:3] - START[1:3]).sum()))
    assert np.abs(target - START).max() > 0.5
    motion = planned(JointMove(target, 1.0, 1))
    taus = np.linspace(0.0, motion.duration_s, 200)
    elbow = MODEL.links(motion.q(taus))[:, 3, :3, 3]
    tcp = MODEL.forward(motion.q(taus))[:, :3, 3]
    far = np.linalg.norm(elbow[:, None] - tcp[None], axis=-1).min(axis=1)
    middle = int(far.argmax())
    ball = SphereShape(0.02)
    assert first_breach(motion, forbidden(ball, elbow[middle])) is not None
    assert first_breach(motion, forbidden(ball, elbow[middle], SpaceOf.TCP)) is None


def test_a_hull_holds_what_its_points_span() -> None:
    motion = planned(*sequence(5, 3).moves)
    low, high = body_bounds(motion)
    for outwards, free in ((0.02, True), (-0.02, False)):
        corners = [(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)]
        points = (low - outwards) + np.array(corners) * (high - low + 2 * outwards)
        hull = HullShape(tuple(map(tuple, points.tolist())))
        cabin = SpaceSettings("cabin", SpaceKind.SAFE, hull, at(np.zeros(3)), MARGIN_M)
        assert (first_breach(motion, cabin) is None) is free


@given(seed=st.integers(0, 10_000), axis=st.sampled_from([0, 1, 2]), share=st.floats(0.2, 1.2))
@settings(max_examples=6, deadline=None)
def test_the_tool_points_within_its_cone_on_the_whole_motion(seed: int, axis: int, share: float) -> None:
    try:
        motion = planned(*sequence(seed, 3).moves)
    except PlanError:
        reject()
    taus = np.arange(0.0, motion.duration_s, FINE_S)
    pointing = MODEL.forward(motion.q(taus))[:, :3, axis]
    towards = pointing[0]
    angles = np.arccos(np.clip(pointing @ towards, -1.0, 1.0))
    within = share * float(angles.max())
    if not 1e-3 < within < 3.0:
        return
    x, y, z = towards.tolist()
    breach = first_breach(motion, cone=OrientationSettings(axis, (x, y, z), within))
    too_far = taus[angles > within + 1e-9]
    if len(too_far):
        assert breach is not None
        assert breach.tau <= too_far[0] + 1e-9
    if breach is not None:
        assert angles.max() > within - np.radians(0.05)


def test_a_cone_of_30_degrees_refuses_a_tilt_of_40() -> None:
    """The angle that is printed for it (6-5) is that of the quaternions, half of the tilt: by that 20 would pass."""
    tilted = START.copy()
    tilted[4] += np.radians(40.0)
    motion = planned(JointMove(tilted, 1.0, 1))
    axes = MODEL.forward(START)[:3, :3], MODEL.forward(tilted)[:3, :3]
    axis = next(k for k in range(3) if axes[0][:, k] @ axes[1][:, k] < np.cos(np.radians(39.0)))
    halved = float(np.degrees(np.arccos(np.abs(quaternion.from_matrix(axes[0]) @ quaternion.from_matrix(axes[1])))))
    assert halved == pytest.approx(20.0)
    x, y, z = axes[0][:, axis].tolist()
    assert first_breach(motion, cone=OrientationSettings(axis, (x, y, z), np.radians(30.0))) is not None
    assert first_breach(motion, cone=OrientationSettings(axis, (x, y, z), np.radians(41.0))) is None


def test_a_roll_about_the_pointing_axis_is_free() -> None:
    rolled = START + np.array([0, 0, 0, 0, 0, 2.0])
    motion = planned(JointMove(rolled, 1.0, 1))
    tcp = MODEL.forward(START)
    steady = int(np.argmax([tcp[:3, k] @ MODEL.forward(rolled)[:3, k] for k in range(3)]))
    x, y, z = tcp[:3, steady].tolist()
    assert first_breach(motion, cone=OrientationSettings(steady, (x, y, z), np.radians(1.0))) is None
    turning = (steady + 1) % 3
    x, y, z = tcp[:3, turning].tolist()
    breach = first_breach(motion, cone=OrientationSettings(turning, (x, y, z), np.radians(1.0)))
    assert breach is not None
    farthest = np.degrees(np.arccos(tcp[:3, turning] @ MODEL.forward(rolled)[:3, turning]))
    told = float(str(breach).partition("points up to ")[2].partition(" deg")[0])
    assert farthest - 1.5 < told <= farthest - 1.0, "up to where the motion ends"


@pytest.mark.parametrize("seed", [0, 11, 30, 102])
def test_a_jog_at_full_speed_stands_close_in_front_of_the_border(seed: int) -> None:
    """In a box with a little room on every side; where it stands outside, it gets back in and no farther out."""
    rng = np.random.default_rng(seed)
    jogged = Jogged(JOG_START + rng.uniform(-0.2, 0.2, 6))
    low, high = _extent(jogged.q)
    low, high = low - rng.uniform(0.02, 0.15, 3), high + rng.uniform(0.02, 0.15, 3)
    axis, sign = [0, 1, 2, "X", "Y", "Z", "A", "B", "C"][rng.integers(9)], rng.choice([-1.0, 1.0])
    key = _pressed(jogged, axis, sign, low, high)
    gaps = _gaps(np.array(jogged.played), low, high)
    assert "border of safe space cabin is in the way of link" in key.ruled_by
    assert gaps.min() > -1e-6
    assert gaps[-1] < 0.02
    inside, (low, high) = gaps[0], _smaller(jogged.q, low, high, 0.03)
    assert _gaps(jogged.q[None], low, high)[0] < -0.02 < inside
    for back, farther in ((sign, False), (-sign, True)):
        out = Jogged(jogged.q)
        _pressed(out, axis, back, low, high, 10)
        gaps = _gaps(np.array(out.played), low, high)
        assert gaps.min() > gaps[0] - 1e-6
        assert (gaps[-1] > gaps[0] + 1e-4) == farther


def _pressed(
    jogged: Jogged, axis: int | str, speed: float, low: np.ndarray, high: np.ndarray, most: int = 250
) -> JogSource:
    """A key that is held until the robot stands."""
    mine = Spaces(ARM, (safe("cabin", low, high),))

    def clear(states: States) -> str:
        return mine.in_the_way(mine.watched(sweep(ARM, WORLD, states.q), WORLD, ARM.forward(states.q)), ())

    key = jogged.press(axis, speed, clear=clear)
    for block in range(most):
        jogged.block(key)
        if block > 20 and not jogged.way.qd.any():
            break
    return key


ARM_MOVES = np.array([capsule.link > 0 for capsule in ARM.body])


def _extent(q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    ends, radii = ARM.capsules(q)[ARM_MOVES], ARM.capsule_radii[ARM_MOVES, None]
    return (ends.min(axis=1) - radii).min(axis=0), (ends.max(axis=1) + radii).max(axis=0)


def _gaps(q: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """How far inside the box the body is, less the margin, at joints `(m, n)`."""
    extents = [_extent(each) for each in q]
    return np.array([min((a - low).min(), (high - b).min()) - MARGIN_M for a, b in extents])


def _smaller(q: np.ndarray, low: np.ndarray, high: np.ndarray, by: float) -> tuple[np.ndarray, np.ndarray]:
    """The box without a slice at the side that the body is nearest to."""
    a, b = _extent(q)
    rooms = np.append(a - low, high - b)
    side, shift = int(rooms.argmin()), np.zeros(6)
    shift[side] = by
    return low + shift[:3], high - shift[3:]
