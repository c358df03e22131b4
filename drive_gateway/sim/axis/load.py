"""The torque that the world puts on an axis, as a function of its angle."""

from collections.abc import Callable
from math import sin

Load = Callable[[float], float]
"""From the angle of the axis [rad] to the torque on the axis [Nm], positive where it turns the axis forwards."""
GRAVITY_M_S2 = 9.80665
STOP_NM_RAD = 1e5
"""Stiffness of a stop: 1 deg at 1745 Nm; the project's own."""


def constant(torque_nm: float) -> Load:
    """The same torque everywhere, for example of a hanging counterweight."""
    return lambda _angle: torque_nm


def pendulum(mass_kg: float, length_m: float, hanging_rad: float) -> Load:
    """A mass on an arm, m g l sin: pulls the axis towards the angle at which it hangs."""
    moment = mass_kg * GRAVITY_M_S2 * length_m
    return lambda angle: -moment * sin(angle - hanging_rad)


def stops(low_rad: float, high_rad: float) -> Load:
    """Nothing between two stops; beyond them a spring that pushes the axis back."""
    return lambda angle: -STOP_NM_RAD * (max(angle - high_rad, 0.0) + min(angle - low_rad, 0.0))


def together(*loads: Load) -> Load:
    """The sum of several."""
    if len(loads) == 1:
        return loads[0]
    return lambda angle: sum(load(angle) for load in loads)
