"""A planned motion, cut into the sections of space that its robot asks for (`docs/architecture.md`, section 4.5).

A section covers the robot while it is between two taus of its motion, as far as it may follow behind, and while its
drives brake by themselves. Such a quick stop leaves the path: each axis brakes with its own deceleration, and the
drives do not wait for each other. Here that deceleration is what the gateway told of the drives when it gave the robot,
and not half of what the ramps need, as in `braking`. An axis that takes longer, because it carries a load, is not
covered; where that happens, the space is reserved by force.
"""

from bisect import bisect_right
from contextlib import suppress
from dataclasses import dataclass
from hashlib import blake2b
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cell.geometry import transform_points
from cell.geometry.arrays import Array, Flags
from cell.messages import Body, Sections
from robot_agent.kinematics import Model, OpenMechanism
from robot_agent.workspace.body import ROUNDING, rounded_up
from robot_agent.workspace.braking import Braking
from robot_agent.workspace.swept_body import Sweep

FOLLOWING_M = 0.010
"""How far the measured robot may be from the commanded one."""
ROOM_M = 0.010
"""A robot that stands keeps so much room around it, for what it is pushed, and to begin the next motion in."""
BACKING_RATE = 0.5
"""Sections cover quick stops on the way back up to this rate; those at full rate would let them grow by 14 % more."""
_SECTION_S = 0.010
_SECTION_M = 0.010
"""A section lasts as long as `_SECTION_S`, or as the end that moves fastest needs for this, if that is longer."""
_BORDER_S = 1e-9
_START_S = 0.010
"""A quick stop is tried at least so often, where the samples of the path allow it."""
_STOP_SAMPLES = 8
"""Moments of each quick stop that are looked at, after its start."""
_BEFORE = 1e-6
"""Samples before the end of a stretch, so that its last place belongs to the step before."""
_STILL_M2 = 1e-18
"""A robot that goes no farther than the root of this from sample to sample stands."""
_NEARINGS = 2
"""Steps to the nearest place of the path."""
_BETWEEN_M = 0.0005
"""Added to strays, for what is between the stops that are tried; other samples of a path find as much as that."""
_AT_ONCE = 1000
"""Quick stops that are looked at together: more would leave the processor's cache."""

Indices = NDArray[np.intp]


@dataclass(frozen=True, slots=True, eq=False)
class MotionSections:
    """The sections of a motion, in its order."""

    taus: Array
    """`(s + 1,)` [s], rising: section `i` covers the body wherever the robot is from `taus[i]` to `taus[i + 1]`."""
    sections: Sections
    stray: Array
    """`(s, c)` [m]: how much of the radii is for quick stops."""

    def index(self, tau: float) -> int:
        """The section that covers tau [s]; a border belongs to the earlier one. Beyond the ends, the outermost one."""
        return int(np.searchsorted(self.taus[1:-1], tau - _BORDER_S, side="left"))

    def span(self, first: float, last: float) -> tuple[int, int]:
        """First and last section, inclusive, of those that cover the taus from `first` to `last` [s].

        They are as few as can be: a border at the beginning belongs to the later section, one at the end to the
        earlier one. A span of no length is as `index` has it.
        """
        end = self.index(last)
        return min(int(np.searchsorted(self.taus[1:-1], first + _BORDER_S, side="right")), end), end


def cut(braking: Braking, path: Sweep, taus: Array, q: Array, qd: Array) -> MotionSections:
    """The sections of a motion from its samples: taus `(m,)` [s], joints `q` `(m, n)` and their speeds `qd` at rate 1.

    `path` is the body swept by the same samples, and `braking` that of the model that sweeps it.

    A quick stop that begins at `tau` at rate 1 or less is covered: at each moment the robot is within one of the
    sections from that of `tau` to that in which a braking ramp along the path can end at the earliest. Whoever has the
    sections that its blocks may play has these. Backwards that holds up to `BACKING_RATE`.
    """
    edges = _edges(path, taus, 0)
    stops = _QuickStops(braking, taus, q, qd)
    stray = stops.strays(taus[edges], np.zeros((0, len(path.radii))))
    return MotionSections(taus[edges], _sections(path, edges, stray), stray)


