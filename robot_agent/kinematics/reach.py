"""How far from the base the body of a robot can get.

The places that a point of a link can take are described by their support function, h(u) = max of u . p over the places
p. The one of what a turning joint makes of them follows by a maximum over one angle, that of a slide by its ends, and
the farthest place is the largest value for directions u of length one. Joints turn freely: a robot that is not
referenced may stand outside its limits. Slides keep to theirs, since only they bound a robot that slides.

Directions and angles are sampled in steps of `STEP`; the result is never too small, and by less than 1 % too large.
"""

from collections.abc import Callable

import numpy as np

from cell.geometry.arrays import Array

Places = Callable[[Array], Array]
"""Support function of `p` sets of places: directions `(..., 3)`, of any length, to `(..., p)` [m]."""
STEP = np.radians(4.0)
WIDER = 1 / np.cos(STEP / 2)
"""A polygon with its corners this much outside a circle contains it."""


def points(at: Array) -> Places:
    """Points `(p, 3)` [m] that do not move."""
    return lambda u: np.asarray(u @ at.T)


def placed(places: Places, offset: Array, rotation: Array | None = None) -> Places:
    """What a fixed link makes of places: turned by `rotation` `(3, 3)`, then moved by `offset` `(3,)` [m]."""
    inner = places if rotation is None else lambda u: places(u @ rotation)
    return lambda u: inner(u) + (u @ offset)[..., None]


def slid(places: Places, axis: int, lower: float, upper: float) -> Places:
    """Places moved by `lower` to `upper` [m] along an axis: 0, 1, 2 for X, Y, Z."""
    return lambda u: places(u) + np.maximum(lower * u[..., axis], upper * u[..., axis])[..., None]


def turned(places: Places, axis: int) -> Places:
    """Places turned by any angle about an axis: 0, 1, 2 for X, Y, Z."""
    tilts = np.linspace(0.0, np.pi, round(np.pi / STEP) + 1)
    around = np.arange(0.0, 2 * np.pi, STEP)
    u = np.empty((len(tilts), len(around), 3))
    u[..., axis] = np.cos(tilts)[:, None]
    u[..., (axis + 1) % 3] = WIDER * np.sin(tilts)[:, None] * np.cos(around)
    u[..., (axis + 2) % 3] = WIDER * np.sin(tilts)[:, None] * np.sin(around)
    most = places(u).max(axis=1)

    def support(u: Array) -> Array:
        # Only the tilt of u against the axis counts. Between two samples u is their sum with these shares.
        aside = np.hypot(u[..., (axis + 1) % 3], u[..., (axis + 2) % 3])
        tilt = np.arctan2(aside, u[..., axis])
        before = np.minimum((tilt / STEP).astype(int), len(tilts) - 2)
        rest = tilt - before * STEP
        length = np.hypot(aside, u[..., axis]) / np.sin(STEP)
        shares = length * np.sin(STEP - rest), length * np.sin(rest)
        return np.asarray(shares[0][..., None] * most[before] + shares[1][..., None] * most[before + 1])

    return support


def together(*parts: Places) -> Places:
    """Sums of places that are taken independently."""
    return lambda u: np.asarray(sum(part(u) for part in parts))


def farthest(places: Places) -> Array:
    """Largest distances from the origin: `(p,)` [m].

    For what several sets have in common, `places` may be the smallest of their support functions.
    """
    tilts = np.linspace(0.0, np.pi, round(np.pi / STEP) + 1)[:, None]
    around = np.arange(0.0, 2 * np.pi, STEP)
    u = np.stack(np.broadcast_arrays(np.sin(tilts) * np.cos(around), np.sin(tilts) * np.sin(around), np.cos(tilts)), -1)
    return np.asarray(WIDER**2 * places(u).max(axis=(0, 1)))
