"""From joint paths to joints over time: as fast as all limits allow."""

import math

import numpy as np

from robot_agent.kinematics import Model
from robot_agent.trajectory.joints.joint_path import JointPath, share_on_path
from robot_agent.trajectory.limits import Limits
from robot_agent.trajectory.timing.affine import Numbers
from robot_agent.trajectory.timing.optimal.b_spline import softly
from robot_agent.trajectory.timing.optimal.division import divided
from robot_agent.trajectory.timing.optimal.initial_law import InitialLaw
from robot_agent.trajectory.timing.optimal.interior_point import Search
from robot_agent.trajectory.timing.optimal.reachability import fastest_speeds, times
from robot_agent.trajectory.timing.optimal.retiming import Limited, easing
from robot_agent.trajectory.timing.optimal.timing_law import Fitted, TimingLaw
from robot_agent.trajectory.timing.path_limits import PathLimits, Rows, TcpSpeeds
from robot_agent.trajectory.timing.slowdown import slower_by
from robot_agent.trajectory.timing.tcp_use import near_use
from robot_agent.trajectory.timing.timed import Timed

_GRID_STEP = 0.005
_FEWEST, _MOST = 160, 2400
_APART = 1e-7
"""Nothing of a path is looked at closer than this share of it."""
FINE = 4.0
"""Intervals per ramp of the acceleration."""
_FAR = 1.02
"""Jerk costs much where a motion takes more than so many times the time without it and the ramps at both ends."""
_LADDER = (1.4, 2.0, 3.0)
"""Intervals per ramp with which any motion is searched first, and such a motion again: the coarser, the farther a
search looks past what slows the motion down."""
_REFINEMENTS, _REFINED, _STEADY = 6, 8, 0.1
_FEWEST_INTERVALS, MOST_INTERVALS = 16, 1200
_BEGIN = 0.9
"""The squared rate that the search begins with."""
_AROUND = 3
_ATTEMPTS = 4
_ROUNDS = (FINE, *4 * (2.0 * FINE,))
"""Intervals per ramp of the acceleration with which a motion is sampled, and sampled anew."""
_SETTLED = (0.8, 1.05)
"""A motion that takes less or more times as long as the one it was sampled by is sampled anew: then it is known where
time passes, which is where something small on the way makes it slow."""
MARGIN = 1.001
"""Limits are divided by it, so that the search may stop when it is so near to them."""
_CERTAIN = 1.0005
"""Limits are tightened by so much more than they are exceeded; all of a motion may be slowed down by as much."""
_EASABLE = (1.02, 1.05)
"""A motion that would have to be slower as a whole by up to this factor is not searched again: it is slowed down around
the places that exceed a limit (`_eased`). The first factor counts after the first search, the other one later."""
_EASINGS = 11
_ROUGH = 2.0
"""A motion that would have to be slower by more than this factor has too long intervals: it gets shorter ones."""
_QUARTERS = 4.0
"""What a stretch allows counts for the joints' speed a quarter of a piece before and after it, too."""


def fastest(model: Model, path: JointPath, limits: Limits) -> Timed:
    """Joints over time along `path`, from rest to rest."""
    return fastest_of(model, [path], limits)[0]


def fastest_of(model: Model, paths: list[JointPath], limits: Limits) -> list[Timed]:
    """Joints over time along each of `paths`, all timed at once, from rest to rest."""
    if not paths:
        return []
    bounds = [PathLimits(path, limits) for path in paths]
    ramp = ramp_s(limits)
    laws = _coarsely(paths, bounds, ramp)
    made: dict[int, Timed] = {}
    waiting = list(range(len(paths)))
    for number_of_round, intervals in enumerate(_ROUNDS, 1):
        initials = [law.resampled(ramp / intervals, MOST_INTERVALS) for law in laws]
        fine = _limited(initials, [bounds[k] for k in waiting]).tightened(np.full((3, 1), MARGIN))
        last = number_of_round == len(_ROUNDS)
        kept = _kept(model, [bounds[k] for k in waiting], initials, Search(fine, begin(fine)), last=last)
        for number, (timed, _, _) in zip(waiting, kept, strict=True):
            if number not in made or timed.pieces.duration_s < made[number].pieces.duration_s:
                made[number] = timed
        again = [k for k, (_, _, settled) in enumerate(kept) if not settled]
        if not again:
            break
        waiting, laws = [waiting[k] for k in again], [kept[k][1] for k in again]
    return [made[number] for number in range(len(paths))]


