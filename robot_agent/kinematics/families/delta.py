"""Delta robot: three arms at 0, 120 and 240 degrees carry a platform; a fourth axis, if there is one, turns the flange.

Lengths: r from the centre to the arms' axes, h the arms, k the rods, s from the centre of the platform to the rods, t
from there down to the flange. Positive joints turn the arms down. Frigeni, appendix, with (A-115) to (A-117) corrected
and the root of (A-108) checked: rods longer than arms do not always meet.

Only assemblies with the elbows outside and the platform below them count: to any other the mechanism would have to pass
through a singular pose.
"""

from typing import ClassVar

import numpy as np
from pydantic import BaseModel, Field

from cell.config.units import STRICT, Length, PositiveLength
from cell.geometry.arrays import Array
from robot_agent.kinematics.errors import OpenMechanism
from robot_agent.kinematics.families.closed_form import ClosedForm, Raw
from robot_agent.kinematics.families.triangle import REACH_TOLERANCE_M, beyond, beyond_reach, elbow_triangle
from robot_agent.kinematics.families.upright import TILT_TOLERANCE_RAD, heading, tilt
from robot_agent.kinematics.problems import checked_lengths
from robot_agent.kinematics.reach import Places, placed, points, together, turned
from robot_agent.kinematics.singularity import SingularityDistance
from robot_agent.model.description import RobotDescription
from robot_agent.model.families import ClosedFormFile, family

PHI = np.radians([0.0, 120.0, 240.0])
OUTWARD = np.stack([np.cos(PHI), np.sin(PHI), np.zeros(3)], axis=-1)
"""`(3, 3)`: a row for each arm."""
ASIDE = np.stack([-np.sin(PHI), np.cos(PHI), np.zeros(3)], axis=-1)
DOWN = np.array([0.0, 0.0, -1.0])


class DeltaGeometry(BaseModel):
    """Lengths of a delta robot; the arms are at 0, 120 and 240 degrees from +X."""

    model_config = STRICT
    r: PositiveLength = Field(description="centre of the base to the axes of the arms")
    h: PositiveLength = Field(description="arms: axis to elbow")
    k: PositiveLength = Field(description="rods: elbow to platform")
    s: PositiveLength = Field(description="centre of the platform to the rods")
    t: Length = Field(description="centre of the platform down to the flange")


