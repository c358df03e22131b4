"""Limits that are affine in the acceleration and the squared speed along a path."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Numbers = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Affine:
    """`lower <= a s_ddot + b s_dot^2 + c <= upper`, one limit per row, all fields `(k, rows)` or broadcasting to it.

    Accelerations of joints and of the TCP have this form with c = 0; joint torques have it too, c being what gravity
    takes. Standing still must be inside all limits: `lower < c < upper`.
    """

    a: Numbers
    b: Numbers
    c: Numbers
    lower: Numbers
    upper: Numbers

    def scaled(self) -> "Scaled":
        """The same with c moved to the bounds, in units of half the distance between them.

        Raises ValueError where standing still is outside a limit.
        """
        above, below = self.upper - self.c, self.c - self.lower
        if not (min(above.min(), below.min()) > 0.0):
            raise ValueError("a limit of the path does not allow standing still, allowed are lower < c < upper")
        half = (above + below) / 2.0
        with np.errstate(invalid="ignore"):
            shares = [np.where(np.isfinite(half), bound / half, 1.0) for bound in (above, below)]
        shape = self.a.shape
        return Scaled(self.a / half, self.b / half, *[np.broadcast_to(share, shape) for share in shares])


@dataclass(frozen=True, slots=True, eq=False)
class Scaled:
    """`-below <= a s_ddot + b s_dot^2 <= above`, all `(k, rows)`, `above + below` is 2."""

    a: Numbers
    b: Numbers
    above: Numbers
    below: Numbers
