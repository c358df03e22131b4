"""Where along a path the body of a robot, or its TCP alone, enters and leaves zones."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cell.geometry import Solid, WrongShape, capsules_touch
from cell.geometry.arrays import Array, Flags
from cell.messages import ZoneGeometry
from robot_agent.workspace.swept_body import Sweep


@dataclass(frozen=True, slots=True)
class Crossing:
    """Path time [s] within which a zone is touched. At both ends the body is outside, unless they are the path's."""

    zone: str
    enter_tau: float
    leave_tau: float


def crossings(path: Sweep, taus: Array, zone: ZoneGeometry, margin_m: float) -> list[Crossing]:
    """All intervals of `taus` `(m,)` in which the body, or the TCP, comes nearer to the zone than `margin_m`, in order.

    Never too short: each sample counts for what lies within half a step around it, and an interval begins at the last
    sample that is clear of the zone and ends at the next one that is.
    """
    if taus.shape != (len(path.points),):
        raise WrongShape("taus", taus.shape, f"({len(path.points)},)")
    near = _near(path.of(zone.of), zone.solid(), margin_m)
    return [Crossing(zone.zone, enter, leave) for enter, leave in intervals(near, taus)]


def with_entry(crossings: Sequence[Crossing]) -> list[tuple[Crossing, float]]:
    """Each crossing, and where [s] the first is entered of those that overlap or touch one another up to it.

    Beyond that place a robot cannot stop outside all of them before it has left the last one.
    """
    found, entry, left = list[tuple[Crossing, float]](), 0.0, -np.inf
    for crossing in sorted(crossings, key=lambda crossing: crossing.enter_tau):
        if crossing.enter_tau > left:
            entry = crossing.enter_tau
        left = max(left, crossing.leave_tau)
        found.append((crossing, entry))
    return found


def intervals(touched: Flags, taus: Array) -> list[tuple[float, float]]:
    """From the last path time before each run of `touched` `(m,)` to the first one after it; at the ends the end."""
    edges = np.diff(np.concatenate([[False], touched, [False]]).astype(np.int8))
    before = np.maximum(np.flatnonzero(edges == 1) - 1, 0)
    after = np.minimum(np.flatnonzero(edges == -1), len(taus) - 1)
    return list(zip(taus[before].tolist(), taus[after].tolist(), strict=True))


def half_steps(path: Sweep) -> Array:
    """How far each capsule may be away from each sample up to half a step to either side: `(m, c)` [m]."""
    steps = path.chords / 2 + path.bulge[:, None]
    around = np.zeros(path.points.shape[:2])
    around[:-1] = steps
    around[1:] = np.maximum(around[1:], steps)
    return around


def _near(path: Sweep, solid: Solid, margin_m: float) -> Flags:
    """Samples `(m,)` around which, up to half a step to either side, some capsule is nearer than the margin."""
    around = half_steps(path)
    return np.asarray(capsules_touch(path.points, path.radii + around + margin_m, solid).any(axis=-1))
