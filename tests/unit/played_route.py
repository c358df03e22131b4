"""Ways by their own formulas, and whether what a robot played is on them, in their order, to their end."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from tests.unit.turned_arm import flange

Numbers = NDArray[np.float64]

_STEP_M = 1e-3
_AHEAD = 200
"""No sample is farther along the way than so many corners after the one before it."""


def line(begin: Numbers, end: Numbers) -> Numbers:
    """Places `(n, 3)` [m] of a straight way."""
    count = int(np.linalg.norm(end - begin) / _STEP_M) + 2
    return begin + np.linspace(0.0, 1.0, count)[:, None] * (end - begin)


def circle(a: Numbers, b: Numbers, c: Numbers) -> tuple[complex, float]:
    """Centre and radius of the circle through three places in an XY plane, by complex numbers."""
    z, w, v = (complex(each[0], each[1]) for each in (a, b, c))
    turned = (v - z) / (w - z)
    centre = (w - z) * (turned - abs(turned) ** 2) / (2j * turned.imag) + z
    return centre, abs(z - centre)


def arc(begin: Numbers, via: Numbers, end: Numbers, angle_rad: float | None = None) -> Numbers:
    """The way on a circle in the XY plane: to its end over `via`, or by an angle, positive towards `via`."""
    centre, radius = circle(begin, via, end)
    first, middle, last = (complex(*each[:2]) - centre for each in (begin, via, end))
    over, there = np.angle(middle / first) % (2 * np.pi), np.angle(last / first) % (2 * np.pi)
    left = over < there
    """Whether the via point is passed first when one goes counter-clockwise."""
    sweep = (there if left else there - 2 * np.pi) if angle_rad is None else (angle_rad if left else -angle_rad)
    angles = np.linspace(0.0, sweep, int(abs(sweep) * radius / _STEP_M) + 2)
    on = centre + first * np.exp(1j * angles)
    return np.stack([on.real, on.imag, np.full(len(on), begin[2])], axis=1)


def joint_line(begin: Numbers, end: Numbers) -> Numbers:
    """Places of the flange while all joints `(6,)` [rad] go evenly."""
    count = int(np.abs(end - begin).max() * 3.0 / _STEP_M) + 2
    return flange(begin + np.linspace(0.0, 1.0, count)[:, None] * (end - begin))[0]


def joints_at(place: Numbers, rotation: Numbers, near: Numbers) -> Numbers:
    """Joints `(6,)` with the flange there, sought from those by Newton's steps."""
    q = near.copy()
    for _ in range(50):
        tried = q + np.vstack([np.zeros(6), 1e-6 * np.eye(6)])
        places, rotations = flange(tried)
        away = np.concatenate([places - place, _turn(rotation, rotations)], axis=1)
        step = np.linalg.solve((away[1:] - away[0]).T / 1e-6, -away[0])
        q = q + step * min(1.0, 0.3 / float(np.abs(step).max()))
        if np.abs(step).max() < 1e-10:
            return q
    raise AssertionError(f"no joints found for {place}")


def _turn(to: Numbers, rotations: Numbers) -> Numbers:
    """Half the axial part of the turns `(n, 3)` that are left to a rotation."""
    left = rotations @ to.T
    apart = left - np.swapaxes(left, 1, 2)
    return np.stack([apart[:, 2, 1], apart[:, 0, 2], apart[:, 1, 0]], axis=1) / 2.0


def assert_follows(played: Numbers, way: Sequence[Numbers], near_m: float) -> Numbers:
    """That places `(n, 3)` [m] go along the pieces of a way, in their order and to its end.

    Returns how far along it `(n,)` [m] each is.
    """
    corners = np.concatenate(way)
    corners = corners[np.append(True, np.linalg.norm(np.diff(corners, axis=0), axis=1) > 1e-9)]
    begins = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(corners, axis=0), axis=1))])
    every_way, at = np.diff(corners, axis=0), 0
    along = np.zeros(len(played))
    moved = np.append(True, np.any(played[1:] != played[:-1], axis=1))
    for sample, place in enumerate(played):
        if not moved[sample]:
            along[sample] = along[sample - 1]
            continue
        first, ways = corners[at : at + _AHEAD][: len(every_way) - at], every_way[at : at + _AHEAD]
        share = np.clip(((place - first) * ways).sum(axis=1) / (ways * ways).sum(axis=1), 0.0, 1.0)
        away = np.linalg.norm(place - first - share[:, None] * ways, axis=1)
        best = int(np.flatnonzero(away < away.min() + near_m / 10.0)[0])
        assert away[best] < near_m, f"sample {sample} is {1000 * away[best]:.3f} mm beside the way"
        along[sample] = begins[at + best] + share[best] * np.linalg.norm(ways[best])
        at += best
    assert along[-1] > begins[-1] - near_m, f"it ends {begins[-1] - along[-1]:.4f} m before the end of its way"
    return along


def polygon(*corners: Numbers) -> list[Numbers]:
    """The straight ways from each to the next."""
    return [line(begin, end) for begin, end in pairwise(corners)]
