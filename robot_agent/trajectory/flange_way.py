"""What the flange does along joints that are given as a curve."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from robot_agent.kinematics import Model
from robot_agent.trajectory.pieces import Pieces

Numbers = NDArray[np.float64]

_PARTS = 32
_SLOW = 1e-3
"""[m] of the flange's way per unit of the joints' way: below it turns on the spot."""
_STILL = 1e-12


@dataclass(frozen=True, slots=True, eq=False)
class FlangeWay:
    """How the flange turns along a path, and what each joint adds to its way and turn, both over the parameter."""

    spin: Pieces
    """Three columns: the integral of the angular velocity in base axes [rad]."""
    parameter: Numbers
    """`(k,)`, rising."""
    shares: Numbers
    """`(k, 2, n)` derivatives of way [m] and turn [rad] by the joints, at each parameter."""

    @classmethod
    def along(cls, s: Numbers, twist: Numbers, growth: Numbers, jacobian: Numbers) -> "FlangeWay":
        """From the twist by the parameter `(k, 6)` and its slope `(k, 6)`, where the Jacobian is `(k, 6, n)`."""
        halves = twist.reshape(-1, 2, 3)
        directions = halves / np.maximum(np.linalg.norm(halves, axis=2, keepdims=True), _STILL)
        shares = (directions[:, :, None] @ jacobian.reshape(len(s), 2, 3, -1))[:, :, 0]
        return cls(_integral(s, twist[:, 3:], growth[:, 3:]), s, shares)

    @classmethod
    def still(cls, length: float, joints: int) -> "FlangeWay":
        """Of a flange that does nothing, as far as it is known."""
        return cls(Pieces(np.array([0.0, length]), np.zeros((1, 6, 3))), np.zeros(1), np.zeros((1, 2, joints)))

    def part(self, first: float, last: float) -> "FlangeWay":
        """From parameter `first` to `last`."""
        low, high = np.searchsorted(self.parameter, [first, last])
        kept = slice(max(low - 1, 0), high + 1)
        return FlangeWay(self.spin.part(first, last), self.parameter[kept] - first, self.shares[kept])

    def then(self, other: "FlangeWay") -> "FlangeWay":
        """Both one after the other."""
        inside = self.parameter <= self.spin.duration_s, other.parameter >= 0.0
        return FlangeWay(
            continued(self.spin, other.spin, 0),
            np.concatenate([self.parameter[inside[0]], self.spin.duration_s + other.parameter[inside[1]]]),
            np.concatenate([self.shares[inside[0]], other.shares[inside[1]]]),
        )

    def shares_at(self, at: Numbers) -> Numbers:
        """`(m, 2, n)` at parameters `(m,)`."""
        if len(self.parameter) == 1:
            return np.repeat(self.shares, len(at), axis=0)
        k = np.clip(np.searchsorted(self.parameter, at) - 1, 0, len(self.parameter) - 2)
        wide = np.maximum(self.parameter[k + 1] - self.parameter[k], _STILL)
        u = np.clip((at - self.parameter[k]) / wide, 0.0, 1.0)[:, None, None]
        return np.asarray((1.0 - u) * self.shares[k] + u * self.shares[k + 1])


def with_flange(model: Model, joints: Pieces) -> tuple[Pieces, FlangeWay, Numbers]:
    """A curve of the joints in one piece with the flange's way [m] and turn [rad] as two more columns.

    Also what else it does, and `(k, 2)` parameter and curvature [1/m] of its way, 0 where it has none.
    """
    s = np.linspace(0.0, joints.duration_s, _PARTS + 1)
    q, first, second, _ = joints.shape(s)
    jacobian = model.jacobian(q)
    drift = model.jacobian_derivative(q, first) @ first[..., None]
    twist, growth = (jacobian @ first[..., None])[..., 0], (jacobian @ second[..., None] + drift)[..., 0]
    halves = twist.reshape(-1, 2, 3)
    way = np.linalg.norm(halves, axis=2)
    change = (halves * growth.reshape(-1, 2, 3)).sum(axis=2) / np.maximum(way, _STILL)
    step = float(s[1])
    grown = step * (way[1:] + way[:-1]) / 2.0 + step**2 * (change[:-1] - change[1:]) / 12.0
    covered = np.concatenate([np.zeros((1, 2)), np.cumsum(grown, axis=0)])
    across = np.linalg.norm(np.cross(twist[:, :3], growth[:, :3]), axis=1)
    curvature = np.where(way[:, 0] > _SLOW, across / np.maximum(way[:, 0], _SLOW) ** 3, 0.0)
    states = [np.column_stack(each) for each in ((q, covered), (first, way), (second, change))]
    flange = FlangeWay.along(s, twist, growth, jacobian)
    return Pieces.through(s, *states), flange, np.column_stack([s, curvature])


def without_flange(joints: Pieces) -> Pieces:
    """The same columns and knots where no limit of the flange holds: its way and turn stay at 0."""
    s = np.linspace(0.0, joints.duration_s, _PARTS + 1)
    return Pieces.through(s, *(np.column_stack([each, np.zeros((len(s), 2))]) for each in joints.shape(s)[:3]))


def continued(first: Pieces, second: Pieces, joints: int) -> Pieces:
    """Both one after the other; columns behind the first `joints` go on from where they are."""
    later = second.coefficients.copy()
    gap = first.position(first.knots[-1:]) - second.position(np.zeros(1))
    later[:, 0, joints:] += gap[:, joints:]
    return Pieces.joined([first, Pieces(second.knots, later)])


def _integral(s: Numbers, rate: Numbers, growth: Numbers) -> Pieces:
    """The integral over `s` `(k,)` of the cubics through rates `(k, 3)` with the slopes `growth` `(k, 3)`."""
    h = np.diff(s)[:, None]
    steps, slopes = np.diff(rate, axis=0) / h, growth[:-1] + growth[1:]
    grown = h * (rate[:-1] + rate[1:]) / 2.0 + h**2 * (growth[:-1] - growth[1:]) / 12.0
    coefficients = np.zeros((len(h), 6, rate.shape[1]))
    coefficients[1:, 0] = np.cumsum(grown[:-1], axis=0)
    coefficients[:, 1], coefficients[:, 2] = rate[:-1], growth[:-1] / 2.0
    coefficients[:, 3] = (3.0 * steps - slopes - growth[:-1]) / (3.0 * h)
    coefficients[:, 4] = (slopes - 2.0 * steps) / (4.0 * h**2)
    return Pieces(s, coefficients)
