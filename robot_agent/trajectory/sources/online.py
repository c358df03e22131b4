"""Jerk-limited change of several coordinates from any state: to speeds, or of one of them to a place.

Ruckig's local solver for one section; nothing here uses its way points, which are calculated elsewhere.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from ruckig import ControlInterface, InputParameter, Ruckig, RuckigError, Synchronization, Trajectory

_ROUNDING = 1e-12
"""Speeds and accelerations below this are what rounding leaves of zero."""


class NoCourse(Exception):
    """The solver found no way; says from where, for people."""


@dataclass(frozen=True, slots=True)
class StepTarget:
    """Coordinate `index` shall come to rest `distance` from where it is, no faster than `speed` (> 0)."""

    index: int
    distance: float
    speed: float


def course(
    velocity: NDArray[np.float64],
    acceleration: NDArray[np.float64],
    target: NDArray[np.float64],
    largest_acceleration: NDArray[np.float64],
    largest_jerk: NDArray[np.float64],
    place: StepTarget | None = None,
) -> Trajectory:
    """The fastest way from `velocity` and `acceleration` to the speeds `target`, all `(m,)`; positions count from 0.

    With `place` one coordinate goes there instead. Raises `NoCourse`.
    """
    m = len(velocity)
    wanted = InputParameter(m)
    wanted.control_interface = ControlInterface.Velocity
    wanted.synchronization = Synchronization.No
    wanted.current_position = wanted.target_position = [0.0] * m
    wanted.current_velocity, wanted.current_acceleration = velocity.tolist(), acceleration.tolist()
    wanted.target_velocity, wanted.target_acceleration = target.tolist(), [0.0] * m
    wanted.max_acceleration, wanted.max_jerk = largest_acceleration.tolist(), largest_jerk.tolist()
    wanted.max_velocity = [np.inf] * m
    if place is not None:
        change = np.arange(m) == place.index
        position, velocity_control = ControlInterface.Position, ControlInterface.Velocity
        wanted.per_dof_control_interface = [position if here else velocity_control for here in change]
        wanted.target_position = np.where(change, place.distance, 0.0).tolist()
        wanted.target_velocity = np.where(change, 0.0, target).tolist()
        wanted.max_velocity = np.where(change, place.speed, np.inf).tolist()
    return _solved(wanted, m)


def approach(
    gap: NDArray[np.float64],
    closing: NDArray[np.float64],
    acceleration: NDArray[np.float64],
    largest_speed: NDArray[np.float64],
    largest_acceleration: NDArray[np.float64],
    largest_jerk: NDArray[np.float64],
) -> Trajectory:
    """The fastest way of each coordinate from `gap`, its speed `closing` and `acceleration` to rest at zero, `(m,)`.

    Raises `NoCourse`.
    """
    m = len(gap)
    wanted = InputParameter(m)
    wanted.synchronization = Synchronization.No
    wanted.current_position, wanted.current_velocity = gap.tolist(), closing.tolist()
    wanted.current_acceleration = acceleration.tolist()
    wanted.max_velocity, wanted.max_acceleration = largest_speed.tolist(), largest_acceleration.tolist()
    wanted.max_jerk = largest_jerk.tolist()
    return _solved(wanted, m)


def sampled_course(way: Trajectory, times: NDArray[np.float64]) -> NDArray[np.float64]:
    """Position, velocity and acceleration `(3, k, m)` at `times` `(k,)` [s]; after the end the speed stays."""
    if len(times) == 0:
        return np.zeros((3, 0, way.degrees_of_freedom))
    states = np.array([way.at_time(t) for t in times.tolist()]).transpose(1, 0, 2)
    states[1:][np.abs(states[1:]) < _ROUNDING] = 0.0
    return states


def _solved(wanted: InputParameter, m: int) -> Trajectory:
    found = Trajectory(m)
    try:
        solved = Ruckig(m).calculate(wanted, found) >= 0
    except (ValueError, RuckigError):  # the former for a result that the binding has no name for
        solved = False
    if not solved:
        start = f"velocity {wanted.current_velocity} and acceleration {wanted.current_acceleration}"
        raise NoCourse(f"no jerk-limited way from {start}")
    return found
