"""Unit quaternions in the order (x, y, z, w), batched over leading dimensions."""

import math

import numpy as np

from cell.geometry.arrays import Array


def to_matrix(quaternions: Array) -> Array:
    """`(..., 4)` quaternions, of any length but zero, to `(..., 3, 3)` rotation matrices."""
    q = np.asarray(quaternions, dtype=float)
    x, y, z, w = np.moveaxis(q / np.linalg.norm(q, axis=-1, keepdims=True), -1, 0)
    matrix = np.empty((*q.shape[:-1], 3, 3))
    matrix[..., 0, 0] = 1 - 2 * (y * y + z * z)
    matrix[..., 0, 1] = 2 * (x * y - z * w)
    matrix[..., 0, 2] = 2 * (x * z + y * w)
    matrix[..., 1, 0] = 2 * (x * y + z * w)
    matrix[..., 1, 1] = 1 - 2 * (x * x + z * z)
    matrix[..., 1, 2] = 2 * (y * z - x * w)
    matrix[..., 2, 0] = 2 * (x * z - y * w)
    matrix[..., 2, 1] = 2 * (y * z + x * w)
    matrix[..., 2, 2] = 1 - 2 * (x * x + y * y)
    return matrix


def from_matrix(rotations: Array) -> Array:
    """`(..., 3, 3)` rotation matrices to `(..., 4)` unit quaternions with w >= 0.

    Shepperd's method: of the four equivalent formulas the one with the largest divisor, so half turns are as exact as
    small angles.
    """
    m = np.asarray(rotations, dtype=float)
    if m.ndim == 2:
        return np.array(_from_one(m.tolist()))
    xx, yy, zz = m[..., 0, 0], m[..., 1, 1], m[..., 2, 2]
    xy, yz, zx = m[..., 0, 1] + m[..., 1, 0], m[..., 1, 2] + m[..., 2, 1], m[..., 2, 0] + m[..., 0, 2]
    wx, wy, wz = m[..., 2, 1] - m[..., 1, 2], m[..., 0, 2] - m[..., 2, 0], m[..., 1, 0] - m[..., 0, 1]
    own = np.stack([1 + xx - yy - zz, 1 - xx + yy - zz, 1 - xx - yy + zz, 1 + xx + yy + zz])
    # Row k is 4 * q * q[k].
    outer = np.stack([own[0], xy, zx, wx, xy, own[1], yz, wy, zx, yz, own[2], wz, wx, wy, wz, own[3]], axis=-1)
    largest = np.argmax(own, axis=0)
    q: Array = outer.reshape(-1, 4)[4 * np.arange(largest.size).reshape(largest.shape) + largest]
    q /= np.linalg.norm(q, axis=-1, keepdims=True)
    return np.where(q[..., 3:] < 0, -q, q)


def _from_one(rotation: list[list[float]]) -> list[float]:
    """The same for one matrix: arrays of a few numbers would cost more than the numbers."""
    (xx, xy, xz), (yx, yy, yz), (zx, zy, zz) = rotation
    own = 1 + xx - yy - zz, 1 - xx + yy - zz, 1 - xx - yy + zz, 1 + xx + yy + zz
    rows = (
        (own[0], xy + yx, zx + xz, zy - yz),
        (xy + yx, own[1], yz + zy, xz - zx),
        (zx + xz, yz + zy, own[2], yx - xy),
        (zy - yz, xz - zx, yx - xy, own[3]),
    )
    q = rows[own.index(max(own))]
    length = math.hypot(*q) if q[3] >= 0 else -math.hypot(*q)
    return [value / length for value in q]


def multiply(left: Array, right: Array) -> Array:
    """Product of `(..., 4)` quaternions: the rotation `right` first, then `left`, as with matrices."""
    a, b = np.asarray(left, dtype=float), np.asarray(right, dtype=float)
    ax, ay, az, aw = np.moveaxis(a, -1, 0)
    bx, by, bz, bw = np.moveaxis(b, -1, 0)
    return np.stack(
        [
            aw * bx + ax * bw + ay * bz - az * by,
            aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw,
            aw * bw - ax * bx - ay * by - az * bz,
        ],
        axis=-1,
    )
