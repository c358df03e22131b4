"""From one rate to another as fast as the joints allow, step by step along the path."""

import math

from robot_agent.trajectory.governor.rate_bounds import RateBounds, Row
from robot_agent.trajectory.governor.rate_law import RateLaw
from robot_agent.trajectory.governor.segment import PathState

_LOOKED_AT = ((0.5, 7.0 / 12.0), (0.0, 1.0 / 3.0))
"""Where a landing is looked at: the share of its time that is left, and the mean of the missing rate until there."""
_STEPS = 14
_MOST_STEPS = 80
_SHORTEST_S, _LONGEST_S = 2e-4, 0.04
_HALVINGS = 3
_LEAST_SHARE = 0.2
_NO_TIME_S = 1e-12
"""The rate is there: no finite change of its slope takes less time."""
_LONGEST_LANDING_S = 60.0
"""A slope so small that its landing would take longer leads nowhere."""
_FASTEST = 4.0
"""A higher rate is not sent whatever leads to it, and the bounds there, which grow with its cube, say nothing."""
_SAME_RATE, _SAME_SLOPE = 1e-9, 1e-6


class Steering:
    """Along one travel.

    The rate's slope changes as fast as jerk and acceleration allow, until only one constant change of it back to zero
    is left. For constant bounds that is the fastest way there is (three pieces); here the bounds are those of the place
    and the rate of each step. No bound is certain to be kept: what is really sent is checked sample by sample.
    """

    def __init__(self, bounds: RateBounds) -> None:
        self._bounds = bounds

    def change(self, start: PathState, target: float, share: float = 1.0, limit: float = math.inf) -> RateLaw:
        """The way from `start` to the rate `target` with a `share` (0 to 1] of what is allowed.

        At way `limit` [s] the plan itself rests: the law is not worked out beyond.
        """
        way, rate, slope, bend = start.tau, start.rate, start.rate_dot, 0.0
        if abs(rate - target) < _SAME_RATE and abs(slope) < _SAME_SLOPE:
            return RateLaw.constant(target)
        sign, h = self._plan(start, target, share)
        landing = _Landing(self._bounds, target, sign, share, _STEPS * h)
        pieces: list[tuple[float, float]] = []
        halvings = 0
        low, high = _bends(self._bounds.row(way), rate, slope)
        while way < limit and rate < _FASTEST and len(pieces) < _MOST_STEPS:
            ahead = self._bounds.row(way + h * (rate + h * slope / 2.0))
            end = max(rate + h * (slope + h * bend / 2.0), 0.0)
            step_low, step_high, least, most = _ahead(ahead, end, slope, h, low, high)
            if sign < 0.0:
                drive = min(max(share * step_low, (share * least - slope) / h), step_high)
            else:
                drive = max(min(share * step_high, (share * most - slope) / h), step_low)
            then_way = way + h * (rate + h * (slope / 2.0 + h * drive / 6.0))
            then_rate, then_slope = rate + h * (slope + h * drive / 2.0), slope + h * drive
            then_low, then_high = _bends(ahead, then_rate, then_slope)
            counter = then_high if sign < 0.0 else -then_low
            if landing.possible(then_way, then_rate, then_slope, counter):
                pieces.append((h, drive))
                way, rate, slope, bend = then_way, then_rate, then_slope, drive
                low, high = then_low, then_high
            elif halvings < _HALVINGS or (sign * slope <= 0.0 and h > _SHORTEST_S / 16.0):
                h, bend = h / 2.0, 0.0
                halvings += 1
            else:
                break
        missing = target - rate
        landing_s = 2.0 * missing / slope if slope != 0.0 else math.inf
        if way < limit and _NO_TIME_S < landing_s < _LONGEST_LANDING_S:
            pieces.append((landing_s, -slope * slope / (2.0 * missing)))
        return RateLaw.of_pieces(start.rate, start.rate_dot, pieces, target)

    def _plan(self, start: PathState, target: float, share: float) -> tuple[float, float]:
        """Whether the rate has to rise (1) or to fall (-1), and the length of a step [s]."""
        rate, slope = start.rate, start.rate_dot
        row = self._bounds.row(start.tau)
        low, high = _bends(row, rate, slope)
        counter = max(high if slope < 0.0 else -low, 1e-3)
        coasted = rate + slope * abs(slope) / (2.0 * counter * share)
        sign = -1.0 if target == 0.0 or coasted > target else 1.0
        between = (rate + target) / 2.0
        low, high = _bends(row, between, 0.0)
        least, most = _slopes(row, between)
        bend, steepest = max(share * (high if sign > 0.0 else -low), 1e-3), share * (most if sign > 0.0 else -least)
        distance, steepest = abs(target - rate), max(steepest, 1e-3)
        if distance * bend > steepest**2:
            whole = distance / steepest + steepest / bend
        else:
            whole = 2.0 * math.sqrt(distance / bend)
        return sign, min(max(whole / _STEPS, _SHORTEST_S), _LONGEST_S)


