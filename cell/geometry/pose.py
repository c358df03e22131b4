"""Poses as homogeneous 4x4 matrices, batched over leading dimensions: `pose_a_b` is the pose of frame b in frame a."""

import math
from functools import reduce

import numpy as np

from cell.geometry import quaternion
from cell.geometry.arrays import Array
from cell.geometry.errors import NotAPose, WrongShape

ROTATION_TOLERANCE = 1e-6
"""Largest defect of R R^T - I that still counts as rounding of the caller's numbers."""
BLOCK = 1000
"""Poses checked at once: as many as stay in the cache."""
LAST_ROW = np.array([[0.0], [0], [0], [1]])
"""Of every pose, as a column beside the elements of many."""
GIMBAL_SINE = 1e-10
"""Below this cos B, A and C are one and the same rotation."""


def compose(*poses: Array) -> Array:
    """Product of poses `(..., 4, 4)`, left to right: inner frame names cancel."""
    return reduce(np.matmul, poses)


def inverse(poses: Array) -> Array:
    """`(..., 4, 4)` -> `(..., 4, 4)`: (R^T, -R^T d)."""
    poses = np.asarray(poses, dtype=float)
    result = np.zeros_like(poses)
    transposed = np.swapaxes(poses[..., :3, :3], -1, -2)
    result[..., :3, :3] = transposed
    result[..., :3, 3:] = -transposed @ poses[..., :3, 3:]
    result[..., 3, 3] = 1
    return result


def transform_points(poses: Array, points: Array) -> Array:
    """Points `(..., 3)` of the inner frame in the outer frame; `poses` `(4, 4)`, or broadcasting with the points."""
    rotated: Array = (poses[..., :3, :3] @ np.asarray(points, dtype=float)[..., None])[..., 0]
    return rotated + poses[..., :3, 3]


def pose_from(position: Array, orientation_xyzw: Array) -> Array:
    """Pose `(..., 4, 4)` from position `(..., 3)` [m] and quaternion `(..., 4)`, in the order (x, y, z, w)."""
    position = np.asarray(position, dtype=float)
    rotation = quaternion.to_matrix(np.asarray(orientation_xyzw, dtype=float))
    leading = np.broadcast_shapes(position.shape[:-1], rotation.shape[:-2])
    return _assemble(leading, rotation, position)


def from_xyz_abc(xyz_abc: Array) -> Array:
    """Pose `(..., 4, 4)` from `(..., 6)`: X, Y, Z [m], A, B, C [rad] with R = Rz(C) Ry(B) Rx(A).

    That is: first A about X, then B about Y, then C about Z, all about the fixed axes of the outer frame.
    """
    values = np.asarray(xyz_abc, dtype=float)
    if values.shape[-1:] != (6,):
        raise WrongShape("X Y Z A B C", values.shape, "(..., 6)")
    (ca, cb, cc), (sa, sb, sc) = (np.moveaxis(f(values[..., 3:]), -1, 0) for f in (np.cos, np.sin))
    rotation = np.empty((*values.shape[:-1], 3, 3))
    rotation[..., 0, 0] = cc * cb
    rotation[..., 0, 1] = cc * sb * sa - sc * ca
    rotation[..., 0, 2] = sc * sa + cc * sb * ca
    rotation[..., 1, 0] = sc * cb
    rotation[..., 1, 1] = cc * ca + sc * sb * sa
    rotation[..., 1, 2] = sc * sb * ca - cc * sa
    rotation[..., 2, 0] = -sb
    rotation[..., 2, 1] = cb * sa
    rotation[..., 2, 2] = cb * ca
    return _assemble(values.shape[:-1], rotation, values[..., :3])


def to_xyz_abc(poses: Array, held_a: float = 0.0) -> Array:
    """`(..., 4, 4)` to `(..., 6)`: X, Y, Z [m], A, B, C [rad]; B within +-90 degrees, A and C within +-180.

    At B = +-90 degrees only A - C (or A + C) is determined: A keeps the value `held_a` and C takes the rest.
    """
    poses = np.asarray(poses, dtype=float)
    if poses.shape[-2:] != (4, 4):
        raise WrongShape("poses", poses.shape, "(..., 4, 4)")
    r = poses[..., :3, :3]
    cos_b = np.hypot(r[..., 0, 0], r[..., 1, 0])
    a = np.where(cos_b < GIMBAL_SINE, held_a, np.arctan2(r[..., 2, 1], r[..., 2, 2]))
    sa, ca = np.sin(a), np.cos(a)
    # Second column of R Rx(A)^T = Rz(C) Ry(B) is (-sin C, cos C, 0), at every B.
    c = np.arctan2(sa * r[..., 0, 2] - ca * r[..., 0, 1], ca * r[..., 1, 1] - sa * r[..., 1, 2])
    b = np.arctan2(-r[..., 2, 0], cos_b) + 0.0  # no negative zero for people to read
    return np.concatenate([poses[..., :3, 3], np.stack([a, b, c], axis=-1)], axis=-1)


