"""An open chain of joints: poses of its links, its Jacobian and that one's derivative, for many joint sets."""

from dataclasses import dataclass

import numpy as np

from cell.geometry.arrays import Array, Flags
from robot_agent.kinematics.reach import Places, placed, points, slid, turned


@dataclass(frozen=True, slots=True, eq=False)
class Step:
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

    def __init__(self, steps: tuple[Step, ...], end: Array | None = None) -> None:
        """`end` `(4, 4)`: pose of the flange in the last frame."""
        self._steps = steps
        self._linear: Flags = np.array([step.linear for step in steps])
        self._axes = np.array([step.axis for step in steps])
        self._end = end

    @property
    def size(self) -> int:
        return len(self._steps)

    @property
    def steps(self) -> tuple[Step, ...]:
        return self._steps

    def link_frames(self) -> Array:
        """`(s + 1, 4, 4)`: poses of the links in the frames; all are the frames themselves but the flange's."""
        poses = np.tile(np.eye(4), (self.size + 1, 1, 1))
        if self._end is not None:
            poses[-1] = self._end
        return poses

    def frames(self, x: Array) -> Array:
        """`(..., s)` -> `(..., s + 1, 4, 4)`."""
        joints = x.reshape(-1, self.size).T
        count = joints.shape[1]
        cosines, sines = np.cos(joints), np.sin(joints)
        frames = np.zeros((count, self.size + 1, 4, 4))
        frames[:, :, 3, 3] = 1
        frames[:, 0] = np.eye(4)
        axes = [np.tile(column[:, None], count) for column in np.eye(3)]
        origin = np.zeros((3, count))
        for i, step in enumerate(self._steps):
            for along, axis in zip(step.offset, axes, strict=True):
                if along != 0:
                    origin = origin + along * axis
            if step.rotation is not None:
                axes = list(np.einsum("kj,kcp->jcp", step.rotation, np.stack(axes)))
            if step.linear:
                origin = origin + joints[i] * axes[step.axis]
            else:
                second, third = (step.axis + 1) % 3, (step.axis + 2) % 3
                u, v = axes[second], axes[third]
                axes[second] = cosines[i] * u + sines[i] * v
                axes[third] = cosines[i] * v - sines[i] * u
            for column in range(3):
                frames[:, i + 1, :3, column] = axes[column].T
            frames[:, i + 1, :3, 3] = origin.T
        return frames.reshape(*x.shape[:-1], self.size + 1, 4, 4)

    def flange(self, frames: Array) -> Array:
        """Frames `(..., s + 1, 4, 4)` -> pose of the flange `(..., 4, 4)`."""
        last: Array = frames[..., -1, :, :]
        return last if self._end is None else np.asarray(last @ self._end)

    def jacobian(self, frames: Array) -> Array:
        """Frames `(..., s + 1, 4, 4)` -> `(..., 6, s)`: linear then angular velocity of the flange, base axes."""
        axes, arms = self._axes_and_arms(frames)
        turning = np.concatenate([np.cross(axes, arms), axes], axis=-1)
        sliding = np.concatenate([axes, np.zeros_like(axes)], axis=-1)
        return np.swapaxes(np.where(self._linear[:, None], sliding, turning), -1, -2)

    def jacobian_derivative(self, frames: Array, speeds: Array) -> Array:
        """Time derivative `(..., 6, s)` of the Jacobian at coordinate speeds `(..., s)`."""
        axes, arms = self._axes_and_arms(frames)
        speeds = speeds[..., None]
        turns = np.cumsum(np.where(self._linear[:, None], 0.0, axes * speeds), axis=-2)
        before = np.concatenate([np.zeros_like(turns[..., :1, :]), turns[..., :-1, :]], axis=-2)
        origins = frames[..., 3][..., :3]
        moves = np.cross(before, np.diff(origins, axis=-2)) + np.where(self._linear[:, None], axes * speeds, 0.0)
        velocities = np.cumsum(moves, axis=-2)
        flange = velocities[..., -1:, :] + np.cross(turns[..., -1:, :], arms[..., -1:, :])
        axes_change = np.cross(turns, axes)
        linear = np.cross(axes_change, arms) + np.cross(axes, flange - velocities)
        turning = np.concatenate([linear, axes_change], axis=-1)
        sliding = np.concatenate([axes_change, np.zeros_like(axes_change)], axis=-1)
        return np.swapaxes(np.where(self._linear[:, None], sliding, turning), -1, -2)

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

    def _axes_and_arms(self, frames: Array) -> tuple[Array, Array]:
        """Axes of all steps, and the way from each one's origin to the flange: `(..., s, 3)` each."""
        rotations = frames[..., 1:, :3, :3]
        axes = np.moveaxis(rotations[..., np.arange(self.size), :, self._axes], 0, -2)
        return axes, self.flange(frames)[..., None, :3, 3] - frames[..., 1:, :3, 3]
