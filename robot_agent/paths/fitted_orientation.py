"""Orientation along a fitted curve."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cell.geometry import quaternion
from robot_agent.paths.chain import CurveChain
from robot_agent.paths.curves import Numbers
from robot_agent.paths.orientation import Window


@dataclass(frozen=True, eq=False)
class FittedOrientation:
    """Quaternions over the parameters of a chain of polynomials, one for each: `powers` `(m, 4, 4)`."""

    chain: CurveChain
    powers: Numbers
    windows: tuple[Window, ...] = ()
    """Where one turn passes into another: nowhere."""

    def at(self, distance_m: Numbers) -> Numbers:
        """As `Orientation.at`."""
        index, u = self.chain.parameter(distance_m)
        return quaternion.to_matrix(self._derived(index, u, 0))

    def states(self, distance_m: Numbers) -> tuple[Numbers, Numbers, Numbers]:
        """As `Orientation.states`."""
        index, u = self.chain.parameter(distance_m)
        _, first, second = self.chain.derivatives(index, u)
        speed = np.linalg.norm(first, axis=1)
        growth = (first * second).sum(axis=1) / speed**4
        q, by_u, twice = (self._derived(index, u, order) for order in range(3))
        rate = by_u / speed[:, None]
        bend = twice / (speed**2)[:, None] - by_u * growth[:, None]
        square = (q * q).sum(axis=1, keepdims=True)
        spin, change = (2.0 * _vector_of_product(each, q) / square for each in (rate, bend))
        # the quaternion is not quite of length 1: what its length does turns nothing, but counts in the second
        drift = 2.0 * (q * rate).sum(axis=1, keepdims=True) / square
        return quaternion.to_matrix(q), spin, change - drift * spin

    def _derived(self, index: NDArray[np.intp], u: Numbers, order: int) -> Numbers:
        powers = np.stack([_falling(k, order) * u ** max(k - order, 0) for k in range(4)], axis=-1)
        return np.asarray((powers[:, None] @ self.powers[index])[:, 0])


def _falling(k: int, order: int) -> float:
    return float(np.prod(np.arange(k, k - order, -1.0)))


def _vector_of_product(a: Numbers, q: Numbers) -> Numbers:
    """The vector `(k, 3)` of a times the conjugate of q, both `(k, 4)`."""
    return np.asarray(q[:, 3:] * a[:, :3] - a[:, 3:] * q[:, :3] - np.cross(a[:, :3], q[:, :3]))