class _Landing:
    """One constant change of the slope back to 0, with which the rate reaches its target."""

    __slots__ = ("_bounds", "_far_s", "_share", "_sign", "_target")

    def __init__(self, bounds: RateBounds, target: float, sign: float, share: float, far_s: float) -> None:
        self._bounds, self._far_s = bounds, far_s
        self._target, self._sign, self._share = target, sign, share

    def possible(self, way: float, rate: float, slope: float, counter: float) -> bool:
        """Whether it is within the bounds from a state on.

        It is looked at in its beginning, where `counter` is the bound, in its middle and in its end. One of more than
        `far_s` is not what the change will end with; what lies there does not matter.
        """
        sign, missing = self._sign, self._target - rate
        if sign * slope <= 0.0:
            return True
        if sign * missing <= 0.0:
            return False
        needed = sign * slope * slope / (2.0 * missing * self._share)
        if needed > counter:
            return False
        duration = 2.0 * missing / slope
        for left, mean in _LOOKED_AT if duration < self._far_s else ():
            ahead = self._bounds.row(way + duration * (1.0 - left) * (self._target - missing * mean))
            if needed > _counter_bend(ahead, self._target - missing * left * left, left * slope, sign):
                return False
        return True


def _bends(row: Row, rate: float, slope: float) -> tuple[float, float]:
    """The bounds on the slope's slope [1/s^2] at a rate and a slope: jerk."""
    cube, cross = rate * rate * rate, 3.0 * rate * slope
    low, high = -math.inf, math.inf
    for _, _, jerk, second, third in row:
        path = cube * third + cross * second
        if -jerk - path > low:
            low = -jerk - path
        if jerk - path < high:
            high = jerk - path
    return low, high


def _counter_bend(row: Row, rate: float, slope: float, sign: float) -> float:
    """The bound on the slope's slope [1/s^2] against a change of the rate in the direction `sign`."""
    cube, cross = sign * rate * rate * rate, 3.0 * sign * rate * slope
    most = math.inf
    for _, _, jerk, second, third in row:
        bend = jerk + cube * third + cross * second
        if bend < most:
            most = bend
    return most


def _ahead(row: Row, rate: float, slope: float, h: float, low: float, high: float) -> tuple[float, float, float, float]:
    """The bounds after a step of `h` [s]: `low` and `high` of the slope's slope, narrowed, and those of the slope.

    `rate` is the one after the step, `slope` the one before it.
    """
    square = rate * rate
    cube, cross, grown = square * rate, 3.0 * rate * slope, 3.0 * rate * h
    least, most = -math.inf, math.inf
    for lowest, highest, jerk, second, third in row:
        path = square * second
        if lowest - path > least:
            least = lowest - path
        if highest - path < most:
            most = highest - path
        path = cube * third + cross * second
        share = 1.0 + grown * second
        if share > _LEAST_SHARE:
            if (-jerk - path) / share > low:
                low = (-jerk - path) / share
            if (jerk - path) / share < high:
                high = (jerk - path) / share
    return low, high, least, most


def _slopes(row: Row, rate: float) -> tuple[float, float]:
    """The bounds on the slope [1/s] at a rate: acceleration."""
    low = max(each[0] - rate * rate * each[3] for each in row)
    return low, min(each[1] - rate * rate * each[3] for each in row)
