"""Jogs and corrections at full speed towards a border, and how near to its margin they come."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from cell.config.settings import (
    BoxShape,
    HalfSpaceShape,
    PoseSettings,
    SpaceKind,
    SpaceSettings,
    ThingSettings,
)
from cell.geometry import SpaceOf
from cell.geometry.quaternion import from_matrix
from robot_agent.kinematics import load_model
from robot_agent.trajectory import Governor, Limits
from robot_agent.trajectory.sources import CorrectedSource, JogSource, States, Target
from robot_agent.workspace import Spaces, Things, sweep
from tests.unit.jog_world import ARM, Jogged
from tests.unit.jog_world import START as JOG_START
from tests.unit.repository import ROOT
from tests.unit.robot_agent.trajectory.sources.corrected_moves import (
    CHANGES,
    CYCLE_S,
    FAST,
    LIMITS,
    NOMINAL,
    SLOW,
    STEP,
)

WORLD = np.eye(4)
MARGIN_M = 0.005
CLOSE_M = 0.02
"""A robot stops no farther in front of a margin."""
EXACT_M = 1e-6
TOO_NEAR_EVERY = 5
STILL_BLOCKS = 20
"""A correction that stands so long stays there."""
MODELS = sorted((ROOT / "cell_configs" / "models").glob("*.yaml"))
Clear = Callable[[States], str]


@dataclass(frozen=True)
class Plane:
    """A border across the way: `away_m` from the body at joints `q`, its free side in the direction of `normal`."""

    model: object
    normal: np.ndarray
    height: float

    @classmethod
    def before(cls, model: object, normal: np.ndarray, q: np.ndarray, away_m: float) -> "Plane":
        return cls(model, normal, float(cls(model, normal, 0.0).gaps(q).min()) - away_m)

    def gaps(self, q: np.ndarray) -> np.ndarray:
        """How far the moving body is from the margin `(m,)` [m]."""
        model = self.model
        moving = np.array([capsule.link > 0 for capsule in model.body])  # type: ignore[attr-defined]
        ends, radii = model.capsules(q)[:, moving], model.capsule_radii[moving]  # type: ignore[attr-defined]
        heights = (ends @ self.normal).min(axis=-1) - radii
        return np.asarray(heights.min(axis=-1) - self.height - MARGIN_M)

    def clear(self, kind: int) -> Clear:
        """As a thing without end, as a forbidden plate, or as the side of a safe space."""
        x = np.cross(self.normal, np.eye(3)[int(np.abs(self.normal).argmin())])
        x /= np.linalg.norm(x)
        turn = tuple(from_matrix(np.stack([x, np.cross(self.normal, x), self.normal], axis=-1)).tolist())

        def at(height: float) -> PoseSettings:
            return PoseSettings(tuple((self.normal * height).tolist()), turn)

        if kind == 0:
            things = Things(self.model, (ThingSettings("border", HalfSpaceShape(), at(self.height), MARGIN_M, {}),))  # type: ignore[arg-type]
            return lambda states: things.in_the_way(sweep(self.model, WORLD, states.q))  # type: ignore[arg-type]
        thick = 1.0 if kind == 1 else 30.0
        middle = self.height - thick / 2.0 if kind == 1 else self.height + thick / 2.0
        what = SpaceKind.FORBIDDEN if kind == 1 else SpaceKind.SAFE
        shape = BoxShape((30.0, 30.0, thick))
        spaces = Spaces(self.model, (SpaceSettings("border", what, shape, at(middle), MARGIN_M, SpaceOf.BODY),))  # type: ignore[arg-type]

        def clear(states: States) -> str:
            path = sweep(self.model, WORLD, states.q)  # type: ignore[arg-type]
            return spaces.in_the_way(spaces.watched(path, WORLD, self.model.forward(states.q)), ())

        return clear


def jog(seed: int) -> tuple[np.ndarray, bool]:
    """Gaps of all that was commanded, and whether the border has stopped it; some begin too near to it."""
    rng = np.random.default_rng([seed, 5])
    model = ARM if seed % 2 else load_model(MODELS[seed // 2 % len(MODELS)])
    limits = Limits.of(model.description)
    lower, upper = model.limits.position.T
    if seed % 2:
        start = JOG_START + rng.uniform(-0.2, 0.2, 6)
    else:
        start = np.clip(model.home + 0.15 * rng.uniform(-1, 1, model.n) * (upper - lower), lower + 0.05, upper - 0.05)
    axis = int(rng.integers(model.n)) if rng.random() < 0.5 else "XYZ"[rng.integers(3)]
    sign = float(rng.choice([-1.0, 1.0]))
    speed = sign * (float(limits.velocity[axis]) if isinstance(axis, int) else 0.25)
    free = Jogged(start, model, limits)
    free.run(free.press(axis, speed), 60)
    ways = model.capsules(np.array([start, free.q]))
    farthest = np.unravel_index(int(np.linalg.norm(ways[1] - ways[0], axis=-1).argmax()), ways.shape[1:3])
    way = ways[1][farthest] - ways[0][farthest]
    if np.linalg.norm(way) < 0.03:
        return np.array([np.inf]), False
    normal = -way / np.linalg.norm(way)
    if seed % 3 == 0:
        normal = np.eye(3)[int(np.abs(normal).argmax())] * np.sign(normal[int(np.abs(normal).argmax())])
    away = float(rng.uniform(0.005, 0.5 * np.linalg.norm(way)))
    if seed % TOO_NEAR_EVERY == 0:
        away, normal = -away / 2.0, normal * rng.choice([-1.0, 1.0])
    plane = Plane.before(model, normal, start[None], MARGIN_M + away)
    jogged = Jogged(start, model, limits)
    key: JogSource = jogged.press(axis, speed, clear=plane.clear(int(rng.integers(3))))
    for block in range(400):
        jogged.block(key)
        if block > 20 and not jogged.way.qd.any():
            break
    gaps = plane.gaps(np.concatenate([np.array(jogged.played), jogged.way.q]))
    return gaps, "border" in key.ruled_by and not jogged.way.qd.any()


def correction(seed: int) -> tuple[np.ndarray, bool]:
    """As `jog`, of a path whose correction is asked to go through the border."""
    rng = np.random.default_rng([seed, 6])
    motion = (SLOW, FAST)[seed % 2]
    towards = rng.normal(size=3)
    if seed % 3 == 0:
        towards = np.eye(3)[rng.integers(3)] * rng.choice([-1.0, 1.0])
    towards /= np.linalg.norm(towards)
    path = motion.q(np.linspace(0.0, motion.duration_s, 200))
    away = float(rng.uniform(0.005, 0.1))
    plane = Plane.before(ARM, -towards, path, MARGIN_M + away)
    governor = Governor(motion, LIMITS, CYCLE_S, nominal_s=NOMINAL * CYCLE_S)
    source = CorrectedSource(
        ARM, LIMITS, governor, governor.rest(0.0), CHANGES, clear=plane.clear(int(rng.integers(3)))
    )
    target = Target(np.concatenate([(away + 0.1) * towards, np.zeros(3)]), np.zeros(6))
    played, still = [path[0]], 0
    for _ in range(300):
        source.target = target
        given = source.samples(NOMINAL).then(source.brake())
        played += list(given.q)
        still = 0 if given.qd[:STEP].any() else still + 1
        if still > (0 if source.tau > motion.duration_s - EXACT_M else STILL_BLOCKS):
            break
        source.resume(STEP)
    return plane.gaps(np.array(played)), "border" in source.ruled_by and still > 0


def fault(found: tuple[np.ndarray, bool]) -> str:
    """What is wrong in a run, empty for nothing: it comes into the margin, deeper than it began, or stands far off."""
    gaps, stopped = found
    deeper = min(float(gaps[0]), 0.0) - float(gaps.min())
    if deeper > EXACT_M:
        return f"comes {1000.0 * deeper:.2f} mm {'deeper ' if gaps[0] < 0.0 else ''}into a margin"
    return f"stands {1000.0 * gaps[-1]:.0f} mm in front of a margin" if stopped and gaps[-1] > CLOSE_M else ""


def judge(found: tuple[np.ndarray, bool]) -> bool:
    """Whether a border has stopped it."""
    assert not fault(found)
    return found[1]
