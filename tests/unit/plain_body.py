"""A published body from plain numbers."""

import numpy as np

from cell.messages import Body

Capsule = tuple[float, float, float, float, float, float]


def plain_body(
    radii: tuple[float, ...],
    poses: tuple[tuple[Capsule, ...], ...],
    growth: tuple[float, ...],
    *,
    known: bool = True,
    base: tuple[float, float, float] = (0.0, 0.0, 0.0),
    reach_m: float = 1.0,
) -> Body:
    """Capsules with `radii`, in each pose by their ends (ax, ay, az, bx, by, bz); the TCP is the last one's second."""
    points = np.array(poses, np.float32).reshape(len(poses), len(radii), 2, 3)
    tcp = points[:, -1, 1] if radii else np.empty((0, 3), np.float32)
    return Body(known, base, reach_m, np.array(radii, np.float32), points, np.array(growth, np.float32), tcp)