def _coarsely(paths: list[JointPath], bounds: list[PathLimits], ramp: float) -> list[TimingLaw]:
    """Motions that nearly keep all limits.

    Paths on which jerk costs much are searched again, each time with what a coarser search found.
    """
    initials = [
        _first(*quickest(path, bound, ramp), ramp, _LADDER[0]) for path, bound in zip(paths, bounds, strict=True)
    ]
    laws = _searched(initials, bounds)
    far = [
        k
        for k, (law, initial) in enumerate(zip(laws, initials, strict=True))
        if law.compared_s - 2.0 * ramp > _FAR * initial.duration_s
    ]
    for intervals in _LADDER[1:] if far else ():
        initials = [laws[k].resampled(ramp / intervals, MOST_INTERVALS) for k in far]
        for k, law in zip(far, _searched(initials, [bounds[k] for k in far]), strict=True):
            laws[k] = law
    return laws


def _searched(initials: list[InitialLaw], bounds: list[PathLimits]) -> list[TimingLaw]:
    search = Search(limited := _limited(initials, bounds), begin(limited))
    search.run(gap=0.1, kept=0.5)
    return _laws(initials, search.c)


def _kept(
    model: Model, bounds: list[PathLimits], initials: list[InitialLaw], search: Search, *, last: bool
) -> list[tuple[Timed, TimingLaw, bool]]:
    """Joints over time that keep their limits everywhere; paths where they do not yet are searched again.

    Beside them the law, which may be faster: its intervals are too long for what the limits do inside them; and whether
    it is settled. Where intervals are too long by far, it is only slowed down there, so that the next round, unless
    this is the `last`, has shorter ones there.
    """
    made: dict[int, tuple[Timed, TimingLaw, Numbers]] = {}
    rough: dict[int, tuple[Timed, TimingLaw, bool]] = {}
    waiting = list(range(len(bounds)))
    for attempt in range(_ATTEMPTS):
        search.run(gap=0.003, kept=MARGIN - 1.0)
        excess, late = [], []
        for number, law in zip(waiting, _laws([initials[k] for k in waiting], search.c), strict=True):
            each, k, used = _slowed(model, bounds[number], law)
            excess.append(used)
            if k > _ROUGH and attempt == 0 and not last:
                most = _ROUGH ** np.arange(1.0, 4.0)[:, None]
                rough[number] = each, TimingLaw(law.initial, law.squared * easing(np.minimum(used, most))), False
            if number not in made or each.pieces.duration_s < made[number][0].pieces.duration_s:
                made[number] = each, law, used
            late.append(k > _EASABLE[attempt > 0] and number not in rough)
        if not any(late):
            break
        search.keep_only(np.array(late))
        search.tighten(_tighter([used for used, again in zip(excess, late, strict=True) if again]))
        waiting = [number for number, again in zip(waiting, late, strict=True) if again]
    found = []
    for number, bound in enumerate(bounds):
        if number in rough:
            found.append(rough[number])
            continue
        timed, law = _eased(model, bound, *made[number]), made[number][1]
        slower = timed.pieces.duration_s / law.duration_s * law.compared_s / law.initial.duration_s
        found.append((timed, law, _SETTLED[0] < slower < _SETTLED[1]))
    return found


def _eased(model: Model, bounds: PathLimits, best: Timed, law: TimingLaw, used: Numbers) -> Timed:
    """The quicker of `best` and of what `law` becomes where its rate is lowered around each limit that it exceeds.

    That is cheaper than a search, and far better than to slow down all of a motion for a few places. `best` is `law`
    slowed down, `used` `(3, intervals)` what the law uses of its limits.
    """
    if best.pieces.duration_s <= _CERTAIN * law.duration_s:
        return best
    for _ in range(_EASINGS):
        law = TimingLaw(law.initial, law.squared * easing(used))
        each, k, used = _slowed(model, bounds, law)
        if each.pieces.duration_s < best.pieces.duration_s:
            best = each
        if k <= _CERTAIN:
            break
    return best


