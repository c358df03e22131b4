"""Curves one after the other."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from robot_agent.paths.curves import Curve, Numbers, Polynomial, Polynomials, Trimmed


@dataclass(frozen=True, eq=False)
class CurveChain:
    """`curves` by distance from the beginning of the first; they begin and end at `starts_m` `(curves + 1,)`."""

    curves: tuple[Curve, ...]
    starts_m: Numbers

    @property
    def length_m(self) -> float:
        return float(self.starts_m[-1])

    def at(self, distance_m: Numbers) -> Numbers:
        """Position, tangent and curvature `(3, k, 3)` at distances `(k,)`."""
        index = np.searchsorted(self.starts_m[1:-1], distance_m, side="right")
        own = distance_m - self.starts_m[index]
        states = np.empty((3, len(distance_m), 3))
        others = np.ones(len(distance_m), dtype=np.bool_)
        if self._polynomials is not None:
            number, trimmed = self._known[0][index], self._known[1][index]
            others = number < 0
            states[:, ~others] = self._polynomials.at(number[~others], (own + trimmed)[~others])
        for curve in set(index[others].tolist()):
            chosen = index == curve
            states[:, chosen] = self.curves[curve].at(own[chosen])
        return states

    def parameter(self, distance_m: Numbers) -> tuple[NDArray[np.intp], Numbers]:
        """The number of the curve and u on it at distances `(k,)`, where all curves are polynomials."""
        index = np.searchsorted(self.starts_m[1:-1], distance_m, side="right")
        return index, self._whole.parameter(index, distance_m - self.starts_m[index])

    def derivatives(self, index: NDArray[np.intp], u: Numbers) -> Numbers:
        """Place and its two derivatives by u `(3, k, 3)` on curves with these numbers, all of them polynomials."""
        return self._whole.derivatives(index, u)

    def distance(self, index: NDArray[np.intp], u: Numbers) -> Numbers:
        """Distances `(k,)` [m] at u `(k,)` on curves with these numbers, all of them polynomials."""
        return np.asarray(self.starts_m[index] + self._whole.distance(index, u))

    @property
    def _whole(self) -> Polynomials:
        if self._polynomials is None:
            raise ValueError("a parameter u is of polynomials, and no curve of the chain is one")
        return self._polynomials

    @cached_property
    def _bare(self) -> list[tuple[Curve, float]]:
        """Each curve without what trims it, and the distance that is trimmed off its beginning."""
        bare = []
        for curve in self.curves:
            trimmed = 0.0
            while isinstance(curve, Trimmed):
                trimmed, curve = trimmed + curve.first_m, curve.curve
            bare.append((curve, trimmed))
        return bare

    @cached_property
    def _known(self) -> tuple[NDArray[np.intp], Numbers]:
        """The number of each curve among the polynomials, or -1; and what is trimmed off it."""
        is_known = np.array([isinstance(curve, Polynomial) for curve, _ in self._bare])
        number = np.where(is_known, np.cumsum(is_known) - 1, -1)
        return number, np.array([trimmed for _, trimmed in self._bare])

    @cached_property
    def _polynomials(self) -> Polynomials | None:
        found = [curve for curve, _ in self._bare if isinstance(curve, Polynomial)]
        return Polynomials(found) if found else None
