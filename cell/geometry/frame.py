"""Frames from measured points: columns of a rotation are the axes of the new frame, as seen from the old one."""

import numpy as np

from cell.geometry.arrays import Array
from cell.geometry.errors import NoFrame, WrongShape

SHORTEST_M = 1e-3
"""Points nearer to each other than this say nothing about a direction."""
SMALLEST_ANGLE = np.radians(1.0)
"""Directions nearer to one line than this span no plane."""


def frame_from_points(origin: Array, on_x: Array, in_xy: Array) -> Array:
    """Pose `(..., 4, 4)` of the frame with this origin, this point on +X, and this one in the XY plane beyond +Y.

    Points are `(..., 3)` [m], in the frame in which the pose is wanted.

    Raises:
        WrongShape: other shapes.
        NoFrame: a value is not finite, two points are nearly one, or all three nearly in one line.
    """
    origin, on_x, in_xy = _points(origin, on_x, in_xy)
    return _frame(origin, on_x - origin, in_xy - origin)


def taught_frame(points: Array) -> Array:
    """Pose `(4, 4)` of the frame of three or four measured points `(3, 3)` or `(4, 3)` [m].

    The first two lie on X, in its direction; the third lies on Y, so the origin is its foot on X (textbook, section
    10.3). A fourth is the origin instead; then the third may lie anywhere beside X, towards Y.

    Raises:
        WrongShape, NoFrame: as `frame_from_points`.
    """
    points = np.asarray(points, dtype=float)
    if points.shape not in ((3, 3), (4, 3)):
        raise WrongShape("points", points.shape, "(3, 3) or (4, 3)")
    _points(*points)
    pose = frame_from_points(*points[:3])
    along = (points[2] - points[0]) @ pose[:3, 0]
    pose[:3, 3] = points[3] if len(points) == 4 else points[0] + along * pose[:3, 0]
    return pose


def largest_turn(points: Array, error_m: float) -> float:
    """By how much [rad] errors of up to `error_m` at each of three points `(3, 3)` [m] can turn their frame.

    A bound from above; pi where the points are so near to each other, or to one line, that they allow any turn. X turns
    by at most a = asin(2 e / d) with d from the first point to the second; about X the frame then turns by at most
    a + asin(e (1 + |1 - t| + |t|) / h) with h from the third point to its foot on X, which lies at t of d.

    Raises:
        WrongShape, NoFrame: as `frame_from_points`.
    """
    pose = frame_from_points(*np.asarray(points, dtype=float)[:3])
    along = float(np.linalg.norm(points[1] - points[0]))
    foot, aside, _ = ((points[2] - points[0]) @ pose[:3, :3]).tolist()
    share = foot / along
    sines = 2.0 * error_m / along, error_m * (1.0 + abs(1.0 - share) + abs(share)) / aside
    if max(sines) >= 1.0:
        return float(np.pi)
    return float(min(2.0 * np.arcsin(sines[0]) + np.arcsin(sines[1]), np.pi))


def largest_shift(points: Array, error_m: float) -> float:
    """By how much [m] errors of up to `error_m` at each of the points can move the origin of `taught_frame`.

    A bound from above. A fourth point moves with its own error. The foot of the third one moves with the line of X, by
    e (|1 - t| + |t|), and along it with the error of the third and the turn of X, a; t, h and a as in `largest_turn`.

    Raises:
        WrongShape, NoFrame: as `frame_from_points`.
    """
    points = np.asarray(points, dtype=float)
    if len(points) == 4:
        return error_m
    pose = frame_from_points(*points)
    along = float(np.linalg.norm(points[1] - points[0]))
    foot, aside, _ = ((points[2] - points[0]) @ pose[:3, :3]).tolist()
    share = foot / along
    of_line = error_m * (abs(1.0 - share) + abs(share))
    return float(2.0 * of_line + error_m + aside * min(2.0 * error_m / along, 1.0))


def _points(*points: Array) -> tuple[Array, ...]:
    arrays = [np.asarray(point, dtype=float) for point in points]
    for array in arrays:
        if array.shape[-1:] != (3,):
            raise WrongShape("points", array.shape, "(..., 3)")
    arrays = list(np.broadcast_arrays(*arrays))
    finite = np.isfinite(np.stack(arrays)).all(axis=(0, -1))
    if not finite.all():
        raise NoFrame(_first(~finite), "a value is not finite", "measure the point again")
    return tuple(arrays)


def _frame(origin: Array, x_way: Array, y_way: Array) -> Array:
    short = np.minimum(np.linalg.norm(x_way, axis=-1), np.linalg.norm(y_way, axis=-1)) < SHORTEST_M
    if short.any():
        raise NoFrame(_first(short), "two points are less than 1 mm apart", "measure points farther from each other")
    x = _unit(x_way)
    normal = np.cross(x, _unit(y_way))
    flat = np.linalg.norm(normal, axis=-1) < np.sin(SMALLEST_ANGLE)
    if flat.any():
        raise NoFrame(_first(flat), "the points lie in one line", "measure a point farther aside")
    z = _unit(normal)
    pose = np.zeros((*origin.shape[:-1], 4, 4))
    pose[..., :3, 0], pose[..., :3, 1], pose[..., :3, 2] = x, np.cross(z, x), z
    pose[..., :3, 3] = origin
    pose[..., 3, 3] = 1
    return pose


def _unit(ways: Array) -> Array:
    return np.asarray(ways / np.linalg.norm(ways, axis=-1, keepdims=True))


def _first(flags: Array) -> tuple[int, ...]:
    return tuple(int(i) for i in np.argwhere(flags)[0])
