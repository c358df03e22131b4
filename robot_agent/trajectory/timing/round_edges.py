"""Which round edges seem to take longer than a stop in the corner: there nothing is won by rounding it.

A corner that is cut by a millimetre bends so tightly that a robot with a limit of jerk has to creep around it, and to
have left off braking before. A stop brakes up to the last moment.
"""

from collections.abc import Sequence

import numpy as np

from robot_agent.kinematics import Model
from robot_agent.paths import Passing, Transition
from robot_agent.trajectory.joints.joint_path import JointPath, Numbers
from robot_agent.trajectory.limits import Limits
from robot_agent.trajectory.timing.independent import Independent
from robot_agent.trajectory.timing.path_limits import PathLimits
from robot_agent.trajectory.timing.s_curve import s_curve
from robot_agent.trajectory.timing.timed import Timed

_PLACES = (np.arange(5) + 0.5) / 5
_NEAR, _FAR = 0.2, 2.0
"""The limits to brake and to start with are looked at between so many times the way from a corner to the end of what
its edge slows down: nearer to the corner the edge bends."""
_QUARTIC = 0.375
"""A round edge between lines passes the corner at so many times its cut, times the sine of half the turn."""
_STANDS = 1e-9


def slower_edges(model: Model, path: JointPath, timed: Timed, limits: Limits) -> list[tuple[Transition, float]]:
    """The round edges of `path`, as it is timed, that seem to take longer than a stop in the corner, by some [s].

    The time in an edge, and in as much beside it as its slowness spreads to, is compared with what one profile takes
    longer up to the corner and on from it than up to there and on; only the path with stops, timed, says it exactly.
    """
    rounded = {each.before: each for each in path.transitions if each.passing is Passing.ROUNDED}
    corners = [(each.end, rounded[each.move]) for each in path.stretches[:-1] if each.move in rounded]
    if not corners:
        return []
    half, farther = _halves(model, path, corners)
    middle = np.array([end for end, _ in corners])
    at = np.stack([np.append(0.0, middle + half), np.append(middle - half, path.length)])
    when = np.interp(at, timed.parameters, timed.times)
    around = float((np.abs(limits.acceleration_bounds) / limits.jerk).min()) / 2.0
    passed = np.interp(middle, timed.parameters, timed.times)
    when[0, 1:], when[1, :-1] = np.maximum(when[0, 1:], passed + around), np.minimum(when[1, :-1], passed - around)
    when = np.clip(when, 0.0, timed.times[-1])
    at = np.interp(when, timed.times, timed.parameters)
    speeds = np.linalg.norm(timed.pieces.derivatives(when)[0] / limits.velocity, axis=2)
    bounds, lengths = PathLimits(path, limits), np.maximum(at[1] - at[0], _STANDS)
    before, after = middle - at[1, :-1], at[0, 1:] - middle
    braking = _allowed(bounds, middle - np.minimum(_FAR * before, before + lengths[:-1]), middle - _NEAR * before)
    starting = _allowed(bounds, middle + _NEAR * after, middle + np.minimum(_FAR * after, after + lengths[1:]))
    found = []
    for k, (_, corner) in enumerate(corners):
        rounding_s = float(when[0, k + 1] - when[1, k])
        braking_s = _more_s(lengths[k], braking[k], speeds[0, k], speeds[1, k], before[k] + farther[k])
        starting_s = _more_s(lengths[k + 1], starting[k], speeds[1, k + 1], speeds[0, k + 1], after[k] + farther[k])
        won_s = rounding_s - braking_s - starting_s
        if won_s > 0.0:
            found.append((corner, won_s))
    return found


def _halves(model: Model, path: JointPath, corners: list[tuple[float, Transition]]) -> tuple[Numbers, Numbers]:
    """By the parameter `(k,)`: half of each edge, and how much farther it is to the corner."""
    states = path.pieces.shape(np.array([end for end, _ in corners]))[:2, :, : path.joints]
    twist = (model.jacobian(states[0]) @ states[1][..., None])[..., 0]
    cut, away = (np.array([getattr(each, name) for _, each in corners]) for name in ("cut_m", "deviation_m"))
    cosine = np.sqrt(1.0 - np.minimum(away / (_QUARTIC * cut), 1.0) ** 2)
    half_m = cut * (1.0 + cosine) / 2.0
    rate = np.maximum(np.linalg.norm(twist[:, :3], axis=1), _STANDS)
    return half_m / rate, (cut - half_m) / rate


def _more_s(length: float, limits: Numbers, far: float, near: float, more: float) -> float:
    """How much longer it takes from a rate of the parameter at one end of a leg to rest `more` behind the other end.

    Compared with passing the other end at rate `near`. `limits` `(3,)` are those of the rate and of its derivatives.
    """
    speed, acceleration, jerk = limits.tolist()
    profile = max(speed, far, near), acceleration, jerk
    stopping = s_curve(length + more, *profile, start_speed=far).duration_s
    passing = s_curve(length, *profile, start_speed=far, end_speed=near).duration_s
    # what is too short for such a change of speed is passed at the slower one at least
    slower = min(far, near)
    return stopping - (min(passing, length / slower) if slower > 0.0 else passing)


def _allowed(bounds: PathLimits, first: Numbers, last: Numbers) -> Numbers:
    """What the parameter's rate and its derivatives may be `(k, 3)` between parameters `first` and `last` `(k,)`."""
    rows = bounds.rows((first[:, None] + (last - first)[:, None] * _PLACES).ravel())
    affine = rows.affine
    slopes = (np.abs(affine.a) / np.minimum(affine.above, affine.below)).max(axis=1)
    each = np.stack([1.0 / np.sqrt(rows.fastest), slopes, np.abs(rows.first_jerk).max(axis=1)], axis=-1)
    return np.asarray(1.0 / np.median(each.reshape(len(first), -1, 3), axis=1))


def halfway_s(paths: Sequence[JointPath | Independent], timed: Sequence[Timed]) -> dict[int, float]:
    """When each move is half done [s], from the beginning of the first of `paths` on."""
    halfway, begins = {}, 0.0
    for path, each in zip(paths, timed, strict=True):
        done = 0.0
        for stretch in path.stretches:
            middle = np.interp((done + stretch.end) / 2.0, each.parameters, each.times)
            halfway[stretch.move], done = begins + float(middle), stretch.end
        begins += each.pieces.duration_s
    return halfway
