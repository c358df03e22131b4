"""Random robots, things, spaces and motions: what brute force sees in them, and what the planner says.

What is planned is what an agent plans, and what is judged is the answer of the planner: free, or where it is not.
"""

import atexit
import re
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import cast

import numpy as np

from cell.config.settings import (
    BoxShape,
    CylinderShape,
    HalfSpaceShape,
    HullShape,
    MeshShape,
    OrientationSettings,
    PoseSettings,
    Shape,
    SpaceKind,
    SpaceSettings,
    SphereShape,
    ThingSettings,
)
from cell.geometry import SpaceOf
from cell.geometry.quaternion import from_matrix
from robot_agent.agent.planning.planner import Planner
from robot_agent.agent.planning.plans import PlanFailed, PlanRequest
from robot_agent.kinematics import Model, OpenMechanism, load_model, model_of
from robot_agent.language import JointStep, LineStep
from robot_agent.language.moves import MotionStep
from robot_agent.model import Tool
from robot_agent.model.description import Capsule, Mounted
from robot_agent.trajectory import Motion
from robot_agent.workspace import PlacedRobot, Spaces, Things
from tests.unit.ball_mesh import ball_file
from tests.unit.repository import ROOT
from tests.unit.robot_agent.workspace.brute_force import MANY_POSES, POSES, Body, rotation, seen, watched

FAMILIES = sorted((ROOT / "cell_configs" / "models").glob("*.yaml"))
CYCLE_S = 0.004
TOLD_S = 0.006
"""Times are told in hundredths of a second."""
UPRIGHT = (0.0, 0.0, 0.0, 1.0)
THIN_M = 1e-5
ROUND_EVERY = 4
"""Every so many of the worlds have round numbers only: right angles, whole centimetres, the base in the origin."""

PLATE_EVERY = 4
"""Every so many have a plate across the way of the TCP, thinner than a step."""
_PLATE_M = 2e-4


@dataclass(frozen=True, eq=False)
class World:
    """A robot, what is around it, and a motion."""

    model: Model
    base: PoseSettings
    steps: tuple[MotionStep, ...]
    start: np.ndarray
    motion: Motion
    things: tuple[ThingSettings, ...]
    spaces: tuple[SpaceSettings, ...]
    cone: OrientationSettings | None

    def told_s(self) -> float:
        """When the planner says that the motion runs into something, infinite where it is free."""
        things, spaces = Things(self.model, self.things), Spaces(self.model, self.spaces, self.cone)
        answer = _answer(PlacedRobot.at(self.model, self.base, things, spaces), self.steps, self.start)
        if not isinstance(answer, PlanFailed):
            return np.inf
        found = re.search(r", (\d+\.\d\d) s after the motion begins; ", answer.text)
        assert found is not None, answer.text
        return float(found[1])


@dataclass(frozen=True)
class Verdict:
    """What is seen by brute force and what is told."""

    near_s: float
    short_s: float
    by: str
    told_s: float

    @property
    def right(self) -> bool:
        """Nothing is missed or told late, and nothing is refused that is far enough away."""
        return self.near_s - TOLD_S <= self.told_s <= self.short_s + TOLD_S


class _Nothing:
    """No things, and no robot that could be in its own way."""

    def __bool__(self) -> bool:
        return False

    def placed(self, _: object) -> "_Nothing":
        return self

    def of(self, _: object) -> "_Nothing":
        return self


def _answer(robot: PlacedRobot, steps: tuple[MotionStep, ...], start: np.ndarray) -> object:
    carrying = tuple(replace(step, mounted=robot.model.description.mounted) for step in steps)
    return Planner(robot, CYCLE_S).plan(PlanRequest(1, carrying, start, ()))


def drawn(seed: int) -> World | None:
    """The world with this number; None where the robot cannot go the way that is drawn."""
    rng, rounded = np.random.default_rng([seed, 77]), seed % ROUND_EVERY == 0
    model = _robot(rng, load_model(FAMILIES[seed % len(FAMILIES)]))
    base = _pose(rng, rng.uniform(-1.0, 1.0, 3), rounded) if not rounded else PoseSettings((0.0, 0.0, 0.0), UPRIGHT)
    lower, upper = model.limits.position.T
    share = rng.uniform(0.05, 0.6)

    def joints() -> np.ndarray:
        q = model.home + share * (rng.uniform(lower, upper) - model.home)
        if rounded:
            steps = np.where(model.linear, 0.05, np.radians(15.0))
            q = np.clip(np.round(q / steps) * steps, np.ceil(lower / steps) * steps, np.floor(upper / steps) * steps)
        return np.asarray(q)

    start, speed = joints(), float(rng.choice([0.3, 1.0]))
    steps: list[MotionStep] = [JointStep(1, tuple(joints().tolist()), speed)]
    try:
        if model.description.family is not None and rng.random() < 0.4:
            to = model.forward(start)[:3, 3] + np.round(rng.uniform(-0.3, 0.3, 3), 2)
            steps = [LineStep(1, tuple(to.tolist()), None)]
        planned = _answer(PlacedRobot.at(model, base, cast(Things, _Nothing())), tuple(steps), start)
    except OpenMechanism:
        return None
    if isinstance(planned, PlanFailed):
        return None
    motion: Motion = planned.motion  # type: ignore[attr-defined]
    body = Body(model, PlacedRobot.at(model, base).pose_world_base)
    q = motion.q(np.linspace(0.0, motion.duration_s, 60))
    things = tuple(_thing(rng, body, q, rounded, f"thing {k}") for k in range(rng.integers(0, 3)))
    spaces = tuple(_spaces(rng, body, q, rounded)) if rng.random() < 0.4 else ()
    cone = _cone(rng, body, q) if rng.random() < 0.2 else None
    if seed % PLATE_EVERY == PLATE_EVERY - 1:
        spaces = (*spaces, _plate(rng, body, motion))
    return World(model, base, tuple(steps), start, motion, things, spaces, cone)


