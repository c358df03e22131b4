"""Tangential tool: on a path the tool follows the direction of travel, seen from above."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from robot_agent.paths.curves import Numbers
from robot_agent.paths.orientation import Turn, Window, turned

UP = np.array([0.0, 0.0, 1.0])
"""The plane in which the tool turns is that of X and Y of the base."""
STEEPEST = 0.98
"""Sine of the steepest direction that still has a heading, about 80 degrees."""
_SIDEWAYS = math.sqrt(0.5) + 1e-6
"""Sine of 45 deg, which is still sideways, whatever rounding makes of it."""
_STEP_M = 2e-5
_LOOKED_AT = 400


def heading(tangent: Numbers) -> Numbers:
    """Angle [rad] `(...)` of directions `(..., 3)` in the XY plane, from X."""
    return np.asarray(np.arctan2(tangent[..., 1], tangent[..., 0]))


def aligned(rotation: Numbers, tangent: Numbers, angle_rad: float) -> Numbers:
    """`rotation` `(3, 3)` turned about the base's Z until the tool heads along `tangent`, turned by `angle_rad`.

    What heads along is the x axis of the TCP; or its y axis, where x points more up or down than sideways, as it
    does on an arm that works downwards. The tilt of the tool stays.
    """
    axis = rotation[:, 0] if abs(rotation[2, 0]) < _SIDEWAYS else rotation[:, 1]
    turn = heading(tangent) + angle_rad - heading(axis)
    return np.asarray(turned(UP, turn) @ rotation)


@dataclass(frozen=True, eq=False)
class Tangential:
    """An orientation along a path, as `Orientation`; its rate of turning is the path's curvature seen from above."""

    start: Numbers
    """`(3, 3)` orientation at the beginning, aligned."""
    path: Callable[[Numbers], Numbers]
    """Position, tangent and curvature `(3, k, 3)` at distances `(k,)`."""
    length_m: float

    @property
    def windows(self) -> tuple[Window, ...]:
        """Where one turn passes into another: nowhere."""
        return ()

    @cached_property
    def turns(self) -> tuple[Turn, ...]:
        """One turn that is as fast as this one where it is fastest."""
        rates = self._rates(np.linspace(0.0, self.length_m, _LOOKED_AT))
        return (Turn(self.start, UP, float(np.abs(rates).max()), 0.0),)

    def at(self, distance_m: Numbers) -> Numbers:
        """Rotations `(..., 3, 3)` at `distance_m` `(...)`."""
        first, here = (heading(self.path(each)[1]) for each in (np.zeros(1), np.atleast_1d(distance_m)))
        return turned(UP, (here - first).reshape(np.shape(distance_m))) @ self.start

    def states(self, distance_m: Numbers) -> tuple[Numbers, Numbers, Numbers]:
        """Rotations, angular velocity per distance `(k, 3)` and its derivative, at distances `(k,)`."""
        ahead, behind = np.minimum(distance_m + _STEP_M, self.length_m), np.maximum(distance_m - _STEP_M, 0.0)
        change = (self._rates(ahead) - self._rates(behind)) / (ahead - behind)
        return self.at(distance_m), self._rates(distance_m)[:, None] * UP, change[:, None] * UP

    def _rates(self, distance_m: Numbers) -> Numbers:
        return turn_rates(self.path(distance_m))


def turn_rates(states: Numbers) -> Numbers:
    """Rate [rad/m] `(k,)` at which the heading changes where a curve has `states` `(3, k, 3)`, as `Curve.at`."""
    _, tangent, curvature = states
    across = tangent[:, 0] * curvature[:, 1] - tangent[:, 1] * curvature[:, 0]
    return np.asarray(across / np.maximum((tangent[:, :2] ** 2).sum(axis=1), 1e-12))
