"""Which round edges may take longer than a stop in the corner: there nothing is won by rounding it.

A corner that is cut by a millimetre bends so tightly that a robot with a limit of jerk has to creep around it, and to
have left off braking before. A stop brakes up to the last moment.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from robot_agent.paths import Passing, Transition
from robot_agent.trajectory.joints.joint_path import JointPath, Numbers
from robot_agent.trajectory.limits import Limits
from robot_agent.trajectory.timing.independent import Independent
from robot_agent.trajectory.timing.path_limits import PathLimits
from robot_agent.trajectory.timing.s_curve import s_curve
from robot_agent.trajectory.timing.timed import Timed

_PLACES = (np.arange(17) + 0.5) / 17
"""Of the way from one corner to the next, at which the limits are looked at."""

_LEAST_S, _LEAST_SHARE = 2e-3, 2e-3
"""By so much a stop has to be quicker, or it is no reason to give up a smooth motion."""


def gains(rounded_s: float, stopping_s: float) -> bool:
    """Whether a stop is worth while that takes so long, in place of a round edge that takes so long."""
    return stopping_s + _LEAST_S + _LEAST_SHARE * stopping_s < rounded_s


def perhaps_slower(path: JointPath, timed: Timed, limits: Limits) -> list[Transition]:
    """The round edges of `path`, as it is timed, that may take longer than a stop in the corner.

    They are compared with one profile from corner to corner and the limits midway; only the timing of the path with
    stops says it exactly.
    """
    rounded = {each.before: each for each in path.transitions if each.passing is Passing.ROUNDED}
    corners = [(each, rounded[each.block]) for each in path.stretches[:-1] if each.block in rounded]
    if not corners:
        return []
    at = np.array([0.0, *(each.end for each, _ in corners), path.length])
    when = np.interp(at, timed.parameters, timed.times)
    velocity = timed.pieces.derivatives(when)[0]
    speeds = np.linalg.norm(velocity / limits.velocity, axis=1)
    legs = _legs(PathLimits(path, limits), at)
    found = []
    for number, (stretch, corner) in enumerate(corners):
        stopping = legs[number].to_rest_s(speeds[number]) + legs[number + 1].to_rest_s(speeds[number + 2])
        stopping += corner.deviation_m / min(stretch.speed_m_s, limits.path.speed_m_s)  # it is farther to the corner
        if gains(float(when[number + 2] - when[number]), stopping):
            found.append(corner)
    return found


@dataclass(frozen=True, slots=True)
class _Leg:
    """From one corner to the next: its length by the parameter, and what the parameter's rate may be there."""

    length: float
    speed: float
    acceleration: float
    jerk: float
    at_speed_s: float
    """At the fastest rate of each place."""

    def to_rest_s(self, speed: float) -> float:
        """How long it takes from a rate of the parameter to rest, or from rest to that rate."""
        top = max(self.speed, speed)
        ramped_s = s_curve(self.length, top, self.acceleration, self.jerk, start_speed=speed).duration_s
        return max(ramped_s, ramped_s + self.at_speed_s - self.length / top)


def _legs(bounds: PathLimits, at: Numbers) -> list[_Leg]:
    """Between parameters `at` `(k,)`, with the limits midway."""
    lengths = np.diff(at)
    rows = bounds.rows((at[:-1, None] + lengths[:, None] * _PLACES).ravel())
    affine = rows.affine
    slopes = (np.abs(affine.a) / np.minimum(affine.above, affine.below)).max(axis=1)
    slowness = 1.0 / np.sqrt(rows.fastest)
    each = (values.reshape(len(lengths), -1) for values in (slowness, slopes, np.abs(rows.first_jerk).max(axis=1)))
    speed, acceleration, jerk = (1.0 / np.median(values, axis=1) for values in each)
    at_speed_s = lengths * slowness.reshape(len(lengths), -1).mean(axis=1)
    return [_Leg(*map(float, leg)) for leg in zip(lengths, speed, acceleration, jerk, at_speed_s, strict=True)]


def halfway_s(paths: Sequence[JointPath | Independent], timed: Sequence[Timed]) -> dict[int, float]:
    """When each block is half done [s], from the beginning of the first of `paths` on."""
    halfway, begins = {}, 0.0
    for path, each in zip(paths, timed, strict=True):
        done = 0.0
        for stretch in path.stretches:
            middle = np.interp((done + stretch.end) / 2.0, each.parameters, each.times)
            halfway[stretch.block], done = begins + float(middle), stretch.end
        begins += each.pieces.duration_s
    return halfway
