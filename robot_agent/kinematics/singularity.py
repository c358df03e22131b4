"""How far a robot is from poses in which it loses a direction of motion."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cell.geometry.arrays import Array


@dataclass(frozen=True, slots=True, eq=False)
class SingularityDistance:
    """Measures of joints `(...)` for each named singularity of a family: 0 is singular, 1 as far as it gets.

    A measure is the sine of the angle between what would have to fall into one line, or a distance divided by the
    longest one; the determinant of the Jacobian is their product times the lengths of the arm.
    """

    names: tuple[str, ...]
    distances: Array
    """`(..., s)`, one per name."""

    @property
    def nearest(self) -> Array:
        """`(...)`: the smallest measure."""
        return np.asarray(self.distances.min(axis=-1))

    @property
    def name(self) -> NDArray[np.str_]:
        """`(...)`: the name of the singularity that is nearest."""
        return np.asarray(np.array(self.names)[self.distances.argmin(axis=-1)])