def _slowed(model: Model, bounds: PathLimits, law: TimingLaw) -> tuple[Timed, float, Numbers]:
    """`law` so much slower as a whole that it keeps its limits; by how much, and what it used `(3, intervals)`."""
    fitted = law.timed(bounds.path)
    timed = fitted.timed
    used = limit_use(model, bounds, fitted, law.initial)
    k = slower_by(used)
    slower = max(1.0, k)
    return Timed(timed.pieces.slower(1.0 / slower), timed.times * slower, timed.parameters), k, used


def quickest(path: JointPath, bounds: PathLimits, ramp: float, first: float = 0.0) -> tuple[Numbers, Numbers, Rows]:
    """Parameters `(k,)`, squared rates of the fastest motion under limits of speed and acceleration, nearly; limits.

    The squared rate begins with `first`. Of a long motion the parameters are closer where it takes its time and
    accelerates: there a slow move begins or ends.
    """
    grid = grid_along(path)
    for _ in range(_REFINEMENTS):
        rows = bounds.rows(grid)
        squared = fastest_speeds(grid, rows, first)
        when = times(grid, squared)
        last = np.diff(when) > ramp / FINE
        last &= np.abs(np.diff(squared)) > _STEADY * np.maximum(squared[1:], squared[:-1])
        if not is_long(when, ramp) or not last.any():
            break
        share = np.arange(1.0, _REFINED) / _REFINED
        grid = np.sort(np.append(grid, (grid[:-1][last, None] + np.diff(grid)[last, None] * share).ravel()))
    return grid, squared, rows


def _first(grid: Numbers, squared: Numbers, rows: Rows, ramp: float, intervals: float) -> InitialLaw:
    """The same over time, smoothed, with so many intervals per ramp."""
    s, h, rates = sampled_rise(grid, squared, rows, ramp, intervals)
    return InitialLaw.rising(softly(s), h, np.pad(rates, 1, mode="edge"))


def ramp_s(limits: Limits) -> float:
    """The time [s] in which the joints' acceleration builds up, of the joint that is quickest at that."""
    return float((np.abs(limits.acceleration_bounds) / limits.jerk).min())


def grid_along(path: JointPath) -> Numbers:
    """Parameters `(k,)` of the path at which speed and acceleration are looked at first.

    They are evenly apart, and closer where the path has nodes that are: nothing small is passed over.
    """
    even = np.linspace(0.0, path.length, int(np.clip(math.ceil(path.length / _GRID_STEP), _FEWEST, _MOST)) + 1)
    nodes = path.pieces.knots
    between = (nodes[:-1] + nodes[1:]) / 2.0
    close = between[np.diff(nodes) < even[1]]
    grid = np.sort(np.concatenate([even, close]))
    return np.asarray(grid[np.append(True, np.diff(grid) > _APART * path.length)])


def sampled_rise(
    grid: Numbers, squared: Numbers, rows: Rows, ramp: float, intervals: float
) -> tuple[Numbers, float, Numbers]:
    """Parameters `(k + 1,)` at the borders of intervals, the shortest one [s], and its share of each `(k,)`.

    `squared` is the squared rate on the grid, `rows` are the limits there. There are about so many intervals in each
    ramp, and as many elsewhere unless these would be too many.
    """
    when = times(grid, squared)
    h = ramp / intervals
    count = int(np.clip(math.ceil(when[-1] / h), _FEWEST_INTERVALS, MOST_INTERVALS))
    t = np.arange(count + 1) * (float(when[-1]) / count)
    if is_long(when, ramp):
        t = divided(grid, squared, when, rows, h, ramp)
        if len(t) > MOST_INTERVALS + 1:
            t = np.interp(np.linspace(0.0, len(t) - 1.0, MOST_INTERVALS + 1), np.arange(len(t)), t)
    k = np.clip(np.searchsorted(when, t, side="right") - 1, 0, len(grid) - 2)
    after = np.minimum(t, when[-1]) - when[k]
    acceleration = np.diff(squared)[k] / (2.0 * np.diff(grid)[k])
    s = np.minimum(grid[k] + after * (np.sqrt(squared[k]) + after * acceleration / 2.0), grid[-1])
    return s, float(t[1]), t[1] / np.diff(t)


def is_long(when: Numbers, ramp: float) -> bool:
    """Whether intervals as long as those that a ramp takes would be too many from time to time `when` `(k,)` [s]."""
    return bool(when[-1] > MOST_INTERVALS * ramp / FINE)