def _robot(rng: np.random.Generator, model: Model) -> Model:
    """Some with a tool that has a body, with another margin to itself."""
    if rng.random() < 0.5:
        return model
    scale = min(model.reach_m, 1.0)
    pose, tip = np.eye(4), np.round(rng.uniform(-0.2, 0.2, 3) * scale, 2)
    pose[:3, 3] = tip
    bent = np.round(tip + rng.uniform(-0.2, 0.2, 3) * scale, 2)
    ends = [tuple(each.tolist()) for each in (np.zeros(3), tip, bent)]
    capsules = (Capsule(ends[0], ends[1], 0.02 * scale), Capsule(ends[1], ends[2], 0.02 * scale))
    tool = Tool("drawn", pose, 0.0, (0.0, 0.0, 0.0), np.zeros((3, 3)), capsules)
    apart = replace(model.description.apart, margin_m=float(rng.choice([0.0, 0.01])))
    return model_of(replace(model.description, tools={"drawn": tool}, mounted=Mounted(("drawn",)), apart=apart))


def _pose(rng: np.random.Generator, at: np.ndarray, rounded: bool) -> PoseSettings:
    turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    if rounded:
        turn, at = np.eye(3)[rng.permutation(3)] * rng.choice([-1.0, 1.0], 3), np.round(at, 2)
    turn[0] *= np.sign(np.linalg.det(turn))
    return PoseSettings(tuple(at.tolist()), tuple(from_matrix(turn).tolist()))


def _thing(rng: np.random.Generator, body: Body, q: np.ndarray, rounded: bool, name: str) -> ThingSettings:
    margin = float(rng.choice([0.0, 0.005, 0.02]))
    shape, pose = _placed(rng, body, q, rounded, margin)
    return ThingSettings(name, shape, pose, margin, {})


def _placed(
    rng: np.random.Generator, body: Body, q: np.ndarray, rounded: bool, margin: float
) -> tuple[Shape, PoseSettings]:
    """Some shape beside the way of some capsule, or in it."""
    ends, towards = body.at(q[rng.integers(len(q), size=1)])[0], rng.normal(size=3)
    towards /= np.linalg.norm(towards)
    part = rng.choice([k for k, (link, *_) in enumerate(body.capsules) if link > 0])
    shape, size = _shape(rng, rounded)
    away = body.radii[part] + margin + size + float(rng.choice([0.002, rng.uniform(-0.01, 0.4)]))
    at = ends[part, 0] + rng.random() * (ends[part, 1] - ends[part, 0]) + away * towards
    if isinstance(shape, HalfSpaceShape):
        lowest = body.at(q)[..., 2].min() - body.radii.max()
        return shape, PoseSettings((0.0, 0.0, float(np.round(lowest + rng.uniform(-0.1, 0.05), 2))), UPRIGHT)
    return shape, _pose(rng, at, rounded)


def _shape(rng: np.random.Generator, rounded: bool) -> tuple[Shape, float]:
    """And about half of how thick it is."""
    a, b, c = np.round(rng.uniform(0.05, 0.4, 3), 2 if rounded else 9).tolist()
    match int(rng.integers(8)):
        case 0 | 1:
            return BoxShape((a, b, c)), min(a, b, c) / 2.0
        case 2:
            return BoxShape((2.0 * a, 2.0 * b, THIN_M)), 0.0
        case 3:
            return SphereShape(a / 2.0), a / 2.0
        case 4:
            return CylinderShape(a / 2.0, 2.0 * b), a / 2.0
        case 5:
            corners = np.array([(x, y, z) for x in (-a, a) for y in (-b, b) for z in (-c, c)]) / 2.0
            sheared = corners @ (np.eye(3) + 0.3 * np.round(rng.uniform(-1.0, 1.0, (3, 3)), 1))
            return HullShape(tuple(map(tuple, sheared.tolist()))), min(a, b, c) / 2.0
        case 6:
            return MeshShape(_ball_file(), 0.001), 0.1
        case _:
            return HalfSpaceShape(), 0.0


