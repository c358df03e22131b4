"""Lines and arcs within a tolerance: many short ones become a few smooth curves, corners stay corners.

A vertex is a corner where the direction turns by more than `CORNER_RAD` at once, seen over twice the tolerance of the
way before and after it: the path ends there, exactly. Where the way bends over several short lines there is none.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from cell.geometry import quaternion
from robot_agent.paths.arc import Arc
from robot_agent.paths.caps import Tolerance
from robot_agent.paths.chain import CurveChain
from robot_agent.paths.curves import Numbers, Polynomial
from robot_agent.paths.fitted_orientation import FittedOrientation
from robot_agent.paths.fitting import Fit, NotFitted, Polyline, fitted
from robot_agent.paths.legs import legs
from robot_agent.paths.line import Line
from robot_agent.paths.orientation import Orientation, Turn, turn_between, turned
from robot_agent.paths.pose_path import PosePath, pose_paths
from robot_agent.paths.transition import Continuity, Passing, Transition

CORNER_RAD = np.radians(30.0)
"""A vertex that turns more is a corner."""
_SEEN = 2.0
"""Tolerances of the way, before and after a vertex, over which its turn is seen."""
_AT_ONCE = 0.75
"""Share of the turn seen over twice that way that a corner makes: a circle has half of it."""
_SAME = 0.02
"""Share of the tolerance within which vertices are one."""
_SAGITTA = 0.1
"""Share of the tolerance by which an arc may be beside its chords."""
_STEP_RAD = np.radians(2.0)
"""Lines that turn the tool farther are looked at in parts, in which the turn is even as good as straight."""
_STILL_RAD = 5e-6
"""Less is rounding."""
_NO_WAY_M, _SPECK_M = 1e-9, 1e-7
"""On less way the tool turns on the spot, in any case or where it turns far."""


@dataclass(frozen=True, slots=True, eq=False)
class Entry:
    """How the TCP comes to where it begins, by the way: direction, curvature, turn [rad/m] and its change, `(3,)`."""

    tangent: Numbers
    curvature: Numbers
    spin: Numbers
    change: Numbers


@dataclass(frozen=True, slots=True, eq=False)
class _Vertices:
    """The polyline of some moves: `places` `(n + 1, 3)`, `quaternions` `(n + 1, 4)`, each next to the one before.

    `ends` `(moves,)` is the vertex at which each move ends. The moves are within the share `slack` of the tolerance.
    """

    places: Numbers
    quaternions: Numbers
    ends: NDArray[np.intp]
    slack: float = 0.0

    @property
    def lengths(self) -> Numbers:
        return np.asarray(np.linalg.norm(np.diff(self.places, axis=0), axis=1))


def smoothed(
    moves: Sequence[tuple[int, Line | Arc]],
    aimed: Numbers,
    start: Numbers,
    entry: Entry | None,
    beyond: Sequence[Line | Arc],
    blend_m: float,
) -> list[PosePath]:
    """Paths along moves (index, move) of one tolerance, from corner to corner; it stops between them.

    The first begins in pose `start` `(4, 4)`, within the tolerance of `aimed`, where the moves begin; moving as
    `entry` says, where that is possible. The last leads towards what is `beyond`. Where no smooth curve is within the
    tolerance the moves are passed as they are, as `pose_paths` does with `blend_m`. Raises PathError.
    """
    return _Smoothing(moves, aimed, start, entry, beyond, blend_m).paths()


class _Smoothing:
    """The paths along some moves, in order."""

    def __init__(
        self,
        moves: Sequence[tuple[int, Line | Arc]],
        aimed: Numbers,
        start: Numbers,
        entry: Entry | None,
        beyond: Sequence[Line | Arc],
        blend_m: float,
    ) -> None:
        tolerance = moves[0][1].tolerance
        if tolerance is None:
            raise ValueError("smooth curves keep to a tolerance, and the first move has none")
        self._moves, self._blend_m, self._tolerance = moves, blend_m, tolerance
        lines = [*(move for _, move in moves), *beyond]
        self._line = _without_specks(_vertices(lines, aimed, tolerance), tolerance)
        self._entry = entry if entry is not None and self._goes_on(entry) else None
        self._last = int(self._line.ends[len(moves) - 1])
        """The vertex at which the moves end."""
        self._made: list[PosePath] = []
        self._ended: dict[int, Numbers] = {0: start}
        """The pose in which the path passes a vertex, where it is not quite that: near vertices are one."""

    def paths(self) -> list[PosePath]:
        line = self._line
        turned = np.linalg.norm(np.diff(line.quaternions, axis=0), axis=1)
        spot = (line.lengths < _NO_WAY_M) | (turned > 0.51 * _STEP_RAD)
        spots = np.flatnonzero(spot)
        stops = np.unique(np.concatenate([[0], corners(line, self._tolerance), spots, spots + 1, [len(line.lengths)]]))
        for first, last in pairwise(stops.tolist()):
            if first >= self._last:
                break
            if spot[first]:
                self._plainly(first, last)
            else:
                self._along(first, last)
        if not self._made:
            self._plainly(0, 0)
        return self._made

    def _goes_on(self, entry: Entry) -> bool:
        """Whether there is no corner where the moves begin."""
        ahead = _at_way(self._line, np.array([_SEEN * self._tolerance.distance_m]))[0] - self._line.places[0]
        return bool(_angles(entry.tangent[None], ahead[None])[0] <= CORNER_RAD)

    def _along(self, first: int, last: int) -> None:
        """From vertex to vertex, on smooth curves as far as there are some within the tolerance."""
        try:
            self._made.append(self._smooth(first, last, self._entry if first == 0 else None))
        except NotFitted as error:
            if first == 0 and self._entry is not None:
                self._entry = None
                self._along(first, last)
            elif last > self._last:
                self._along(first, self._last)
            else:
                t = np.append(0.0, np.cumsum(self._line.lengths[first:last]))
                at = first + int(np.clip(np.searchsorted(t, error.t, side="right") - 1, 0, last - first - 1))
                begins, ends = self._move_around(at)
                begins, ends = max(begins, first), min(ends, last)
                if begins > first:
                    self._along(first, begins)
                self._plainly(begins, ends)
                if ends < last:
                    self._along(ends, last)

    def _move_around(self, line: int) -> tuple[int, int]:
        """The vertices between which the move lies that a line is part of."""
        number = int(np.searchsorted(self._line.ends, line, side="right"))
        return int(self._line.ends[number - 1]) if number else 0, int(self._line.ends[number])

    def _pose(self, vertex: int) -> Numbers:
        if vertex in self._ended:
            return self._ended[vertex]
        pose = np.eye(4)
        pose[:3, :3] = quaternion.to_matrix(self._line.quaternions[vertex])
        pose[:3, 3] = self._line.places[vertex]
        return pose

    def _plainly(self, first: int, last: int) -> None:
        """The moves as they are."""
        own = [move for move, end in zip(self._moves, self._line.ends, strict=False) if first < end <= last or not last]
        made = pose_paths(legs(own, self._pose(first)), self._blend_m)
        self._ended[last] = made[-1].poses(np.array([made[-1].length_m]))[0] if made else self._pose(first)
        self._made += made

    def _smooth(self, first: int, last: int, entry: Entry | None) -> PosePath:
        """Raises NotFitted."""
        line, tolerance = self._line, self._tolerance
        places, turns = line.places[first : last + 1], line.quaternions[first : last + 1]
        start = self._pose(first)
        own = quaternion.from_matrix(start[:3, :3])
        own = own if own @ turns[0] > 0.0 else -own
        t = np.append(0.0, np.cumsum(line.lengths[first:last]))
        still = 2.0 * np.linalg.norm(turns - own, axis=1).max() < _STILL_RAD
        still = still and (entry is None or np.linalg.norm(entry.spin) * tolerance.distance_m < _STILL_RAD)
        x = places if still else np.hstack([places, turns])
        slack = 0.0 if still else float((np.linalg.norm(np.diff(turns, axis=0), axis=1) ** 2).max() / 8.0)
        begins = _states(start[:3, 3], own, entry)[:, : x.shape[1]]
        taken = 1.0 - line.slack
        fit = fitted(Polyline(t, x, slack), taken * tolerance.distance_m, taken * tolerance.angle_rad, begins)
        return self._path(first, min(last, self._last), t, fit, start)

    def _path(self, first: int, last: int, t: Numbers, fit: Fit, start: Numbers) -> PosePath:
        """The path of a fit up to vertex `last`; the vertices from `first` on are at `t`."""
        spline = fit.spline.until(float(t[last - first]))
        curves = tuple(Polynomial(each) for each in spline.powers[..., :3])
        chain = CurveChain(curves, np.append(0.0, np.cumsum([each.length_m for each in curves])))
        orientation: Orientation | FittedOrientation
        if spline.powers.shape[2] == 3:
            orientation = Orientation((Turn(start[:3, :3], np.array([0.0, 0.0, 1.0]), 0.0, 0.0),), ())
        else:
            orientation = FittedOrientation(chain, spline.powers[..., 3:])
        ends = self._line.ends[: len(self._moves)]
        begins = np.append(0, ends[:-1])
        own = np.flatnonzero((begins < last) & (ends > first) | (ends == last) | (ends == 0) & (first == 0))
        vertex = np.clip(ends[own], first, last) - first
        index = np.clip(np.searchsorted(spline.knots, t[vertex], side="right") - 1, 0, len(curves) - 1)
        u = (t[vertex] - spline.knots[index]) / np.diff(spline.knots)[index]
        numbers = tuple(self._moves[k][0] for k in own.tolist())
        count = f"{len(own)} moves in {len(curves)} curves"
        slack = self._line.slack
        told = Transition(
            numbers[0], numbers[-1], Continuity.C0, Passing.FITTED, count,
            fit.deviation_m + slack * self._tolerance.distance_m,
            fit.deviation_rad + slack * self._tolerance.angle_rad,
        )  # fmt: skip
        distance = np.minimum(chain.distance(index, u), chain.length_m)
        distance[vertex == last - first] = chain.length_m
        return PosePath(chain, orientation, numbers, np.maximum.accumulate(distance), (told,))


def corners(line: "_Vertices", tolerance: Tolerance) -> NDArray[np.intp]:
    """The vertices that are corners."""
    way = np.append(0.0, np.cumsum(line.lengths))
    inner, seen = np.arange(1, len(way) - 1), _SEEN * tolerance.distance_m
    turns = []
    for far in (seen, 2.0 * seen):
        before, after = (_at_way(line, way[inner] + each) for each in (-far, far))
        turns.append(_angles(line.places[inner] - before, after - line.places[inner]))
    candidates = np.flatnonzero((turns[0] > CORNER_RAD) & (turns[0] >= _AT_ONCE * turns[1]))
    found: list[int] = []
    for each in candidates[np.argsort(-turns[0][candidates], kind="stable")].tolist():
        if all(abs(way[each + 1] - way[other]) > seen for other in found):
            found.append(each + 1)
    return np.sort(np.array(found, dtype=np.intp))


def _at_way(line: "_Vertices", way: Numbers) -> Numbers:
    """Places `(k, 3)` at ways `(k,)` [m] along the vertices, those beyond its ends at the ends."""
    known = np.append(0.0, np.cumsum(line.lengths))
    return np.stack([np.interp(way, known, each) for each in line.places.T], axis=1)


def _angles(before: Numbers, after: Numbers) -> Numbers:
    """Angles `(k,)` between directions `(k, 3)`, exact for small ones and for those near pi; 0 where one is none."""
    lengths = [np.linalg.norm(each, axis=1) for each in (before, after)]
    one, other = (
        each / np.maximum(length, 1e-300)[:, None] for each, length in zip((before, after), lengths, strict=True)
    )
    angle = 2.0 * np.arctan2(np.linalg.norm(other - one, axis=1), np.linalg.norm(other + one, axis=1))
    return np.where(np.minimum(*lengths) > _NO_WAY_M, angle, 0.0)


def _states(place: Numbers, q: Numbers, entry: Entry | None) -> Numbers:
    """Place and quaternion `(1, 7)` where a curve begins; with an entry also two derivatives by the way `(3, 7)`."""
    here = np.concatenate([place, q])
    if entry is None:
        return here[None]
    first = quaternion.multiply(np.append(entry.spin, 0.0), q) / 2.0
    second = (
        quaternion.multiply(np.append(entry.change, 0.0), q) + quaternion.multiply(np.append(entry.spin, 0.0), first)
    ) / 2.0
    return np.stack([here, np.concatenate([entry.tangent, first]), np.concatenate([entry.curvature, second])])


def _vertices(moves: Sequence[Line | Arc], start: Numbers, tolerance: Tolerance) -> _Vertices:
    """The polyline: one vertex for each line; more where the tool turns far, and on arcs."""
    parts: list[Numbers] = [start[None]]
    ends, count, pose = [], 0, start
    for move in moves:
        made = _between(move, pose, tolerance)
        parts.append(made)
        count += len(made)
        ends.append(count)
        pose = made[-1]
    poses = np.concatenate(parts)
    q = quaternion.from_matrix(poses[:, :3, :3])
    flips = np.append(False, (q[1:] * q[:-1]).sum(axis=1) < 0.0)
    q[np.cumsum(flips) % 2 == 1] *= -1.0
    slack = _SAGITTA if any(isinstance(move, Arc) for move in moves) else 0.0
    return _Vertices(poses[:, :3, 3], q, np.array(ends, dtype=np.intp), slack)


def _between(move: Line | Arc, start: Numbers, tolerance: Tolerance) -> Numbers:
    """Poses `(k, 4, 4)` on the way of one move, the last at its end."""
    if isinstance(move, Line):
        target = np.asarray(move.target_pose)
        cosine = (np.vdot(target[:3, :3], start[:3, :3]) - 1.0) / 2.0
        if cosine > _COSINE or math.dist(target[:3, 3], start[:3, 3]) < _SPECK_M:
            return target[None]
        axis, angle = turn_between(start[:3, :3], target[:3, :3])
        share = np.arange(1.0, np.ceil(angle / _STEP_RAD) + 1.0) / np.ceil(angle / _STEP_RAD)
        poses = np.tile(target, (len(share), 1, 1))
        poses[:, :3, :3] = turned(axis, angle * share) @ start[:3, :3]
        poses[:, :3, 3] = start[:3, 3] + share[:, None] * (target[:3, 3] - start[:3, 3])
        poses[-1] = target
        return poses
    (leg,) = legs([(0, move)], start)
    radius = float(1.0 / np.linalg.norm(leg.curve.at(np.zeros(()))[2]))
    step = 2.0 * np.arccos(max(1.0 - _SAGITTA * tolerance.distance_m / radius, -0.5)) * radius
    turning = max(turn.rate_rad_m for turn in leg.turns)
    count = np.ceil(leg.curve.length_m / min(step, _STEP_RAD / max(turning, 1e-12)))
    (path,) = pose_paths([leg], 0.0)
    borders = np.union1d(np.arange(1.0, count + 1.0) / count * leg.curve.length_m, leg.ends_m)
    return path.poses(borders)


_COSINE = float(np.cos(_STEP_RAD))


def _without_specks(line: _Vertices, tolerance: Tolerance) -> _Vertices:
    """The same without vertices that are all but where the one before is."""
    near_m, near = _SAME * tolerance.distance_m, _SAME * tolerance.angle_rad / 2.0
    if line.lengths.min() > near_m:
        return line
    kept, numbers = [0], [0]
    places, q = line.places.tolist(), line.quaternions.tolist()
    for k in range(1, len(places)):
        at = kept[-1]
        if math.dist(places[k], places[at]) > near_m or math.dist(q[k], q[at]) > near:
            kept.append(k)
        numbers.append(len(kept) - 1)
    if kept[-1] != len(places) - 1 and len(kept) > 1:
        kept[-1] = len(places) - 1
    slack = line.slack + 2.0 * _SAME
    return _Vertices(line.places[kept], line.quaternions[kept], np.array(numbers)[line.ends], slack)