def _limited(initials: list[InitialLaw], bounds: list[PathLimits]) -> Limited:
    parts = [Limited.of(initial, bound) for initial, bound in zip(initials, bounds, strict=True)]
    return parts[0] if len(parts) == 1 else Limited.joined(parts)


def begin(limited: Limited) -> Numbers:
    """Coefficients of a squared rate that is slow where limits would be exceeded, and not much above them."""
    c = np.ones(len(limited.h) + 2)
    speed, acceleration, jerk = limited.excess(c)
    most = np.maximum(np.maximum(speed**2, acceleration), np.maximum(jerk ** (2.0 / 3.0), 1.0))
    low = np.pad(-np.log(most), _AROUND + 1, mode="edge")
    low = np.lib.stride_tricks.sliding_window_view(low, 2 * _AROUND + 1).min(axis=1)
    low = np.convolve(np.pad(low, _AROUND, mode="edge"), np.ones(2 * _AROUND + 1) / (2 * _AROUND + 1), mode="valid")
    return np.asarray(_BEGIN * np.exp(low))


def _laws(initials: list[InitialLaw], rate: Numbers) -> list[TimingLaw]:
    ends = np.cumsum([initial.intervals + 2 for initial in initials])
    return [TimingLaw(initial, part) for initial, part in zip(initials, np.split(rate, ends[:-1]), strict=True)]


def limit_use(model: Model, bounds: PathLimits, fitted: Fitted, initial: InitialLaw) -> Numbers:
    """The most that joints and TCP use of their limits of speed, acceleration and jerk in each interval `(3, k)`."""
    pieces, at, limits = fitted.timed.pieces, fitted.timed.parameters, bounds.limits
    c2, c3 = np.ascontiguousarray(pieces.coefficients[:, 2:4].transpose(1, 2, 0))  # cubics
    lower, upper = (each[:, None] for each in limits.acceleration_bounds)
    begin = 2.0 * c2
    end = begin + 6.0 * np.diff(pieces.knots) * c3
    used = np.zeros((3, len(pieces.coefficients)))
    used[0] = _joint_speed_use(bounds, fitted.timed)
    used[1] = np.maximum(np.maximum(begin, end) / upper, np.minimum(begin, end) / lower).max(axis=0)
    used[2] = (np.abs(c3) * (6.0 / limits.jerk)[:, None]).max(axis=0)
    speeds = TcpSpeeds.of(bounds, fitted.timed)
    held = share_on_path(bounds.path.stretches, at[:-1], at[1:]) > 0.0
    used = np.maximum(used, near_use(model, pieces, held, limits.path, speeds))
    most = np.zeros((3, initial.intervals))
    for each, of_pieces in zip(most, used, strict=True):
        np.maximum.at(each, fitted.interval, of_pieces)
    return most


def _joint_speed_use(bounds: PathLimits, timed: Timed) -> Numbers:
    """The most `(pieces,)` that the joints use of their speeds, each by itself and all together, in cubic pieces."""
    c1, c2, c3 = np.ascontiguousarray(timed.pieces.coefficients[:, 1:4].transpose(1, 2, 0))
    h, s = np.diff(timed.pieces.knots), timed.parameters
    begin, half_way, around = s[:-1], (s[:-1] + s[1:]) / 2.0, np.diff(s) / _QUARTERS
    used = np.zeros(len(h))
    for rates, first, last in (
        (c1, begin - np.append(0.0, around[:-1]), begin + around),
        (c1 + h * (c2 + 0.75 * h * c3), half_way - around, half_way + around),
    ):
        allowed = bounds.speeds(first, last).T
        each = (np.abs(rates) / allowed[:-3]).max(axis=0)
        together = np.sqrt((rates[bounds.limits.turning] ** 2).sum(axis=0)) / allowed[-1]
        used = np.max([used, each, together], axis=0)
    return used


def _tighter(excess: list[Numbers]) -> Numbers:
    """By what to divide the limits of all paths, as `Limited.joined` has them: where they are exceeded, and beside."""
    parts = [each for part in excess for each in (part, np.ones((3, 2)))]
    whole = np.pad(np.concatenate(parts[:-1], axis=1), ((0, 0), (1, 1)))
    around = np.lib.stride_tricks.sliding_window_view(whole, 3, axis=1).max(axis=2)
    return np.where(around > 1.0, around * _CERTAIN, 1.0)
