"""The capsules of a robot along a dense joint path, with bounds for what lies between the samples."""

from dataclasses import dataclass

import numpy as np

from cell.geometry import SpaceOf, WrongShape, transform_points
from cell.geometry.arrays import Array
from robot_agent.kinematics import Model


@dataclass(frozen=True, slots=True, eq=False)
class Sweep:
    """Capsules and the TCP of `m` samples of a joint path in world; `c` capsules."""

    points: Array
    """`(m, c, 2, 3)` end points [m]."""
    radii: Array
    """`(c,)` [m]."""
    chords: Array
    """`(m - 1, c)` [m]: straight distance of the farther-moving end point from one sample to the next."""
    bulge: Array
    """`(m - 1,)` [m]: between two samples no end point, nor the TCP, is farther than this from the straight line."""
    tcp: Array
    """`(m, 3)` [m]."""

    def part(self, first: int, last: int) -> "Sweep":
        """From sample `first` to sample `last`, inclusive."""
        here, steps = slice(first, last + 1), slice(first, last)
        return Sweep(self.points[here], self.radii, self.chords[steps], self.bulge[steps], self.tcp[here])

    def of(self, what: SpaceOf) -> "Sweep":
        """What of the robot a zone looks at: all of it, or its TCP as one capsule of radius and length 0."""
        if what is SpaceOf.BODY:
            return self
        chords = np.linalg.norm(np.diff(self.tcp, axis=0), axis=-1)[:, None]
        return Sweep(np.repeat(self.tcp[:, None, None], 2, axis=2), np.zeros(1), chords, self.bulge, self.tcp)


def sweep(model: Model, pose_world_base: Array, q: Array, links: Array | None = None) -> Sweep:
    """The swept body of a joint path `q` `(m, n)`, its samples evenly apart in time or in way.

    `links`: `Model.links` at these joints, for who has them already.
    """
    q = np.asarray(q, dtype=float)
    if q.ndim != 2 or len(q) == 0:
        raise WrongShape("joint path", q.shape, f"(m, {model.n}) with m > 0")
    links = model.links(q) if links is None else links
    points = transform_points(pose_world_base, model.capsules_of(links))
    chords = np.linalg.norm(np.diff(points, axis=0), axis=-1).max(axis=-1)
    tcp = transform_points(pose_world_base, model.tcp_at(links[:, -1])[:, :3, 3])
    return Sweep(points, model.capsule_radii, chords, model.bulge_m(q), tcp)
