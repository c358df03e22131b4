"""Paths that are timed by one profile, over all of their length."""

import math

import numpy as np

from robot_agent.kinematics import Model
from robot_agent.model.description import ProfileKind
from robot_agent.paths import Passing
from robot_agent.trajectory.joints.joint_path import JointPath, Numbers, share_on_path
from robot_agent.trajectory.joints.pieces import Pieces
from robot_agent.trajectory.limits import Limits
from robot_agent.trajectory.timing.path_limits import PathLimits, TcpSpeeds
from robot_agent.trajectory.timing.profile import Profile, even_times, shaped_profile
from robot_agent.trajectory.timing.s_curve import SCurve
from robot_agent.trajectory.timing.slowdown import joints_slower_by, slower_by
from robot_agent.trajectory.timing.tcp_use import speed_use, tcp_use
from robot_agent.trajectory.timing.timed import Timed

_NO_ZONE_S = 1e-12
_STRAIGHT = 1e-9
_EVEN = 1e-6
"""Relative: a TCP that turns this evenly along its way keeps one profile."""
_PIECE_S = 0.008
_SHORTEST_PIECE_S = 5e-4
_CLOSE = 1.0005
"""Where the joints exceed their limits by no more than this, a slower clock is better than another timing."""
_EXACT = 2e-7
"""Largest distance [rad or m] of the joints over time from the joints along the path."""
_ROUNDING = 1.0002
"""What differences of the TCP's twist make of a profile that just keeps its limits."""
_EVENLY = 1e-4
"""The same, as a share of the way that the quickest joint goes in the time of a piece at its highest speed."""
_WORTH_HALVING = 3e-9
"""Half a piece has a 64th of its distance: so what was close enough is not much worse than what was halved."""
_ROUNDS = 7
_GRID_STEP = 0.005
_FEWEST, _MOST = 160, 2400
_LOOKED_AT = 301
"""Times in each zone of a profile at which the limits are looked at."""
_GLANCED_AT, _FAR = 9, 1.001
"""The same before a profile is worked out that may not keep them; by how much it then exceeds them for certain."""
_PASSED = 1001
_SHARES_OF_SPEED = 0.8 ** np.arange(12)


def has_vias(path: JointPath) -> bool:
    """Whether the path is blended at points on its way."""
    return any(each.passing is Passing.BLENDED and each.deviation_m > 0.0 for each in path.transitions)


def single(model: Model, path: JointPath, limits: Limits) -> Timed | None:
    """One profile along `path` where its own limits are the only ones; None where the limits change along the path."""
    stretch = path.stretches[0]
    if any(each.caps != stretch.caps for each in path.stretches):
        return None
    if stretch.on_path:
        return _tcp_move(model, path, limits)
    return None if stretch.capped or not _is_straight(path) else _joint_move(path, limits)


def _is_straight(path: JointPath) -> bool:
    tangents = path.pieces.shape(path.pieces.knots)[1, :, : path.joints]
    return bool(np.ptp(tangents, axis=0).max() < _STRAIGHT)


def _joint_move(path: JointPath, limits: Limits) -> Timed:
    """One profile in the parameter, its limits those of the joint that allows least."""
    start, tangent = path.state(0.0)[:2]
    moving = np.abs(tangent) > 1e-12
    reach, slopes = np.abs(tangent[moving]), limits.acceleration_bounds[:, moving] / tangent[moving]
    turning = float(np.linalg.norm(tangent[limits.turning]))
    cap = path.stretches[0].joint_rad_s / max(turning, 1e-300)
    chosen = shaped_profile(
        limits.shaping,
        path.length,
        min(cap, path.stretches[0].joint_speed * float(np.min(limits.velocity[moving] / reach))),
        (float(slopes.min(axis=0).max()), float(slopes.max(axis=0).min())),
        float(np.min(limits.jerk[moving] / reach)),
    )
    if not isinstance(chosen, SCurve):
        return _along(path, chosen, None)
    used = chosen.zones > _NO_ZONE_S
    coefficients = np.zeros((int(used.sum()), 6, path.joints))
    coefficients[:, :4] = (chosen.states[used] / np.array([1.0, 1.0, 2.0, 6.0]))[..., None] * tangent
    coefficients[:, 0] += start
    pieces = Pieces(np.append(0.0, np.cumsum(chosen.zones[used])), coefficients)
    return Timed(pieces, np.array([0.0, pieces.duration_s]), np.array([0.0, path.length]))