def extended(
    old: MotionSections, cut_s: float, splice_s: float, braking: Braking, path: Sweep, taus: Array, q: Array, qd: Array
) -> MotionSections:
    """The sections of a motion that takes the place of the one with sections `old` while the robot is on that.

    Its tau 0 is tau `cut_s` of the old one, and it is the same motion up to its own tau `splice_s`; the rest as `cut`.
    The old sections that begin before the splice stay, the last of them up to the splice. Quick stops that begin before
    the splice and may end beyond it are covered by them and by the new ones.
    """
    begin = old.taus[:-1] - cut_s
    end = np.minimum(old.taus[1:] - cut_s, splice_s)
    kept = np.flatnonzero((end > _BORDER_S) & (begin < splice_s - _BORDER_S))
    first = max(int(np.searchsorted(taus, splice_s + _BORDER_S, side="right")) - 1, 0)
    edges = _edges(path, taus, first)
    borders = np.concatenate([np.maximum(begin[kept], 0.0), [splice_s], taus[edges[1:]]])
    stops = _QuickStops(braking, taus, q, qd)
    stray = stops.strays(borders, old.stray[kept])
    new = _sections(path, edges, stray[len(kept) :])
    before = old.sections[kept]
    joined = Sections(
        np.concatenate([before.ids, new.ids]),
        np.concatenate([before.points, new.points]),
        np.concatenate([before.radii, new.radii]),
    )
    return MotionSections(borders, joined, stray)


def standing(model: Model, pose_world_base: Array, q: Array, reserve_m: float = 0.0) -> Sections:
    """One section: the robot at measured joints `q` `(n,)`, and as far beside them as it may follow behind.

    `reserve_m` is added to its radii. The whole reach, when its mechanism cannot be at these joints.
    """
    try:
        points = transform_points(pose_world_base, model.capsules(np.asarray(q, dtype=float)[None]))
        radii = model.capsule_radii[None]
    except OpenMechanism:
        count = len(model.body)
        points = np.broadcast_to(pose_world_base[:3, 3], (1, count, 2, 3))
        radii = np.full((1, count), model.reach_m)
    return of_points(points, radii + (FOLLOWING_M + reserve_m))


def sections_of(body: Body) -> Sections:
    """A section for each pose of a known body."""
    return of_points(body.poses.astype(float), body.radii_m + body.growth_m[:, None].astype(float))


def of_points(points: Array, radii: Array) -> Sections:
    """Sections of capsules `(s, c, 2, 3)` of these radii, which broadcast to `(s, c)` [m]."""
    rounding = ROUNDING * np.abs(points).max(axis=(1, 2, 3), initial=0.0)
    single = points.astype(np.float32) + np.float32(0.0)  # no -0.0: an equal place has equal bytes
    grown = rounded_up(np.broadcast_to(radii, points.shape[:2]) + rounding[:, None])
    return Sections(_ids(single, grown), single, grown)


def _edges(path: Sweep, taus: Array, first: int) -> Indices:
    """Samples `(s + 1,)` from `first` to the last one at which sections begin and end."""
    last = len(taus) - 1
    way = np.concatenate([[0.0], path.chords.max(axis=-1, initial=0.0).cumsum()]).tolist()
    times, edges = taus.tolist(), [first]
    while edges[-1] < last:
        at = edges[-1]
        by_time = bisect_right(times, times[at] + _SECTION_S + _BORDER_S)
        by_way = bisect_right(way, way[at] + _SECTION_M)
        edges.append(max(by_time - 1, by_way - 1, at + 1))
    return np.array(edges if len(edges) > 1 else [first, first])


def _sections(path: Sweep, edges: Indices, stray: Array) -> Sections:
    """Each with its points in the middle between first and last sample, from which the way is shortest."""
    firsts, last = edges[:-1], edges[-1]
    points = (path.points[firsts] + path.points[edges[1:]]) / 2.0
    radii = path.radii + stray
    if last > firsts[0]:
        owner = np.repeat(np.arange(len(firsts)), np.diff(edges))
        moved = path.points[firsts[0] + 1 : last + 1] - points[owner]
        away = np.sqrt(np.einsum("mcek,mcek->mce", moved, moved).max(axis=-1))
        bulge = path.bulge[firsts[0] : last]
        radii = radii + np.maximum.reduceat(away + bulge[:, None], firsts - firsts[0])
    return of_points(points, radii + FOLLOWING_M)


def _ids(points: NDArray[np.float32], radii: NDArray[np.float32]) -> NDArray[np.uint64]:
    """By what the sections cover, never 0."""
    count = len(points)
    numbers = np.concatenate([points.reshape(count, -1), radii], axis=1).astype("<f4")
    digests = b"".join(blake2b(row.tobytes(), digest_size=8).digest() for row in numbers)
    return np.maximum(np.frombuffer(digests, "<u8").astype(np.uint64), np.uint64(1))


