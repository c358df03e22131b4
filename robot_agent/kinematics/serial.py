"""What follows for every open chain from its steps: links, Jacobian, reach."""

import numpy as np

from cell.geometry.arrays import Array
from robot_agent.kinematics.chain import Chain
from robot_agent.kinematics.model import Model
from robot_agent.model.description import RobotDescription


class SerialModel(Model):
    """A robot whose links are one open chain. The chain's coordinates may be mixtures of the joints."""

    def __init__(self, description: RobotDescription, chain: Chain, mixing: Array | None = None) -> None:
        """`mixing` `(s, n)`: chain coordinates = mixing @ joints; None: each step is its joint."""
        super().__init__(description)
        self._chain = chain
        self._mixing = mixing
        self._reach_m = self._capsule_reach()

    @property
    def reach_m(self) -> float:
        return self._reach_m

    def links(self, q: Array) -> Array:
        frames = self._frames(q)
        frames[..., -1, :, :] = self._chain.flange(frames)
        return frames

    def jacobian(self, q: Array) -> Array:
        jacobian = self._chain.jacobian(self._frames(q))
        return jacobian if self._mixing is None else np.asarray(jacobian @ self._mixing)

    def jacobian_derivative(self, q: Array, qd: Array) -> Array:
        speeds = self._coordinates(self.check_joints(qd, "joint speeds"))
        change = self._chain.jacobian_derivative(self._frames(q), speeds)
        return change if self._mixing is None else np.asarray(change @ self._mixing)

    def _frames(self, q: Array) -> Array:
        return self._chain.frames(self._coordinates(self.check_joints(q)))

    def _coordinates(self, q: Array) -> Array:
        return q if self._mixing is None else np.asarray(q @ self._mixing.T)

    def _capsule_reach(self) -> float:
        """Triangle inequality over all steps of the chain."""
        lower, upper = self.limits.position.T
        mixing = np.eye(self.n) if self._mixing is None else self._mixing
        middle, half = mixing @ (lower + upper) / 2, np.abs(mixing) @ (upper - lower) / 2
        links = self._chain.reaches(np.stack([middle - half, middle + half], axis=-1))
        return self.body_reach(links)
