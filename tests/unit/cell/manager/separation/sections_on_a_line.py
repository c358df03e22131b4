"""Sections of a robot that is a ball on a line."""

import numpy as np

from cell.messages import Sections

RADIUS_M = 0.1


def place(*xs: float) -> Sections:
    """A ball at each of these places on the line; the place is its id."""
    ids = np.array([round(1e6 * (x + 10.0)) for x in xs], np.uint64)
    points = np.array([[[[x, 0.0, 0.0]] * 2] for x in xs], np.float32).reshape(len(xs), 1, 2, 3)
    return Sections(ids, points, np.full((len(xs), 1), RADIUS_M + 0.02, np.float32))
