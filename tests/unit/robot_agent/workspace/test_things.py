"""Where a motion comes too near to a thing, against a look at every fifth of a millisecond."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cell.config.settings import (
    HalfSpaceShape,
    MeshShape,
    PoseSettings,
    Shape,
    SphereShape,
    ThingSettings,
)
from cell.geometry import transform_points
from cell.geometry.quaternion import from_matrix
from robot_agent.trajectory import Motion
from robot_agent.workspace import Things, Touch, solid_of, sweep
from tests.unit.ball_mesh import ball_file
from tests.unit.block_mesh import block, obj_file
from tests.unit.jog_world import ARM, Jogged
from tests.unit.jog_world import START as JOG_START
from tests.unit.planned_moves import planned
from tests.unit.random_moves import MODEL, START, sequence

HERE = MODEL.forward(START)[:3, 3]
MARGIN_M = 0.005
UPRIGHT = (0.0, 0.0, 0.0, 1.0)
FINE_S = 2e-4


def thing(shape: Shape, at: np.ndarray, turn: float = 0.0, margin_m: float = MARGIN_M) -> ThingSettings:
    quaternion = (0.0, 0.0, float(np.sin(turn / 2)), float(np.cos(turn / 2)))
    return ThingSettings("post", shape, PoseSettings(tuple(at.tolist()), quaternion), margin_m, {})


def points(motion: Motion, taus: np.ndarray) -> np.ndarray:
    return np.asarray(transform_points(np.eye(4), MODEL.capsules(motion.q(taus))))


def first_touch(motion: Motion, *things: ThingSettings) -> Touch | None:
    body = sweep(MODEL, np.eye(4), motion.q(motion.grid))
    return Things(MODEL, things).first_touch(body, motion.grid, lambda taus: points(motion, taus))


def test_a_wall_thinner_than_a_step_is_not_jumped_over() -> None:
    motion = planned(*sequence(3, 6).moves)
    taus = motion.grid
    flange = points(motion, taus)[:, -1, 1]
    step = int(np.linalg.norm(np.diff(flange, axis=0), axis=-1).argmax())
    assert np.linalg.norm(flange[step + 1] - flange[step]) > 0.002
    middle = float(taus[step : step + 2].mean())
    ball = MODEL.forward(motion.q(np.array([middle])))[0, :3, 3]
    touch = first_touch(motion, thing(SphereShape(1e-6), ball, margin_m=0.0))
    assert touch is not None
    assert touch.tau <= middle + 1e-3


def test_the_margin_is_kept_and_told() -> None:
    motion = planned(*sequence(5, 3).moves)
    lowest = points(motion, np.arange(0.0, motion.duration_s, FINE_S))
    moving = np.array([capsule.link > 0 for capsule in MODEL.body])
    floor = float((lowest[..., 2][:, moving].min(axis=-1) - MODEL.capsule_radii[moving]).min())
    plane = np.array([0.0, 0.0, floor])
    assert first_touch(motion, thing(HalfSpaceShape(), plane - [0, 0, MARGIN_M + 1e-3])) is None
    touch = first_touch(motion, thing(HalfSpaceShape(), plane - [0, 0, MARGIN_M - 1e-3]))
    assert touch is not None
    assert touch.thing == "post"
    assert touch.link in MODEL.link_names
    assert "too near to post (margin 5 mm)" in str(touch)


def test_links_that_may_touch_are_not_kept_away() -> None:
    motion = planned(*sequence(5, 3).moves)
    inside = ThingSettings(
        "nest", SphereShape(0.02), PoseSettings(tuple(HERE.tolist()), UPRIGHT), 0.0, {"left": ("flange",)}
    )
    body = sweep(MODEL, np.eye(4), motion.q(motion.grid))
    assert Things(MODEL, (inside,), "right").first_touch(body, motion.grid, lambda t: points(motion, t)) is not None
    free = Things(MODEL, (inside,), "left").first_touch(body, motion.grid, lambda t: points(motion, t))
    assert free is None or free.link != "flange"


def test_a_mesh_of_ten_thousand_triangles_is_a_thing(tmp_path: Path) -> None:
    file = ball_file(tmp_path)
    motion = planned(*sequence(5, 3).moves)
    for beside in ([0.3, 0.3, 0.2], [0.0, 0.0, 0.0]):
        at = HERE + np.array(beside)
        meshed, smooth = (first_touch(motion, thing(shape, at)) for shape in (MeshShape(file, 0.001), SphereShape(0.1)))
        assert (meshed is None) == (smooth is None)
        if meshed is not None and smooth is not None:
            assert meshed.tau == pytest.approx(smooth.tau, abs=0.05)


def test_who_begins_too_near_may_go_out_but_no_deeper() -> None:
    floor = thing(HalfSpaceShape(), np.array([0.0, 0.0, HERE[2]]))
    things = Things(MODEL, (floor,))
    pose = MODEL.forward(START)
    ways = []
    for sign in (1.0, -1.0):
        path, q = [START], START
        for _ in range(5):
            pose = MODEL.forward(q).copy()
            pose[2, 3] += sign * 0.0005
            q = MODEL.solve(pose, near=q)
            path.append(q)
        ways.append(things.in_the_way(sweep(MODEL, np.eye(4), np.array(path))))
    assert ways[0] == ""
    assert "post is in the way of link" in ways[1]


@pytest.mark.parametrize(("sign", "out"), [(1.0, True), (-1.0, False)])
def test_a_jog_goes_out_of_a_mesh_that_holds_the_whole_link_and_no_deeper(
    sign: float, out: bool, tmp_path: Path
) -> None:
    """The wrist is below the upper side of a block, and touches none of its triangles."""
    file = obj_file(tmp_path / "block.obj", *block((1000.0, 1000.0, 1000.0)))
    jogged, last = Jogged(JOG_START), len(ARM.body) - 1
    ends, radius = ARM.capsules(jogged.q[None])[0, last], ARM.capsule_radii[last]
    at = np.array([*ends.mean(axis=0)[:2], ends[:, 2].max() + radius + 0.02 - 0.5])
    others = tuple(name for name in ARM.link_names if name != ARM.link_names[ARM.body[last].link])
    held = replace(thing(MeshShape(file, 0.001), at), may_touch={"": (*others, *map(str, range(6)))})
    things = Things(ARM, (held,))
    key = jogged.press("Z", sign * 0.25, clear=lambda states: things.in_the_way(sweep(ARM, np.eye(4), states.q)))
    solid = solid_of(held.shape, held.pose)
    jogged.run(key, 20)
    depths = solid.capsule_distance(ARM.capsules(np.array(jogged.played))[:, last], np.array(radius))
    assert depths[0] == pytest.approx(-2.0 * radius - 0.02 - float(np.ptp(ends[:, 2])), abs=0.006)
    assert np.diff(depths).min() > -1e-9
    assert depths[-1] > depths[0] + 0.05 if out else np.ptp(depths) == 0.0


@given(
    start=st.tuples(*[st.floats(-0.4, 0.4)] * 6), away=st.floats(0.03, 0.3), speed=st.floats(0.05, 1.0),
    axis=st.sampled_from([0, 1, 2, "X", "Y", "Z"]), sign=st.sampled_from([-1.0, 1.0]),
)  # fmt: skip
@settings(max_examples=5, deadline=None)
def test_a_jog_stands_close_in_front_of_a_thing(
    start: tuple[float, ...], away: float, axis: int | str, sign: float, speed: float
) -> None:
    """Whatever the jog; a wall stands across the way that the flange sets out on."""
    jogged = Jogged(JOG_START + np.array(start) * 0.5)
    ahead = Jogged(jogged.q)
    ahead.run(ahead.press(axis, sign * speed), 30)
    before, after = (ARM.forward(q)[:3, 3] for q in (jogged.q, ahead.q))
    if np.linalg.norm(after - before) < 0.02:
        return
    away_from = (before - after) / np.linalg.norm(before - after)
    wall = _wall(away_from, jogged.q, away)
    things = Things(ARM, (wall,))
    key = jogged.press(axis, sign * speed, clear=lambda states: things.in_the_way(sweep(ARM, np.eye(4), states.q)))
    jogged.run(key, 150)
    gaps = _gaps(wall, np.array(jogged.played))
    assert gaps.min() > -1e-6
    if "post" in key.ruled_by and not jogged.way.qd.any():
        assert gaps[-1] < 0.02


def _wall(normal: np.ndarray, q: np.ndarray, away_m: float) -> ThingSettings:
    """A half space that the body stays `away_m` from where it stands; its free side is that of `normal`."""
    x = np.cross(normal, [0.0, 0.0, 1.0] if abs(normal[2]) < 0.9 else [1.0, 0.0, 0.0])
    x /= np.linalg.norm(x)
    quaternion = from_matrix(np.stack([x, np.cross(normal, x), normal], axis=-1))
    at_origin = ThingSettings("post", HalfSpaceShape(), PoseSettings((0.0, 0.0, 0.0), tuple(quaternion)), MARGIN_M, {})
    shift = float(_gaps(at_origin, q[None])[0]) - away_m
    return replace(at_origin, pose=PoseSettings(tuple(normal * shift), tuple(quaternion)))


def _gaps(wall: ThingSettings, q: np.ndarray) -> np.ndarray:
    """Of the links that move, less the margin."""
    moving = np.array([capsule.link > 0 for capsule in ARM.body])
    distance = solid_of(wall.shape, wall.pose).capsule_distance(ARM.capsules(q)[:, moving], ARM.capsule_radii[moving])
    return np.asarray(distance.min(axis=-1) - wall.margin_m)
