"""How far a point is out of a convex part of a room, by its planes alone."""

import numpy as np

from cell.geometry import Convex


def height(part: Convex, points: np.ndarray) -> np.ndarray:
    """By how much `points` `(..., 3)` are beyond the plane they are farthest beyond, `(...)` [m]; below 0 inside.

    Outside it is at most the distance, inside it is exactly minus the distance from the surface.
    """
    return np.asarray(part.beyond(points).max(axis=-1))