def _tcp_move(model: Model, path: JointPath, limits: Limits) -> Timed | None:
    """One profile in the TCP's way, or in its turn on the spot, where the joints keep up with it."""
    ends = path.pieces.shape(path.pieces.knots)[:2, :, path.joints :]
    way, turn = ends[0, -1]
    along = 0 if way > 0.0 else 1
    if (ends[1, :, along] <= 0.0).any():  # it goes and turns on the spot by turns
        return None
    rates = ends[1, :, 1] / ends[1, :, along]
    bend = float(path.curvature[:, 1].max())
    if along == 0 and (np.ptp(rates) * way > _EVEN or np.ptp(path.curvature[:, 1]) > _EVEN * max(1.0, bend)):
        return None
    chosen = _tcp_profile(path, limits, float(way), float(turn) if along else float(rates.mean() * way), bend)
    bounds = PathLimits(path, limits)
    if _clock(path, bounds, chosen, path.joints + along, _GLANCED_AT) > _FAR:
        return None
    timed = _along(path, chosen, path.joints + along)
    turning = timed.pieces.derivatives(timed.times)[0][:, limits.turning]
    capped = float(np.linalg.norm(turning, axis=1).max()) / path.stretches[0].joint_rad_s
    k = max(1.0, joints_slower_by(timed.pieces, limits), capped, _tcp_slower_by(model, bounds, timed))
    return Timed(timed.pieces.slower(1.0 / k), timed.times * k, timed.parameters) if k < _CLOSE else None


def _tcp_slower_by(model: Model, bounds: PathLimits, timed: Timed) -> float:
    """The factor on the clock for what the TCP uses of its limits of speed, acceleration and jerk, 1 at least."""
    held = share_on_path(bounds.path.stretches, timed.parameters[:-1], timed.parameters[1:]) > 0.0
    used, speeds = tcp_use(model, timed.pieces, held, bounds.limits.path), TcpSpeeds.of(bounds, timed)
    k = max(slower_by(used), float(speed_use(model, timed.pieces, speeds.hold, speeds).max()))
    return k if k > _ROUNDING else 1.0


def _tcp_profile(path: JointPath, limits: Limits, way: float, turn: float, bend: float) -> Profile:
    """In the TCP's way [m], or in its turn [rad] where it has no way."""
    tcp, stretch = limits.path, path.stretches[0]
    linear = [min(tcp.speed_m_s, stretch.speed_m_s), tcp.acceleration_m_s2, tcp.jerk_m_s3]
    rotation = min(tcp.angular_speed_rad_s, stretch.rotation_rad_s)
    angular = [rotation, tcp.angular_acceleration_rad_s2, tcp.angular_jerk_rad_s3]
    if way == 0.0:
        return shaped_profile(limits.shaping, turn, *angular)
    bounds = [min(a, b * way / turn) if turn > 1e-12 else a for a, b in zip(linear, angular, strict=True)]
    if bend > 0.0:
        bounds[0] = min(bounds[0], math.sqrt(tcp.acceleration_m_s2 / bend))
    return shaped_profile(limits.shaping, way, *bounds)


def slowed(model: Model, path: JointPath, limits: Limits) -> Timed:
    """The profile of `limits.shaping` over the whole path, as fast as the place that allows least lets it be.

    A lower top speed with the same ramps may leave more for the bends of the path than a slower clock, so several are
    tried.
    """
    column = path.joints if all(each.on_path for each in path.stretches) and _has_way(path) else None
    bounds = PathLimits(path, limits)
    grid = np.linspace(0.0, path.length, int(np.clip(math.ceil(path.length / _GRID_STEP), _FEWEST, _MOST)) + 1)
    rows = bounds.rows(grid)
    rate = np.ones_like(grid) if column is None else path.pieces.shape(grid)[1, :, column]
    way = path.length if column is None else float(path.pieces.position(np.array(path.length))[column])
    top = float((np.sqrt(rows.fastest) * rate).min())
    share = np.abs(rows.affine.a) / np.minimum(rows.affine.above, rows.affine.below)
    ramp = [float((rate / each.max(axis=1)).min()) for each in (share, np.abs(rows.first_jerk))]
    tried = [shaped_profile(limits.shaping, way, top * share, *ramp) for share in _SHARES_OF_SPEED]
    # a trapezoid's acceleration has no jerk of its own: faster than asked for it would exceed the filter's
    least = 1.0 if limits.shaping.profile is ProfileKind.TRAPEZOIDAL else 0.0
    clocks = [max(least, _clock(path, bounds, each, column, _LOOKED_AT)) for each in tried]
    chosen, k = min(zip(tried, clocks, strict=True), key=lambda each: each[0].duration_s * each[1])
    timed = _along(path, chosen, column)
    timed = Timed(timed.pieces.slower(1.0 / k), timed.times * k, timed.parameters)
    k = max(1.0, joints_slower_by(timed.pieces, limits), _tcp_slower_by(model, bounds, timed))
    return Timed(timed.pieces.slower(1.0 / k), timed.times * k, timed.parameters)