@family(
    "delta",
    "A delta robot with three or four axes.",
    ClosedFormFile[DeltaGeometry],
    joints="RRRR",
    links="base arm1 arm2 arm3 rod1 rod2 rod3 flange",
    fewest=3,
    no_masses="none: its arms are closed chains, whose torques are not computed",
)
class Delta(ClosedForm):
    """See the module; one branch, the elbows outside."""

    branches: ClassVar[tuple[str, ...]] = ("OUT",)

    slots: ClassVar[tuple[int, ...]] = (1,)

    def __init__(self, description: RobotDescription) -> None:
        g = checked_lengths(description, positive=("h", "k"))
        self._r, self._h, self._k, self._s, self._t = (g[name] for name in ("r", "h", "k", "s", "t"))
        super().__init__(description)

    def links(self, q: Array) -> Array:
        q = self.check_joints(q)
        arms, elbows, platform = self._assembly(q)
        frames = np.zeros((*q.shape[:-1], 8, 4, 4))
        frames[..., 3, 3] = 1
        frames[..., 0, :, :] = np.eye(4)
        rods = platform[..., None, :] + self._s * OUTWARD - elbows
        for first, origins, along in ((1, self._r * OUTWARD, arms), (4, elbows, rods / self._k)):
            across = np.cross(along, ASIDE)
            across /= np.linalg.norm(across, axis=-1, keepdims=True)
            columns = np.stack([along, np.cross(across, along), across], axis=-1)
            frames[..., first : first + 3, :3, :3] = columns
            frames[..., first : first + 3, :3, 3] = origins
        turn = q[..., 3] if self.n == 4 else np.zeros(q.shape[:-1])
        frames[..., 7, 0, 0] = frames[..., 7, 1, 1] = np.cos(turn)
        frames[..., 7, 1, 0] = np.sin(turn)
        frames[..., 7, 0, 1] = -frames[..., 7, 1, 0]
        frames[..., 7, 2, 2] = 1
        frames[..., 7, :3, 3] = platform + self._t * DOWN
        return frames

    def joined_links(self) -> frozenset[tuple[int, int]]:
        return frozenset((one, other) for arm in (1, 2, 3) for one, other in ((0, arm), (arm, arm + 3), (arm + 3, 7)))

    def flange_jacobian(self, q: Array) -> Array:
        q = self.check_joints(q)
        rods, swings = self._rods_and_swings(q)
        result = np.zeros((*q.shape[:-1], 6, self.n))
        result[..., :3, :3] = _solve(rods, _diagonal((rods * swings).sum(axis=-1)))
        if self.n == 4:
            result[..., 5, 3] = 1
        return result

    def flange_jacobian_derivative(self, q: Array, qd: Array) -> Array:
        q, speeds = self.check_joints(q), self.check_joints(qd, "joint speeds")[..., :3]
        rods, swings = self._rods_and_swings(q)
        jacobian = _solve(rods, _diagonal((rods * swings).sum(axis=-1)))
        rod_speeds = (jacobian @ speeds[..., None])[..., None, :, 0] - swings * speeds[..., None]
        # The swing is perpendicular to the arm and turns with it, towards the arm's axis.
        swing_speeds = -self._h * self._arms(q) * speeds[..., None]
        right = _diagonal((rod_speeds * swings + rods * swing_speeds).sum(axis=-1)) - rod_speeds @ jacobian
        result = np.zeros((*q.shape[:-1], 6, self.n))
        result[..., :3, :3] = _solve(rods, right)
        return result

    def singularity(self, q: Array) -> SingularityDistance:
        rods, swings = self._rods_and_swings(self.check_joints(q))
        stretched = np.abs((rods * swings).sum(axis=-1)) / (self._h * self._k)
        flat = np.abs(np.linalg.det(rods / self._k))
        return SingularityDistance(
            ("arm 1", "arm 2", "arm 3", "platform"), np.concatenate([stretched, flat[..., None]], axis=-1)
        )

    def branches_of(self, elements: Array, held: Array) -> Raw:  # noqa: ARG002 - no joint is ever free
        platform = elements[:3, 3] - self._t * DOWN[:, None]
        out, aside, up = OUTWARD @ platform, ASIDE @ platform, platform[2]
        ahead = out + self._s - self._r
        rod = np.sqrt(np.maximum((self._k - aside) * (self._k + aside), 0))
        off_plane = beyond(np.abs(aside) - self._k)
        squared = ahead * ahead + up * up
        in_plane = beyond_reach(np.sqrt(squared), self._h, rod)
        beta = elbow_triangle(squared, self._h, np.maximum(rod, REACH_TOLERANCE_M)).at_joint
        # Of the two elbows the one that lies farther out.
        j = np.arctan2(-up, ahead) + np.where(up > 0, beta, -beta)
        excess = np.where(off_plane > 0, off_plane, in_plane)
        worst = np.take_along_axis(excess, np.abs(excess).argmax(axis=0)[None], axis=0)[0]
        return Raw(
            joints=(*j, heading(elements))[: self.n],
            excess_m=worst,
            singular=np.zeros(len(up), dtype=bool),
            tilt_rad=tilt(elements) if self.n == 4 else _turned(elements),
        )

    def bulge_m(self, q: Array) -> Array:
        """As for every model, from the second differences of the points: closed chains have no bound by the reach."""
        bends = np.zeros(max(len(q) - 1, 0))
        if len(q) > 2:
            second = np.linalg.norm(np.diff(self.body_and_tcp(q), n=2, axis=0), axis=-1).max(axis=(1, 2))
            bends[:-1] = second
            bends[1:] = np.maximum(bends[1:], second)
        return bends / 4

    def _arms(self, q: Array) -> Array:
        """Unit vectors along the arms `(..., 3, 3)`, one row each."""
        cosines, sines = np.cos(q[..., :3, None]), np.sin(q[..., :3, None])
        return np.asarray(cosines * OUTWARD + sines * DOWN)

    def _assembly(self, q: Array) -> tuple[Array, Array, Array]:
        """Arms `(..., 3, 3)`, elbows `(..., 3, 3)` [m], and the centre of the platform `(..., 3)` [m].

        The centre has the distance k from each elbow moved inwards by s: it is on the line through the centre of the
        circle through these three points, along the circle's axis, below.
        """
        arms = self._arms(q)
        elbows = self._r * OUTWARD + self._h * arms
        centres = elbows - self._s * OUTWARD
        u, v = centres[..., 1, :] - centres[..., 0, :], centres[..., 2, :] - centres[..., 0, :]
        normal = np.cross(u, v)
        square = (normal**2).sum(axis=-1, keepdims=True)
        uu, vv = (u**2).sum(axis=-1, keepdims=True), (v**2).sum(axis=-1, keepdims=True)
        with np.errstate(divide="ignore", invalid="ignore"):
            to_middle = np.cross(uu * v - vv * u, normal) / (2 * square)
            below = self._k**2 - (to_middle**2).sum(axis=-1, keepdims=True)
            apart = ~(below[..., 0] >= 0)
        if apart.any():
            index = tuple(int(i) for i in np.argwhere(apart)[0]) if apart.ndim else ()
            raise OpenMechanism(index, q[index])
        direction = normal * np.where(normal[..., 2:] > 0, -1, 1) / np.sqrt(square)
        return arms, elbows, centres[..., 0, :] + to_middle + np.sqrt(below) * direction

    def _rods_and_swings(self, q: Array) -> tuple[Array, Array]:
        """Rods from elbow to platform, and elbow velocity per joint velocity: `(..., 3, 3)` [m], a row per arm."""
        _, elbows, platform = self._assembly(q)
        rods = platform[..., None, :] + self._s * OUTWARD - elbows
        cosines, sines = np.cos(q[..., :3, None]), np.sin(q[..., :3, None])
        return rods, self._h * (cosines * DOWN - sines * OUTWARD)

    def _places(self, link: int, at: Array) -> Places:
        """The platform is where three rods meet: in each of the hulls that rods from one circle of elbows fill."""
        if link == 0:
            return points(at)
        arm = (link - 1) % 3
        if link <= 3:
            return self._about_arm(arm, points(at))
        if link == 7:
            return together(self._platforms, turned(placed(points(at), self._t * DOWN), 2))
        return self._on_rod(arm, at)

    def _about_arm(self, arm: int, places: Places) -> Places:
        """Places on a link that turns about the axis of an arm."""
        sideways = np.stack([OUTWARD[arm], ASIDE[arm], -DOWN], axis=-1)
        return placed(turned(places, 1), self._r * OUTWARD[arm], sideways)

    def _platforms(self, u: Array) -> Array:
        """Smallest of the three support functions of the hulls, for the centre of the platform."""
        elbow = points(np.array([[self._h, 0.0, 0.0]]))
        rods = self._k * np.linalg.norm(u, axis=-1)[..., None]
        hulls = [placed(self._about_arm(i, elbow), -self._s * OUTWARD[i])(u) + rods for i in range(3)]
        return np.asarray(np.min(hulls, axis=0))

    def _on_rod(self, arm: int, at: Array) -> Places:
        """Between elbow and platform, and as far aside or beyond as the points are."""
        elbow = self._about_arm(arm, points(np.array([[self._h, 0.0, 0.0]])))
        platform = placed(self._platforms, self._s * OUTWARD[arm])
        beyond_ends = np.maximum(np.abs(at[:, 0] - self._k / 2) - self._k / 2, 0)
        off = np.hypot(np.linalg.norm(at[:, 1:], axis=-1), beyond_ends)
        return lambda u: np.maximum(elbow(u), platform(u)) + off * np.linalg.norm(u, axis=-1)[..., None]


def _turned(elements: Array) -> Array:
    """Angle [rad] `(p,)` of poses `(4, 4, p)`: a platform without a fourth axis does not turn at all."""
    (xx, xy, xz), (yx, yy, yz), (zx, zy, zz) = elements[:3, :3]
    sine = np.sqrt((zy - yz) ** 2 + (xz - zx) ** 2 + (yx - xy) ** 2)
    angle = np.arctan2(sine, xx + yy + zz - 1)
    return np.where(angle > TILT_TOLERANCE_RAD, angle, 0.0)


def _diagonal(values: Array) -> Array:
    return values[..., None] * np.eye(3)


def _solve(rods: Array, right: Array) -> Array:
    """The platform's velocities from those along the rods; the least ones where the rods lie in one plane."""
    flat = np.abs(np.linalg.det(rods)) < 1e-12 * np.prod(np.linalg.norm(rods, axis=-1), axis=-1)
    return np.asarray(np.linalg.pinv(rods) @ right if flat.any() else np.linalg.solve(rods, right))