class _QuickStops:
    """Quick stops that begin along a motion, and how far they take each capsule off the path.

    Lengths do not depend on where the robot stands: all is in the frame of its base.
    """

    def __init__(self, braking: Braking, taus: Array, q: Array, qd: Array) -> None:
        self._model, self._deceleration, self._ramp = braking.model, braking.quick_stop, braking.acceleration
        self._taus, self._q = taus, q
        self._path = braking.model.capsules(q)
        self._steps = np.diff(self._path, axis=0) if len(q) > 1 else np.zeros_like(self._path)
        self._squares = np.maximum(np.einsum("mcex,mcex->m", self._steps, self._steps), _STILL_M2)
        self._starts = _every(taus, _START_S)
        speeds = braking.model.coupling.axes(qd)
        self._speeds = speeds[self._starts]
        self._ends = self._earliest_rest(braking.model.coupling.axes(q), speeds)

    def strays(self, borders: Array, kept: Array) -> Array:
        """What each section between `borders` `(s + 1,)` [s] needs for them, `(s, c)` [m].

        The first sections have what they have, `kept` `(k, c)`; what they do not cover is left to the next one. Stops
        that are over before that begins are not looked at.
        """
        stray = np.zeros((len(borders) - 1, self._path.shape[1]))
        stray[: len(kept)] = kept
        beyond = np.flatnonzero(self._taus[self._ends] > borders[len(kept)])
        first = max(int(beyond[0]) - 1, 0) if len(beyond) else len(self._starts)
        for begin in range(first, len(self._starts), _AT_ONCE):
            some = slice(max(begin - 1, first), begin + _AT_ONCE + 1)
            self._add(stray, some, borders, len(kept))
            stray[: len(kept)] = kept
        stray[len(kept) :] += _BETWEEN_M * (stray[len(kept) :] > 0.0)
        return stray

    def _earliest_rest(self, axes: Array, speeds: Array) -> Indices:
        """For each start the sample by which a ramp along the path may end: each axis has gone as far as it must.

        No axis can rest, or turn round, before it has gone what the hardest ramp needs.
        """
        last, ends = len(self._taus) - 1, self._starts.copy()
        needed, sense = self._speeds**2 / (2.0 * self._ramp), np.sign(self._speeds)
        done = needed == 0.0
        going = np.flatnonzero(~done.all(axis=1) & (ends < last))
        while len(going):
            ends[going] += 1
            gone = (axes[ends[going]] - axes[self._starts[going]]) * sense[going]
            done[going] |= (gone >= needed[going]) | (speeds[ends[going]] * sense[going] <= 0.0)
            going = going[~done[going].all(axis=1) & (ends[going] < last)]
        return ends

    def _add(self, stray: Array, some: slice, borders: Array, kept: int) -> None:
        """Raise the strays of all sections that some of the stops need.

        Between two stops, and between two moments of one, the robot is between where those four are. So each section
        between the first and the last of their places needs the largest of their strays.
        """
        points, possible = self._stopping(some)
        places, away = self._beside(some, points)
        away[~possible] = 2.0 * self._model.reach_m
        low, high = self._sections_at(places, borders)
        lowest, highest = _around(np.minimum, low), _around(np.maximum, high)
        if kept:
            have = np.where(np.arange(len(stray))[:, None] < kept, stray, np.inf)
            short = np.asarray((away > np.minimum(have[low], have[high])).any(axis=-1))
            np.maximum(stray[kept], self._left_over(points, away, short, borders[kept]), out=stray[kept])
        count = (highest - lowest + 1).reshape(-1)
        stop = np.repeat(np.arange(len(count)), count)
        section = np.arange(len(stop)) + np.repeat(lowest.reshape(-1) - (count.cumsum() - count), count)
        order = np.argsort(section, kind="stable")
        found, first = np.unique(section[order], return_index=True)
        needed = np.maximum.reduceat(away.reshape(len(count), -1)[stop[order]], first)
        stray[found] = np.maximum(stray[found], needed)

    def _left_over(self, points: Array, away: Array, short: Flags, splice_s: float) -> Array:
        """What the section that begins at the splice needs `(c,)` [m], to cover what kept ones are too `short` for."""
        at = int(np.searchsorted(self._taus, splice_s + _BORDER_S, side="right")) - 1
        some = _around(np.logical_or, short)
        farther = np.linalg.norm(points[some] - self._path[at], axis=-1).max(axis=-1)
        return np.asarray(np.maximum(farther, away[some]).max(axis=0, initial=0.0))

    def _stopping(self, some: slice) -> tuple[Array, Flags]:
        """Capsules during some of the stops, from start to rest `(k, t, c, 2, 3)` [m], and which stops can be."""
        speeds, first = self._speeds[some, None], self._q[self._starts[some], None]
        braking_s = np.abs(speeds) / self._deceleration
        at_s = np.linspace(0.0, 1.0, _STOP_SAMPLES + 1)[:, None] * braking_s.max(axis=-1, keepdims=True)
        at_s = np.minimum(at_s, braking_s)
        way = speeds * at_s - np.sign(speeds) * self._deceleration * at_s**2 / 2.0
        q = first + self._model.coupling.joints(way)
        try:
            return self._model.capsules(q), np.ones(len(q), dtype=np.bool_)
        except OpenMechanism:
            return self._possible(q, first)

    def _possible(self, q: Array, first: Array) -> tuple[Array, Flags]:
        """The same for stops some of which lead to where the mechanism cannot be; the robot is anywhere then."""
        points = np.repeat(self._model.capsules(first), q.shape[1], axis=1)
        possible = np.zeros(len(q), dtype=np.bool_)
        for at, stop in enumerate(q):
            with suppress(OpenMechanism):
                points[at] = self._model.capsules(stop)
                possible[at] = True
        return points, possible

    def _beside(self, some: slice, points: Array) -> tuple[Array, Array]:
        """The nearest place of the path `(k, t)`, in samples, and how far each capsule is off it `(k, t, c)` [m]."""
        begin = self._starts[some, None].astype(float)
        end = np.maximum(self._ends[some, None] - _BEFORE, begin)
        places = np.clip(self._first_guess(some), begin, end)
        for _ in range(_NEARINGS):
            at = np.minimum(places.astype(np.intp), len(self._steps) - 1)
            off = points - self._path[at]
            along = np.einsum("ktcex,ktcex->kt", off, self._steps[at]) / self._squares[at]
            places = np.clip(at + along, begin, end)
        at = np.minimum(places.astype(np.intp), len(self._steps) - 1)
        off = points - self._path[at] - (places - at)[..., None, None, None] * self._steps[at]
        return places, np.sqrt(np.einsum("ktcex,ktcex->ktce", off, off).max(axis=-1))

    def _first_guess(self, some: slice) -> Array:
        """Samples `(k, t)` at which the path has gone as far as the stops, were it to go on as fast."""
        starts, speeds = self._starts[some], np.abs(self._speeds[some])
        longest = (speeds / self._deceleration).max(axis=-1)
        share = np.linspace(0.0, 1.0, _STOP_SAMPLES + 1)
        taus = self._taus[starts][:, None] + longest[:, None] * (share - share**2 / 2.0)
        return np.asarray(np.interp(taus, self._taus, np.arange(len(self._taus))))

    def _sections_at(self, places: Array, borders: Array) -> tuple[Indices, Indices]:
        """First and last section of the steps of the path in which places lie."""
        inner = borders[1:-1]
        at = np.minimum(places.astype(np.intp), max(len(self._taus) - 2, 0))
        low = np.searchsorted(inner, self._taus + _BORDER_S, side="right")
        high = np.searchsorted(inner, self._taus[1:] - _BORDER_S, side="left") if len(self._taus) > 1 else low
        return low[at], np.maximum(low[at], high[at])


def _every(taus: Array, apart_s: float) -> Indices:
    """Samples no farther apart than this [s], where they are that dense; the first and the last one are among them."""
    times, found = taus.tolist(), [0]
    while found[-1] < len(times) - 1:
        found.append(max(bisect_right(times, times[found[-1]] + apart_s + _BORDER_S) - 1, found[-1] + 1))
    return np.array(found)


def _around(least: np.ufunc, values: NDArray[Any]) -> NDArray[Any]:
    """Of each value and its neighbours along the first two axes."""
    for axis in (0, 1):
        moved = np.moveaxis(values, axis, 0)
        result = moved.copy()
        least(result[1:], moved[:-1], out=result[1:])
        least(result[:-1], moved[1:], out=result[:-1])
        values = np.moveaxis(result, 0, axis)
    return values