def _clock(path: JointPath, bounds: PathLimits, chosen: Profile, column: int | None, places: int) -> float:
    """How many times longer the profile must last so that just one limit is reached, looked at in places per zone."""
    ends = np.nextafter(chosen.starts[1:], 0.0)
    t = np.linspace(chosen.starts[:-1], ends, places).ravel()
    s, speed, acceleration, jerk = _parameter(path, chosen.at(t), column)
    rows = bounds.rows(s)
    v, a, j = (each[:, None] for each in (speed, acceleration, jerk))
    by_speed = float((speed / np.sqrt(rows.fastest)).max())
    used = rows.affine.a * a + rows.affine.b * v**2
    by_acceleration = float(np.maximum(used / rows.affine.above, -used / rows.affine.below).max())
    by_jerk = float(np.abs(rows.first_jerk * j + 3.0 * rows.second_jerk * v * a + rows.third_jerk * v**3).max())
    return max(by_speed, math.sqrt(by_acceleration), math.cbrt(by_jerk))


def _has_way(path: JointPath) -> bool:
    return bool(path.pieces.position(np.array(path.length))[path.joints] > 0.0)


def _along(path: JointPath, chosen: Profile, column: int | None) -> Timed:
    """The joints' curve over time through exact states, its knots on the steps of the profile.

    `column` of the path's pieces is the way that the profile counts; None: the parameter.
    """
    t = _knots(chosen, _passing(path, chosen, path.pieces.knots[1:-1], column))
    for _ in range(_ROUNDS):
        before, after = chosen.at(t), chosen.at(t)
        before[2] = chosen.at(np.nextafter(t, -np.inf))[2]  # the acceleration of a trapezoid steps
        (first, s), (last, _) = _states(path, after, column), _states(path, before, column)
        pieces = Pieces.between(t, first[:, :-1], last[:, 1:])
        middle = (t[:-1] + t[1:]) / 2.0
        there = _states(path, chosen.at(middle), column)[0][0]
        away = np.abs(pieces.position(middle) - there).max(axis=1)
        ways = np.abs(np.diff(first[0], axis=0)).max(axis=1)
        exact = np.minimum(_EXACT, _EVENLY * np.diff(t) * (ways / np.diff(t)).max())
        if (away <= exact).all():
            break
        t = np.sort(np.append(t, middle[away > np.minimum(exact, _WORTH_HALVING)]))
    return Timed(pieces, pieces.knots, s)


def _states(path: JointPath, way: Numbers, column: int | None) -> tuple[Numbers, Numbers]:
    """Joints, velocity, acceleration `(3, k, n)` and parameter `(k,)` where the profile gives `way` `(4, k)`."""
    s, speed, acceleration, _ = _parameter(path, way, column)
    q, first, second = path.pieces.shape(s)[:3, :, : path.joints]
    velocity = first * speed[:, None]
    return np.stack([q, velocity, first * acceleration[:, None] + second * (speed**2)[:, None]]), s


def _parameter(path: JointPath, way: Numbers, column: int | None) -> Numbers:
    """The path's parameter and its three derivatives by time `(4, k)` from those of the way."""
    if column is None:
        return way
    distance, speed, acceleration, jerk = way
    knots, ways = path.pieces.knots, path.pieces.position(path.pieces.knots)[:, column]
    s = np.interp(distance, ways, knots)
    for _ in range(4):  # the way is smooth and rising between nodes, so Newton finds its parameter from there
        here = path.pieces.shape(s)[:2, :, column]
        s = np.clip(s + (distance - here[0]) / here[1], 0.0, path.length)
    _, rate, bend, change = path.pieces.shape(s)[:, :, column]
    s_dot = speed / rate
    s_ddot = (acceleration - bend * s_dot**2) / rate
    return np.stack([s, s_dot, s_ddot, (jerk - 3.0 * bend * s_dot * s_ddot - change * s_dot**3) / rate])


def _passing(path: JointPath, chosen: Profile, at: Numbers, column: int | None) -> Numbers:
    """Times `(k,)` at which the parameters `at` `(k,)`, rising, are passed."""
    t = np.linspace(0.0, chosen.duration_s, _PASSED)
    times = np.interp(at, np.maximum.accumulate(_parameter(path, chosen.at(t), column)[0]), t)
    for _ in range(3):
        s, speed = _parameter(path, chosen.at(times), column)[:2]
        step = np.clip((at - s) / np.maximum(speed, 1e-9), -t[1], t[1])
        times = np.clip(times + step, 0.0, chosen.duration_s)
    return times


def _knots(chosen: Profile, jumps: Numbers) -> Numbers:
    """Times `(p + 1,)`, `even_times` and on the steps of the profile and on `jumps` unless that makes tiny pieces."""
    duration_s, steps = chosen.duration_s, np.append(chosen.starts[1:-1], jumps)
    even = even_times(chosen.starts, _PIECE_S)[1:-1]
    around = np.concatenate([[-np.inf], np.sort(steps), [np.inf]])
    after = np.searchsorted(around, even)
    far = np.minimum(even - around[after - 1], around[after] - even) >= _SHORTEST_PIECE_S
    kept = [0.0]
    for knot in np.sort(np.concatenate([steps, even[far]])):
        if min(knot - kept[-1], duration_s - knot) >= _SHORTEST_PIECE_S:
            kept.append(float(knot))
    return np.array([*kept, duration_s])
