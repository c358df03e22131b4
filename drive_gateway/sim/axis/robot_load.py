"""The load that a whole robot puts on the shafts of its motors: gravity, inertia, what its axes do to each other.

Whoever knows the robot hands one function in. It is evaluated for all axes at once and held in between: the inertia
M_ii(q) of each axis moves with its motor, and all that is left of the robot's motion is its load:

    load_i = -(tau_i(q, q', q'') - M_ii q''_i)

q'' is the mean since the evaluation before, so what one axis' acceleration does to another comes a few ms late.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drive_gateway.sim.axis.mechanics import Mechanics

Floats = NDArray[np.float64]
RobotTorques = Callable[[Floats, Floats, Floats], Floats]
"""Axes, their speeds and accelerations, `(m, n)` each [rad or m] -> what moves the links so `(m, n)` [Nm or N]; rotors,
which the motors have already, left out."""
ShaftLoad = Callable[[float], float]
"""From a time [s] to the torque on a shaft [Nm]."""

HELD_S = 0.002
"""Shortest time between two evaluations."""
LEAST_SHARE = 0.1
"""Of the inertia that an axis has by itself: its steps never carry less, so that a stiffness stays stable."""


@dataclass(frozen=True, slots=True)
class Shaft:
    """A motor's shaft in its robot."""

    mechanics: Mechanics
    way_per_rad: float
    """[rad or m] of the axis per radian of the shaft, with its sign."""
    offset: float
    """[rad or m] where the axis is at shaft angle zero."""


class RobotLoad:
    """Of one robot; `shafts` in the order of its axes."""

    def __init__(self, torques: RobotTorques, shafts: Sequence[Shaft]) -> None:
        self._torques = torques
        self._parts = [shaft.mechanics for shaft in shafts]
        self._way = np.array([shaft.way_per_rad for shaft in shafts])
        self._offset = np.array([shaft.offset for shaft in shafts])
        self._least = LEAST_SHARE * np.array([shaft.mechanics.load_inertia for shaft in shafts])
        self._speed = np.zeros(len(shafts))
        self._held: list[float] = [0.0] * len(shafts)
        self._time: float | None = None

    def of(self, number: int) -> ShaftLoad:
        """The load of one shaft; axes may ask in any order, and for times that are a little apart."""
        return lambda time_s: self._at(time_s)[number]

    def _at(self, time_s: float) -> list[float]:
        if self._time is None or time_s - self._time >= HELD_S:
            self._evaluate(0.0 if self._time is None else time_s - self._time)
            self._time = time_s
        return self._held

    def _evaluate(self, passed_s: float) -> None:
        way, axes = self._way, len(self._way)
        speed = np.array([part.load_speed for part in self._parts])
        acceleration = (speed - self._speed) / passed_s if passed_s else np.zeros(axes)
        self._speed = speed
        position = self._offset + way * np.array([part.load_angle for part in self._parts])
        # Rows: as the robot moves, at rest, and each axis alone accelerated by one unit.
        speeds, accelerations = np.zeros((axes + 2, axes)), np.zeros((axes + 2, axes))
        speeds[0], accelerations[0] = way * speed, way * acceleration
        accelerations[2:] = np.eye(axes)
        torques = self._torques(np.tile(position, (axes + 2, 1)), speeds, accelerations)
        inertia = np.maximum((np.diagonal(torques[2:]) - torques[1]) * way**2, self._least)
        for part, own in zip(self._parts, inertia.tolist(), strict=True):
            part.load_inertia = own
        self._held = (inertia * acceleration - way * torques[0]).tolist()