def check_poses(poses: Array, what: str = "pose") -> Array:
    """Return `poses` as an array if each is a rigid motion.

    Raises:
        WrongShape: not `(..., 4, 4)`.
        NotAPose: a value that is not finite, a matrix that is not a rotation, a last row other than 0 0 0 1.
    """
    poses = np.asarray(poses, dtype=float)
    if poses.shape == (4, 4):
        pose_rows(poses, what)
    else:
        pose_elements(poses, what)
    return poses


def pose_rows(pose: Array, what: str = "pose") -> list[list[float]]:
    """One pose `(4, 4)` as plain floats, row by row, checked as by `check_poses`."""
    rows: list[list[float]] = pose.tolist()
    if not _is_pose(rows):
        pose_elements(pose, what)
    return rows


def pose_elements(poses: Array, what: str = "pose") -> Array:
    """Poses `(..., 4, 4)`, checked as by `check_poses` -> `(4, 4, p)`: one contiguous array over all poses per element.

    Formulas for many poses are several times faster on these than on many small matrices.
    """
    poses = np.asarray(poses, dtype=float)
    if poses.shape[-2:] != (4, 4):
        raise WrongShape(what, poses.shape, "(..., 4, 4)")
    flat = poses.reshape(-1, 16)
    elements = np.empty((16, len(flat)))
    for start in range(0, len(flat), BLOCK):
        block = elements[:, start : start + BLOCK]
        block[...] = flat[start : start + BLOCK].T
        defect = _first_defect(block.reshape(4, 4, -1))
        if defect is not None:
            offset, text = defect
            index = np.unravel_index(start + offset, poses.shape[:-2])
            raise NotAPose(what, tuple(map(int, index)), text)
    return elements.reshape(4, 4, -1)


def _first_defect(elements: Array) -> tuple[int, str] | None:
    """Which of poses `(4, 4, p)` is no rigid motion, and why not."""
    rotation = elements[:3, :3]
    finite = np.asarray(np.isfinite(elements).all(axis=(0, 1)))
    if not finite.all():
        return int(finite.argmin()), "a value is not finite"
    orthogonal = _skew(rotation) < ROTATION_TOLERANCE
    if not orthogonal.all():
        return int(orthogonal.argmin()), "the axes are not orthogonal unit vectors"
    right_handed = _determinant(rotation) > 0
    if not right_handed.all():
        return int(right_handed.argmin()), "the axes are left-handed (a mirror image)"
    closed = (elements[3] == LAST_ROW).all(axis=0)
    if not closed.all():
        return int(closed.argmin()), "the last row is not 0 0 0 1"
    return None


def _skew(rotation: Array) -> Array:
    """Largest element of |R R^T - I| of matrices `(3, 3, p)`: `(p,)`; not a number where it overflows."""
    products = np.empty((6, 3, rotation.shape[-1]))
    with np.errstate(over="ignore", invalid="ignore"):
        np.multiply(rotation, rotation, out=products[:3])
        np.multiply(rotation[:2], rotation[1:], out=products[3:5])
        np.multiply(rotation[0], rotation[2], out=products[5])
        defects = products[:, 0] + products[:, 1]
        defects += products[:, 2]
    defects[:3] -= 1
    np.abs(defects, out=defects)
    return np.asarray(defects.max(axis=0))


def _is_pose(rows: list[list[float]]) -> bool:
    """Whether one matrix is a rigid motion, in plain floats: for a single pose many times faster than arrays."""
    (a, b, c, x), (d, e, f, y), (g, h, i, z), last = rows
    near = ROTATION_TOLERANCE
    return (
        last == [0.0, 0.0, 0.0, 1.0]
        and abs(a * a + b * b + c * c - 1) < near
        and abs(d * d + e * e + f * f - 1) < near
        and abs(g * g + h * h + i * i - 1) < near
        and abs(a * d + b * e + c * f) < near
        and abs(a * g + b * h + c * i) < near
        and abs(d * g + e * h + f * i) < near
        and a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g) > 0
        and math.isfinite(x + y + z)
    )


def _determinant(r: Array) -> Array:
    """Of matrices `(3, 3, p)`: `(p,)`."""
    determinant: Array = (
        r[0, 0] * (r[1, 1] * r[2, 2] - r[1, 2] * r[2, 1])
        - r[0, 1] * (r[1, 0] * r[2, 2] - r[1, 2] * r[2, 0])
        + r[0, 2] * (r[1, 0] * r[2, 1] - r[1, 1] * r[2, 0])
    )
    return determinant


def _assemble(leading: tuple[int, ...], rotation: Array, position: Array) -> Array:
    pose = np.zeros((*leading, 4, 4))
    pose[..., :3, :3] = rotation
    pose[..., :3, 3] = position
    pose[..., 3, 3] = 1
    return pose