def _spaces(rng: np.random.Generator, body: Body, q: np.ndarray, rounded: bool) -> Iterator[SpaceSettings]:
    """One or two safe ones about the motion with more or less room, and sometimes a forbidden one."""
    of, margin = SpaceOf(rng.choice(["body", "tcp"])), float(rng.choice([0.0, 0.01]))
    if rng.random() < 0.5:
        shape, pose = _placed(rng, body, q, rounded, margin)
        yield SpaceSettings("shelf", SpaceKind.FORBIDDEN, shape, pose, margin, of)
        return
    parts = [k for k, (link, *_) in enumerate(body.capsules) if link > 0] if of is SpaceOf.BODY else [-4]
    turn = _pose(rng, np.zeros(3), rounded).quaternion_xyzw
    local = (body.at(q)[:, parts] @ rotation(turn)).reshape(len(q), -1, 2, 3)
    radii = body.radii[parts, None] + margin
    low, high = ((local + sign * radii[..., None]) for sign in (-1.0, 1.0))
    low, high = low.min(axis=(0, 1, 2)), high.max(axis=(0, 1, 2))
    room = rng.uniform(-0.005, 0.1, (2, 3)) if rng.random() < 0.7 else np.full((2, 3), 0.05)
    low, high = low - room[0], high + room[1]
    axis, seam = int(rng.integers(3)), rng.uniform(0.3, 0.7)
    cut = low[axis] + seam * (high[axis] - low[axis])
    overlap = float(rng.choice([0.0, 0.05]))
    for name, side in (("one", 1), ("two", -1)):
        a, b = low.copy(), high.copy()
        if side > 0:
            b[axis] = cut + overlap
        else:
            a[axis], b[(axis + 1) % 3] = cut - overlap, b[(axis + 1) % 3] - rng.choice([0.0, 0.05])
        middle = rotation(turn) @ ((a + b) / 2.0)
        pose = PoseSettings(tuple(middle.tolist()), turn)
        yield SpaceSettings(name, SpaceKind.SAFE, BoxShape(tuple((b - a).tolist())), pose, margin, of)


def _plate(rng: np.random.Generator, body: Body, motion: Motion) -> SpaceSettings:
    """A forbidden one for the TCP alone, somewhere on its way."""
    at = rng.uniform(0.2, 0.8) * motion.duration_s
    before, here, after = body.at(motion.q(at + np.array([-1e-3, 0.0, 1e-3])))[:, -4, 0]
    z = (after - before) / max(float(np.linalg.norm(after - before)), 1e-12)
    if not z.any():
        z = np.eye(3)[2]
    x = np.cross(np.eye(3)[int(np.abs(z).argmin())], z)
    x /= np.linalg.norm(x)
    turn = tuple(from_matrix(np.stack([x, np.cross(z, x), z], axis=-1)).tolist())
    shape = BoxShape((0.05, 0.05, _PLATE_M))
    return SpaceSettings(
        "plate", SpaceKind.FORBIDDEN, shape, PoseSettings(tuple(here.tolist()), turn), 0.0, SpaceOf.TCP
    )


def _cone(rng: np.random.Generator, body: Body, q: np.ndarray) -> OrientationSettings:
    axis = int(rng.integers(3))
    ends = body.at(q)[:, -3 + axis, 0]
    tilts = np.arccos(np.clip(ends @ ends[0], -1.0, 1.0))
    return OrientationSettings(
        axis, tuple(ends[0].tolist()), float(np.clip(tilts.max() * rng.uniform(0.5, 1.3), 0.05, 3.0))
    )


_FOLDER = TemporaryDirectory(prefix="zencell_meshes_")
atexit.register(_FOLDER.cleanup)


@cache
def _ball_file() -> Path:
    return ball_file(Path(_FOLDER.name))


@cache
def truth(seed: int, every_s: float = np.inf, poses: int = POSES) -> tuple[World, float, float, str] | None:
    """A world, and what brute force sees in it, no more than `every_s` apart."""
    world = drawn(seed)
    if world is None:
        return None
    body = Body(world.model, PlacedRobot.at(world.model, world.base).pose_world_base)
    told = seen(body, world.motion, watched(body, world.things, world.spaces, world.cone, poses), every_s)
    return world, told.near_s, told.short_s, told.by


def verdict(seed: int, every_s: float = np.inf) -> Verdict | None:
    """What the planner tells of a world, against brute force; None where there is no world with this number.

    A pair of links that touches in nearly all poses is kept apart by whoever finds one in which it does not: where they
    do not agree brute force looks at more poses.
    """
    known = truth(seed, every_s)
    if known is None:
        return None
    told_s = known[0].told_s()
    found = Verdict(*known[1:], told_s)
    if not found.right and (known := truth(seed, every_s, MANY_POSES)):
        found = Verdict(*known[1:], told_s)
    return found
