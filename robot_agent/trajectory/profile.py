"""Paths whose limits are the same all along: one profile of the distance is the fastest timing."""

import math
from dataclasses import replace

import numpy as np

from robot_agent.trajectory.joint_path import JointPath, Numbers
from robot_agent.trajectory.law import Timed
from robot_agent.trajectory.limits import Limits
from robot_agent.trajectory.pieces import Pieces
from robot_agent.trajectory.s_curve import SCurve, s_curve

_NO_ZONE_S = 1e-12
_STRAIGHT = 1e-9
_EVEN = 1e-6
"""Relative: a flange that turns this evenly along its way keeps one profile."""
_PIECE_S = 0.008
_SHORTEST_PIECE_S = 5e-4
_CLOSE = 1.0005
"""Where the joints exceed their limits by no more than this, a slower clock is better than another timing."""
_EXACT = 2e-7


def single(path: JointPath, limits: Limits) -> Timed | None:
    """The S-curve along `path` where no other timing is faster; None where the limits change along the path."""
    stretch = path.stretches[0]
    if limits.acceleration_down is not None:
        return None
    if any(replace(each, end=stretch.end, block=stretch.block) != stretch for each in path.stretches):
        return None
    if stretch.on_path:
        return _flange_move(path, limits)
    return None if stretch.capped or not _is_straight(path) else _joint_move(path, limits)


def _is_straight(path: JointPath) -> bool:
    tangents = path.pieces.shape(path.pieces.knots)[1, :, : path.joints]
    return bool(np.ptp(tangents, axis=0).max() < _STRAIGHT)


def _joint_move(path: JointPath, limits: Limits) -> Timed:
    """One S-curve in the parameter, its limits those of the joint that allows least."""
    start, tangent = path.state(0.0)[:2]
    moving = np.abs(tangent) > 1e-12
    reach = np.abs(tangent[moving])
    profile = s_curve(
        path.length,
        path.stretches[0].joint_speed * float(np.min(limits.velocity[moving] / reach)),
        float(np.min(limits.acceleration[moving] / reach)),
        float(np.min(limits.jerk[moving] / reach)),
    )
    used = profile.zones > _NO_ZONE_S
    coefficients = np.zeros((int(used.sum()), 6, path.joints))
    coefficients[:, :4] = (profile.states[used] / np.array([1.0, 1.0, 2.0, 6.0]))[..., None] * tangent
    coefficients[:, 0] += start
    pieces = Pieces(np.append(0.0, np.cumsum(profile.zones[used])), coefficients)
    return Timed(pieces, np.array([0.0, pieces.duration_s]), np.array([0.0, path.length]))


def _flange_move(path: JointPath, limits: Limits) -> Timed | None:
    """One S-curve in the flange's way, or in its turn on the spot, where the joints keep up with it."""
    ends = path.pieces.shape(path.pieces.knots)[:2, :, path.joints :]
    way, turn = ends[0, -1]
    along = 0 if way > 0.0 else 1
    rates = ends[1, :, 1] / ends[1, :, along]
    bend = float(path.curvature[:, 1].max())
    if along == 0 and (np.ptp(rates) * way > _EVEN or np.ptp(path.curvature[:, 1]) > _EVEN * max(1.0, bend)):
        return None
    profile = _profile(path, limits, float(way), float(turn) if along else float(rates.mean() * way), bend)
    timed = _along(path, profile, path.joints + along)
    if timed is None:
        return None
    allowed = np.stack([limits.velocity, limits.acceleration, limits.jerk])
    excess = (timed.pieces.peaks() / allowed).max(axis=1)
    k = float((np.maximum(excess, 1.0) ** (1.0 / np.arange(1.0, 4.0))).max())
    return Timed(timed.pieces.slower(1.0 / k), timed.times * k, timed.parameters) if k < _CLOSE else None


def _profile(path: JointPath, limits: Limits, way: float, turn: float, bend: float) -> SCurve:
    """In the flange's way [m], or in its turn [rad] where it has no way."""
    flange, stretch = limits.path, path.stretches[0]
    linear = [min(flange.speed_m_s, stretch.speed_m_s), flange.acceleration_m_s2, flange.jerk_m_s3]
    rotation = min(flange.angular_speed_rad_s, stretch.rotation_rad_s)
    angular = [rotation, flange.angular_acceleration_rad_s2, flange.angular_jerk_rad_s3]
    if way == 0.0:
        return s_curve(turn, *angular)
    bounds = [min(a, b * way / turn) if turn > 1e-12 else a for a, b in zip(linear, angular, strict=True)]
    if bend > 0.0:
        bounds[0] = min(bounds[0], math.sqrt(flange.acceleration_m_s2 / bend))
    return s_curve(way, *bounds)


def _along(path: JointPath, profile: SCurve, column: int) -> Timed | None:
    """The joints' curve over time through exact states, its knots on the steps of the jerk."""
    piece_s = _PIECE_S
    for _ in range(5):
        t = _knots(profile, piece_s)
        state, s = _states(path, profile, t, column)
        pieces = Pieces.through(t, *state)
        middle = (t[:-1] + t[1:]) / 2.0
        if np.abs(pieces.position(middle) - _states(path, profile, middle, column)[0][0]).max() <= _EXACT:
            return Timed(pieces, t, s)
        piece_s /= 2.0
    return None


def _states(path: JointPath, profile: SCurve, t: Numbers, column: int) -> tuple[Numbers, Numbers]:
    """Joints, velocity, acceleration `(3, k, n)` and parameter `(k,)` at times `t`."""
    distance, speed, acceleration, _ = profile.at(t)
    knots, way = path.pieces.knots, path.pieces.position(path.pieces.knots)[:, column]
    s = np.interp(distance, way, knots)
    for _ in range(4):  # the way is smooth and rising between nodes, so Newton finds its parameter from there
        here = path.pieces.shape(s)[:2, :, column]
        s = np.clip(s + (distance - here[0]) / here[1], 0.0, path.length)
    shape = path.pieces.shape(s)
    q, first, second = shape[:3, :, : path.joints]
    rate, bend = shape[1, :, column], shape[2, :, column]
    s_dot = speed / rate
    s_ddot = (acceleration - bend * s_dot**2) / rate
    velocity = first * s_dot[:, None]
    return np.stack([q, velocity, first * s_ddot[:, None] + second * (s_dot**2)[:, None]]), s


def _knots(profile: SCurve, piece_s: float) -> Numbers:
    """Times `(p + 1,)` at most `piece_s` apart, on the jerk steps of the profile unless that makes tiny pieces."""
    steps = profile.starts[1:-1]
    count = max(2, math.ceil(profile.duration_s / piece_s))
    even = np.linspace(0.0, profile.duration_s, count + 1)[1:-1]
    far = np.abs(even[:, None] - steps).min(axis=1) >= min(_SHORTEST_PIECE_S, piece_s / 4.0)
    kept, shortest = [0.0], min(_SHORTEST_PIECE_S, piece_s / 8.0)
    for knot in np.sort(np.concatenate([steps, even[far]])):
        if knot - kept[-1] >= shortest and profile.duration_s - knot >= shortest:
            kept.append(float(knot))
    return np.array([*kept, profile.duration_s])
