"""A planned motion cut into sections: what covers the body wherever it is within each."""

from dataclasses import dataclass
from hashlib import blake2b
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cell.geometry import transform_points
from cell.geometry.arrays import Array
from cell.messages import Body, Sections
from cell.messages.sections import Single
from robot_agent.kinematics import Model
from robot_agent.workspace.swept_body import Sweep

FOLLOWING_M = 0.010
"""So far the measured robot may be from the commanded one."""
_LASTS_S, _LENGTH_M = 0.010, 0.010
_ROUNDING = float(np.sqrt(3.0) * np.finfo(np.float32).epsneg)


@dataclass(frozen=True, slots=True, eq=False)
class MotionSections:
    """Section `i` covers the body wherever the robot is with its tau in `taus[i]` to `taus[i + 1]`."""

    taus: Array
    """`(s + 1,)` [s]"""
    sections: Sections


def cut(path: Sweep, taus: Array) -> MotionSections:
    m = len(taus)
    if m == 1:
        return MotionSections(np.array([taus[0], taus[0]]), of_points(path.points, path.radii + FOLLOWING_M))
    travelled = np.concatenate([[0.0], path.chords.max(axis=-1).cumsum()])
    starts, at = [], 0
    while at < m - 1:
        starts.append(at)
        by_time = int(np.searchsorted(taus, taus[at] + _LASTS_S - 1e-9))
        by_way = int(np.searchsorted(travelled, travelled[at] + _LENGTH_M, side="right")) - 1
        at = min(max(at + 1, by_time, by_way), m - 1)
    ends = [*starts[1:], m - 1]
    growth = []
    for first, last in zip(starts, ends, strict=True):
        moved = np.linalg.norm(path.points[first : last + 1] - path.points[first], axis=-1).max()
        growth.append(moved + path.bulge[first:last].max())
    radii = path.radii[None] + np.array(growth)[:, None] + FOLLOWING_M
    return MotionSections(taus[[*starts, m - 1]], of_points(path.points[starts], radii))


def extended(old: MotionSections, cut_s: float, splice_s: float, onward: MotionSections) -> MotionSections:
    old_taus = old.taus - cut_s
    keep = np.flatnonzero((old_taus[:-1] < splice_s) & (old_taus[1:] > 0.0))
    kept = old.sections[keep]
    taus = np.concatenate([old_taus[keep], onward.taus])
    return MotionSections(taus, kept.joined(onward.sections))


def standing(model: Model, pose_world_base: Array, q: Array, reserve_m: float = 0.0) -> Sections:
    """Of a robot at `q` `(n,)`."""
    points = transform_points(pose_world_base, model.capsules(q))[None]
    return of_points(points, model.capsule_radii + FOLLOWING_M + reserve_m)


def sections_of(body: Body) -> Sections:
    """A section for each pose of a known body."""
    grown = body.radii_m + body.growth_m[:, None].astype(float)
    return of_points(body.poses.astype(float), grown)


def of_points(points: Array, radii: NDArray[np.floating[Any]]) -> Sections:
    """Sections of capsules `(s, c, 2, 3)` with radii that broadcast to `(s, c)` [m]."""
    rounding = _ROUNDING * float(np.abs(points).max(initial=0.0))
    grown = np.broadcast_to(np.asarray(radii) + rounding, points.shape[:2])
    singles: Single = np.ascontiguousarray(points, np.float32)
    up = np.nextafter(grown.astype(np.float32), np.float32(np.inf))
    return Sections(ids_of(singles, up), singles, up)


def ids_of(points: Single, radii: Single) -> np.ndarray:
    data = np.concatenate([points.reshape(len(points), -1), radii], axis=1)
    return np.array(
        [int.from_bytes(blake2b(row.tobytes(), digest_size=8).digest(), "little") or 1 for row in data], np.uint64
    )
