"""Position, speed, torque and following error of the last minute, kept for the curves."""

from collections import deque
from enum import Enum

import numpy as np

from cell.geometry.arrays import Array
from cell.messages import DriveFeedback
from cell.view.newest import Newest

LAST_S = 60.0
PERIOD_S = 0.1


class Quantity(Enum):
    """What a curve shows of each axis."""

    POSITION = "position"
    SPEED = "speed"
    TORQUE = "torque"
    BEHIND = "following error"


class Curves:
    """What all drives told in the last minute, ten times a second."""

    def __init__(self) -> None:
        self._kept: dict[str, deque[tuple[float, DriveFeedback]]] = {}

    def look(self, seen: Newest) -> None:
        """Keep what the drives say now, where it is time for that; after a seek back begin anew."""
        for robot, feedback in seen.of(DriveFeedback).items():
            kept = self._kept.setdefault(robot, deque())
            if kept and (seen.now < kept[-1][0] or len(kept[-1][1].position) != len(feedback.position)):
                kept.clear()
            if not kept or seen.now - kept[-1][0] >= PERIOD_S:
                kept.append((seen.now, feedback))
            while seen.now - kept[0][0] > LAST_S:
                kept.popleft()

    def of(self, robot: str, quantity: Quantity) -> tuple[Array, Array]:
        """Times `(t,)` [s], 0 the newest, and values `(t, n)` of the axes: rad or m, torques Nm or N; NaN: not told."""
        kept = self._kept.get(robot)
        if not kept:
            return np.empty(0), np.empty((0, 0))
        times = np.array([at for at, _ in kept])
        return times - times[-1], np.array([_value(feedback, quantity) for _, feedback in kept])


def _value(feedback: DriveFeedback, quantity: Quantity) -> Array:
    match quantity:
        case Quantity.POSITION:
            return feedback.position
        case Quantity.SPEED:
            return feedback.velocity
        case Quantity.TORQUE:
            return feedback.torque if feedback.torque is not None else np.full(len(feedback.position), np.nan)
        case Quantity.BEHIND:
            return feedback.commanded - feedback.position
