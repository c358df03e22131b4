"""An open chain of joints: poses of its links, its Jacobian and that one's derivative, for many joint sets."""

from dataclasses import dataclass

import numpy as np

from cell.geometry.arrays import Array, Flags
from robot_agent.kinematics.reach import Places, placed, points, slid, turned


@dataclass(frozen=True, slots=True, eq=False)
class Joint:
    """One joint: from the frame before by `offset`, then by the fixed `rotation`, then along or about an own axis."""

    axis: int
    """0, 1, 2: X, Y, Z of the joint's frame."""
    offset: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """[m] in the frame before."""
    linear: bool = False
    rotation: Array | None = None
    """`(3, 3)`; None: none."""


class Chain:
    """Coordinates `(..., s)` [rad or m] to frames; frame 0 is the base, frame `i` the one behind step `i`."""

    def __init__(self, steps: tuple[Joint, ...], end: Array | None = None) -> None:
        """`end` `(4, 4)`: pose of the flange in the last frame."""
        self._steps = steps
        self._linear: Flags = np.array([step.linear for step in steps])
        self._axes = np.array([step.axis for step in steps])
        self._end = end

    @property
    def size(self) -> int:
        return len(self._steps)

    @property
    def steps(self) -> tuple[Joint, ...]:
        return self._steps

    def link_frames(self) -> Array:
        """`(s + 1, 4, 4)`: poses of the links in the frames; all are the frames themselves but the flange's."""
        poses = np.tile(np.eye(4), (self.size + 1, 1, 1))
        if self._end is not None:
            poses[-1] = self._end
        return poses

    def frames(self, x: Array) -> Array:
        """`(..., s)` -> `(..., s + 1, 4, 4)`."""
        if x.ndim == 1:
            return self._frames_at(x)
        joints = x.reshape(-1, self.size).T
        count = joints.shape[1]
        cosines, sines = np.cos(joints), np.sin(joints)
        # Axes and origin of each frame, by column and row, over all joint sets: `(s + 1, 4, 4, count)`. They stay in
        # this order in memory, in which a Jacobian is worked out of them.
        columns = np.zeros((self.size + 1, 4, 4, count))
        columns[0, :3, :3] = np.eye(3)[..., None]
        columns[:, 3, 3] = 1.0
        for step, angle, cosine, sine, before, here in zip(
            self._steps, joints, cosines, sines, columns[:-1, :, :3], columns[1:, :, :3], strict=True
        ):
            axes, origin = before[:3], before[3]
            for along, axis in zip(step.offset, axes, strict=True):
                if along != 0:
                    origin = origin + along * axis
            if step.rotation is not None:
                axes = np.einsum("kj,kcp->jcp", step.rotation, axes)
            here[3] = origin
            if step.linear:
                here[:3] = axes
                here[3] += angle * axes[step.axis]
            else:
                second, third = (step.axis + 1) % 3, (step.axis + 2) % 3
                here[step.axis] = axes[step.axis]
                np.multiply(cosine, axes[second], out=here[second])
                here[second] += sine * axes[third]
                np.multiply(cosine, axes[third], out=here[third])
                here[third] -= sine * axes[second]
        order = (*range(3, x.ndim + 2), 0, 2, 1)
        return columns.reshape(self.size + 1, 4, 4, *x.shape[:-1]).transpose(order)

    def _frames_at(self, x: Array) -> Array:
        """The same for one joint set `(s,)`: arrays of a few numbers would cost more than the numbers."""
        first, second, third = [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]
        axes, (ox, oy, oz) = [first, second, third], (0.0, 0.0, 0.0)
        frames = [[1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0]]
        values = x.tolist(), np.cos(x).tolist(), np.sin(x).tolist()
        for step, value, cosine, sine in zip(self._steps, *values, strict=True):
            for along, (ax, ay, az) in zip(step.offset, axes, strict=True):
                if along != 0:
                    ox, oy, oz = ox + along * ax, oy + along * ay, oz + along * az
            if step.rotation is not None:
                axes = (step.rotation.T @ np.array(axes)).tolist()
            if step.linear:
                ax, ay, az = axes[step.axis]
                ox, oy, oz = ox + value * ax, oy + value * ay, oz + value * az
            else:
                here, there = (step.axis + 1) % 3, (step.axis + 2) % 3
                (ax, ay, az), (bx, by, bz) = axes[here], axes[there]
                axes = list(axes)
                axes[here] = [cosine * ax + sine * bx, cosine * ay + sine * by, cosine * az + sine * bz]
                axes[there] = [cosine * bx - sine * ax, cosine * by - sine * ay, cosine * bz - sine * az]
            (ax, ay, az), (bx, by, bz), (cx, cy, cz) = axes
            frames.append([ax, bx, cx, ox, ay, by, cy, oy, az, bz, cz, oz, 0.0, 0.0, 0.0, 1.0])
        return np.array(frames).reshape(self.size + 1, 4, 4)

    def flange(self, frames: Array) -> Array:
        """Frames `(..., s + 1, 4, 4)` -> pose of the flange `(..., 4, 4)`."""
        last: Array = frames[..., -1, :, :]
        return last if self._end is None else np.asarray(last @ self._end)

    def jacobian(self, frames: Array) -> Array:
        """Frames `(..., s + 1, 4, 4)` -> `(..., 6, s)`: linear then angular velocity of the flange, base axes."""
        if frames.ndim == 3:
            return self._jacobian_at(frames)
        axes, arms, _ = self._axes_arms_origins(frames)
        return self._twists(frames, axes, _cross(axes, arms))

    def _jacobian_at(self, frames: Array) -> Array:
        """The same for one joint set, frames `(s + 1, 4, 4)`."""
        x, y, z = self.flange(frames)[:3, 3].tolist()
        columns = []
        for step, frame in zip(self._steps, frames[1:].tolist(), strict=True):
            (ax, ay, az), (ox, oy, oz) = ((row[step.axis] for row in frame[:3]), (row[3] for row in frame[:3]))
            if step.linear:
                columns.append((ax, ay, az, 0.0, 0.0, 0.0))
                continue
            rx, ry, rz = x - ox, y - oy, z - oz
            columns.append((ay * rz - az * ry, az * rx - ax * rz, ax * ry - ay * rx, ax, ay, az))
        return np.array(columns).T

    def jacobian_derivative(self, frames: Array, speeds: Array) -> Array:
        """Time derivative `(..., 6, s)` of the Jacobian at coordinate speeds `(..., s)`."""
        axes, arms, origins = self._axes_arms_origins(frames)
        linear = self._linear[:, None]
        rates = axes * speeds.reshape(-1, self.size).T
        turns = np.cumsum(np.where(linear, 0.0, rates), axis=1)
        before = np.zeros_like(turns)
        before[:, 1:] = turns[:, :-1]
        moves = _cross(before, np.diff(origins, axis=1)) + np.where(linear, rates, 0.0)
        velocities = np.cumsum(moves, axis=1)
        flange = velocities[:, -1:] + _cross(turns[:, -1:], arms[:, -1:])
        axes_change = _cross(turns, axes)
        return self._twists(frames, axes_change, _cross(axes_change, arms) + _cross(axes, flange - velocities))

    def _twists(self, frames: Array, axes: Array, around: Array) -> Array:
        """`(..., 6, s)`: `axes` `(3, s, p)` where steps slide; `around` and the axes where they turn."""
        twists, linear = np.concatenate([around, axes]), self._linear
        twists[:3, linear], twists[3:, linear] = axes[:, linear], 0.0
        leading = frames.shape[:-3]
        order = (*range(2, len(leading) + 2), 0, 1)
        return twists.reshape(6, self.size, *leading).transpose(order)

    def places(self, frame: int, at: Array, ranges: Array) -> Places:
        """Where points `(p, 3)` [m] of a frame can be, in the base; of the last frame, points of the flange.

        `ranges` `(s, 2)`: those of the sliding steps count, the others turn freely.
        """
        found = points(at)
        if self._end is not None and frame == self.size:
            found = placed(found, self._end[:3, 3], self._end[:3, :3])
        for step, (lower, upper) in reversed(list(zip(self._steps[:frame], ranges[:frame], strict=True))):
            found = slid(found, step.axis, lower, upper) if step.linear else turned(found, step.axis)
            found = placed(found, np.array(step.offset), step.rotation)
        return found

    def _axes_arms_origins(self, frames: Array) -> tuple[Array, Array, Array]:
        """Axes of all steps, the way from each one's origin to the flange `(3, s, p)`, and all origins `(3, s + 1, p)`.

        Rows come first: arithmetic on many short vectors would take several times as long.
        """
        flat = frames.reshape(-1, self.size + 1, 4, 4)
        rows = flat[:, :, :3].transpose(2, 3, 1, 0)
        axes, origins = rows[:, self._axes, np.arange(1, self.size + 1)], rows[:, 3]
        return axes, self.flange(flat)[:, :3, 3].T[:, None] - origins[:, 1:], origins


def _cross(a: Array, b: Array) -> Array:
    """Vector products of vectors `(3, ...)`."""
    return np.stack([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])
