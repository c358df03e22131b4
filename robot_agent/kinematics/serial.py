"""What follows for every open chain from its steps: links, Jacobian, reach."""

import numpy as np

from cell.geometry.arrays import Array
from robot_agent.kinematics.chain import Chain
from robot_agent.kinematics.model import Model
from robot_agent.kinematics.reach import Places
from robot_agent.model.description import LinkMass, RobotDescription


class SerialModel(Model):
    """A robot whose links are one open chain. The chain's coordinates may be mixtures of the joints."""

    def __init__(self, description: RobotDescription, chain: Chain, mixing: Array | None = None) -> None:
        """`mixing` `(s, n)`: chain coordinates = mixing @ joints; None: each step is its joint."""
        super().__init__(description)
        self._chain = chain
        self._mixing = mixing

    @property
    def chain(self) -> Chain:
        return self._chain

    @property
    def mixing(self) -> Array:
        """`(s, n)`: coordinates of the chain = mixing @ joints."""
        return np.eye(self.n) if self._mixing is None else self._mixing

    @property
    def link_frames(self) -> Array:
        """`(s + 1, 4, 4)`: poses of the links in the frames of the chain."""
        return self._chain.link_frames()

    @property
    def masses(self) -> tuple[LinkMass, ...]:
        """Of the links, without the tool."""
        return self.description.masses

    def links(self, q: Array) -> Array:
        frames = self._frames(q)
        frames[..., -1, :, :] = self._chain.flange(frames)
        return frames

    def flange_jacobian(self, q: Array) -> Array:
        jacobian = self._chain.jacobian(self._frames(q))
        return jacobian if self._mixing is None else np.asarray(jacobian @ self._mixing)

    def flange_jacobian_derivative(self, q: Array, qd: Array) -> Array:
        speeds = self._coordinates(self.check_joints(qd, "joint speeds"))
        change = self._chain.jacobian_derivative(self._frames(q), speeds)
        return change if self._mixing is None else np.asarray(change @ self._mixing)

    def _frames(self, q: Array) -> Array:
        return self._chain.frames(self._coordinates(self.check_joints(q)))

    def _coordinates(self, q: Array) -> Array:
        return q if self._mixing is None else np.asarray(q @ self._mixing.T)

    def _places(self, link: int, at: Array) -> Places:
        lower, upper = self.limits.position.T
        middle, half = self.mixing @ (lower + upper) / 2, np.abs(self.mixing) @ (upper - lower) / 2
        return self._chain.places(link, at, np.stack([middle - half, middle + half], axis=-1))
