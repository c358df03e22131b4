"""The body a robot publishes: few poses of its capsules that cover everything from one sample of a path to another."""

from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from cell.geometry import transform_points
from cell.geometry.arrays import Array
from cell.messages import Body
from cell.messages.sections import Single
from robot_agent.kinematics import Model, OpenMechanism
from robot_agent.workspace.swept_body import Sweep

BODY_GROWTH_M = 0.02
"""How much the capsules of one published pose are grown at most, to cover what follows it."""
ROUNDING = float(np.sqrt(3.0) * np.finfo(np.float32).epsneg)
"""How far rounding to single precision moves an end point at most, as a share of its largest coordinate."""


@dataclass(frozen=True, slots=True, eq=False)
class Envelope:
    """Chosen samples of a sweep. Capsules at `indices[i]`, grown by `growth[i]`, cover the path up to `indices[i + 1]`.

    The last sample is always chosen, and covers itself.
    """

    indices: tuple[int, ...]
    growth: tuple[float, ...]


def envelope(
    path: Sweep, first: int, last: int, growth_limit_m: float = BODY_GROWTH_M, widen_m: float = 0.0
) -> Envelope:
    """Cover the samples `first` to `last` (inclusive) of a sweep, and all between them, with few grown poses.

    A capsule whose end points have moved by at most g lies in the capsule grown by g, and a TCP that has in its ball of
    radius g; points on a chord are never farther from a pose than the chord's ends. Each pose reaches as far as the way
    travelled keeps its growth below `growth_limit_m`, and at least to the next sample, however far that is. `widen_m`,
    the distance between measured and commanded position, is added to every growth.
    """
    bulge = float(path.bulge[first:last].max(initial=0.0))
    ends, tcp = path.points[first : last + 1], path.tcp[first : last + 1]
    steps = np.maximum(path.chords[first:last].max(axis=-1), np.linalg.norm(np.diff(tcp, axis=0), axis=-1))
    travelled = np.concatenate([[0.0], steps.cumsum()])
    starts = _spread(travelled, growth_limit_m - bulge)
    if not starts:
        return Envelope((last,), (widen_m,))
    owner = np.repeat(starts, np.diff([*starts, last - first]))
    moved, of_tcp = ends[1:] - ends[owner], tcp[1:] - tcp[owner]
    squares = np.einsum("mcek,mcek->mce", moved, moved).max(axis=(1, 2))
    distances = np.sqrt(np.maximum(squares, np.einsum("mk,mk->m", of_tcp, of_tcp)))
    growth = np.maximum.reduceat(distances, starts) + (bulge + widen_m)
    return Envelope((*(first + i for i in starts), last), (*growth.tolist(), widen_m))


def body_message(
    model: Model, pose_world_base: Array, pieces: Sequence[tuple[Sweep, int, int]], widen_m: float = 0.0
) -> Body:
    """The body over pieces of paths (sweep, first and last sample, inclusive), in the order in which they are passed.

    The growth takes up what rounding to single precision moves.
    """
    points: list[Array] = []
    growth: list[float] = []
    for path, first, last in pieces:
        cover = envelope(path, first, last, widen_m=widen_m)
        chosen = list(cover.indices)
        tcp = np.repeat(path.tcp[chosen, None, None], 2, axis=2)
        points.append(np.concatenate([path.points[chosen], tcp], axis=1))
        growth.extend(cover.growth)
    return body_of(model, pose_world_base, np.concatenate(points), growth)


def standing_body(model: Model, pose_world_base: Array, q: Array, known: bool) -> Body:
    """The body of a robot at measured joints `q` `(n,)`.

    Its whole reach with `known` false (not referenced), or when its mechanism cannot be at these joints.
    """
    if not known:
        return unknown_body(model, pose_world_base)
    try:
        points = model.body_and_tcp(q)
    except OpenMechanism:
        return unknown_body(model, pose_world_base)
    return body_of(model, pose_world_base, transform_points(pose_world_base, points)[None], [0.0])


def unknown_body(model: Model, pose_world_base: Array) -> Body:
    """The body of a robot that may be anywhere: its whole reach."""
    return Body(known=False, base=_base(pose_world_base), reach_m=model.reach_m)


def joined(first: Body, second: Body) -> Body:
    """Everything that one of two bodies of the same robot covers.

    Its whole reach when one of them is that, and when they are not made of the same capsules, with what is held.
    """
    if not first.known or not second.known or not np.array_equal(first.radii_m, second.radii_m):
        return Body(False, first.base, max(first.reach_m, second.reach_m))
    return replace(
        first,
        poses=np.concatenate([first.poses, second.poses]),
        growth_m=np.concatenate([first.growth_m, second.growth_m]),
        tcp_m=np.concatenate([first.tcp_m, second.tcp_m]),
    )


def body_of(model: Model, pose_world_base: Array, points: Array, growth: list[float]) -> Body:
    """The body of poses in world `(m, c + 1, 2, 3)` [m], all capsules and then the TCP, each with its growth [m]."""
    rounding = ROUNDING * float(np.abs(points).max(initial=0.0))
    return Body(
        known=True,
        base=_base(pose_world_base),
        reach_m=model.reach_m,
        radii_m=rounded_up(model.capsule_radii),
        poses=points[:, :-1].astype(np.float32),
        growth_m=rounded_up(np.array(growth) + rounding),
        tcp_m=points[:, -1, 0].astype(np.float32),
    )


def rounded_up(values: Array) -> Single:
    """Rounded to single precision, never down."""
    return np.nextafter(values.astype(np.float32), np.float32(np.inf))


def _base(pose_world_base: Array) -> tuple[float, float, float]:
    x, y, z = pose_world_base[:3, 3].tolist()
    return x, y, z


def _spread(travelled: Array, limit_m: float) -> list[int]:
    """Samples from one to the next of which, or to the last, the way is at most the limit, if samples allow."""
    starts = []
    at, last = 0, len(travelled) - 1
    way = travelled.tolist()
    while at < last:
        starts.append(at)
        at = max(bisect_right(way, way[at] + limit_m) - 1, at + 1)
    return starts
