"""The distance of two segments in 80 bits, by every place where it can be least."""

import numpy as np

LONG = np.longdouble


def at_ends(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """The least squared distance `(k,)` of an end of one segment from the other."""

    def from_point(point: np.ndarray, segment: np.ndarray) -> np.ndarray:
        way, whole = segment[:, 1] - segment[:, 0], ((segment[:, 1] - segment[:, 0]) ** 2).sum(-1)
        along = ((point - segment[:, 0]) * way).sum(-1)
        share = np.clip(along / np.where(whole > 0, whole, 1), 0, 1)
        away = point - segment[:, 0] - share[:, None] * way
        return np.asarray((away**2).sum(-1))

    both = [from_point(first[:, i], second) for i in (0, 1)] + [from_point(second[:, i], first) for i in (0, 1)]
    return np.asarray(np.min(both, axis=0))


def by_all_that_can_be_nearest(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """In 80 bits: an end of one and a place of the other, or one place inside each, where the lines are closest."""
    first, second = first.astype(LONG), second.astype(LONG)
    u, v, w = first[:, 1] - first[:, 0], second[:, 1] - second[:, 0], first[:, 0] - second[:, 0]
    uu, uv, vv = ((a * b).sum(-1) for a, b in ((u, u), (u, v), (v, v)))
    uw, vw = (u * w).sum(-1), (v * w).sum(-1)
    determinant = (np.cross(u, v) ** 2).sum(-1)
    divisor = np.where(determinant > 0, determinant, 1)
    s, t = (uv * vw - vv * uw) / divisor, (uu * vw - uv * uw) / divisor
    inside = (determinant > 0) & (s >= 0) & (s <= 1) & (t >= 0) & (t <= 1)
    lines = ((w + s[:, None] * u - t[:, None] * v) ** 2).sum(-1)
    return np.asarray(np.sqrt(np.minimum(at_ends(first, second), np.where(inside, lines, np.inf))))
