"""The capsules of a robot along a dense joint path, with bounds for what lies between the samples."""

from dataclasses import dataclass

import numpy as np

from cell.geometry import WrongShape, transform_points
from cell.geometry.arrays import Array
from robot_agent.kinematics import Model


@dataclass(frozen=True, slots=True, eq=False)
class Sweep:
    """Capsules of `m` samples of a joint path in world; `c` capsules."""

    points: Array
    """`(m, c, 2, 3)` end points [m]."""
    radii: Array
    """`(c,)` [m]."""
    chords: Array
    """`(m - 1, c)` [m]: straight distance of the farther-moving end point from one sample to the next."""
    bulge: Array
    """`(m - 1,)` [m]: between two samples no end point is farther than this from the straight line between them."""

    def part(self, first: int, last: int) -> "Sweep":
        """From sample `first` to sample `last`, inclusive."""
        return Sweep(self.points[first : last + 1], self.radii, self.chords[first:last], self.bulge[first:last])


def sweep(model: Model, pose_world_base: Array, q: Array, links: Array | None = None) -> Sweep:
    """The swept body of a joint path `q` `(m, n)`, its samples evenly apart in time or in way.

    `links`: `Model.links` at these joints, for who has them already.
    """
    q = np.asarray(q, dtype=float)
    if q.ndim != 2 or len(q) == 0:
        raise WrongShape("joint path", q.shape, f"(m, {model.n}) with m > 0")
    points = transform_points(pose_world_base, model.capsules(q) if links is None else model.capsules_of(links))
    chords = np.linalg.norm(np.diff(points, axis=0), axis=-1).max(axis=-1)
    return Sweep(points, model.capsule_radii, chords, model.bulge_m(q))
