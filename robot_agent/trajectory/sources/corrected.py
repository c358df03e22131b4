"""A path under the governor with a live correction on top: conveyors, sensors."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from robot_agent.kinematics import Model, TrackError
from robot_agent.trajectory.governor.governor import Governor, Hold, RateRequest
from robot_agent.trajectory.governor.rate_law import sample_times
from robot_agent.trajectory.governor.segment import RESTING_SAMPLES, Segment
from robot_agent.trajectory.limits import Limits
from robot_agent.trajectory.sources.admission import Admission, Excess
from robot_agent.trajectory.sources.axes import turn_by
from robot_agent.trajectory.sources.corrected_block import CorrectedBlock
from robot_agent.trajectory.sources.online import NoCourse, approach, course, sampled_course
from robot_agent.trajectory.sources.states import JointState, States
from robot_agent.trajectory.sources.target import Target
from robot_agent.trajectory.sources.tcp import in_reach, tracked, why_lost

Numbers = NDArray[np.float64]

_TRIES = 6
_MORE = 1.1
_BELOW = 1.02
_SLOWER = 0.6
"""How much slower what leads into something is tried next."""
_LEAST = 0.02
"""Share of the correction's acceleration, or of all speed, below which the robot rather stops."""
_GENTLEST_RAMP = 0.25
"""Least share of what the joints allow that the path's ramp is left with, whatever the correction needs."""
_CLOSING_STOP_S = 0.4
"""A correction approaches its target no faster than it can stop within this time, however gentle it has to be."""
_LONGEST_RAMP_S = 3.0
_CANNOT_FOLLOW = "the joints cannot follow it"


class CorrectionFrame(Enum):
    """In whose axes a correction is meant."""

    BASE = "base"
    TOOL = "tool"


@dataclass(frozen=True, slots=True)
class CorrectionLimits:
    """How fast a correction may change beside what it follows: of its translation and of its rotation."""

    speed_m_s: float
    acceleration_m_s2: float
    jerk_m_s3: float
    angular_speed_rad_s: float
    angular_acceleration_rad_s2: float
    angular_jerk_rad_s3: float


@dataclass(frozen=True, slots=True)
class _Effort:
    """Shares: of the path's rate, of the correction's acceleration and jerk, of what the path's ramp may use; and of
    the speeds of the correction and its target."""

    rate: float
    acceleration: float
    jerk: float
    ramp: float = 1.0
    speed: float = 1.0

    def within(self, excess: Excess) -> "_Effort":
        """Less of what exceeds its limit: a slower path for speed, gentler correction and ramp for the others."""
        shares = np.array([excess.speed, excess.acceleration, excess.jerk])
        rate, acceleration, jerk = np.where(shares > 1.0, 1.0 / (_BELOW * shares), 1.0).tolist()
        ramp = max(self.ramp * min(acceleration, jerk), _GENTLEST_RAMP)
        return _Effort(self.rate * rate, self.acceleration * acceleration, self.jerk * jerk, ramp, self.speed)

    def slower(self) -> "_Effort":
        """As hard, but path and correction slower."""
        return replace(self, rate=_SLOWER * self.rate, speed=_SLOWER * self.speed)

    def at_least(self, share: float) -> "_Effort":
        """A path that waits stays so."""
        return replace(
            self,
            rate=max(self.rate, share) if self.rate > 0.0 else 0.0,
            acceleration=max(self.acceleration, share),
            jerk=max(self.jerk, share),
            speed=max(self.speed, share),
        )

    def more(self) -> "_Effort":
        shares = (self.rate, self.acceleration, self.jerk, self.ramp, self.speed)
        return _Effort(*(min(1.0, _MORE * share) for share in shares))


@dataclass(frozen=True, slots=True)
class _InTheWay:
    """What a block would lead into, for people."""

    why: str


_PATH_WAITS = _Effort(0.0, 1.0, 1.0)
"""The path stands while the correction goes where it can."""


class CorrectedSource:
    """Follows a planned motion and adds an offset of the TCP that is driven towards `target`.

    The correction never jumps: it approaches its target within its own limits and then moves with it. What is given
    keeps the joints' limits of position and speed and what a ramp may use of acceleration and jerk; for speed the path
    gives way, for the others the correction and the path's ramp become gentler. In front of what it must not enter
    both get slower, and stand close to it. A request for rate 0 stops both; a hold
    bounds tau alone, so the tool still moves with its target there. Where the corrected path would leave the reach or a
    joint's limits the robot stops and `ruled_by` says why; it goes on when that is over. A ramp brings path time and
    correction to rest in the world.
    """

    def __init__(
        self,
        model: Model,
        limits: Limits,
        governor: Governor,
        segment: Segment,
        correction: CorrectionLimits,
        frame: CorrectionFrame = CorrectionFrame.BASE,
        clear: Callable[[States], str] = lambda _: "",
    ) -> None:
        """Begin at the first sample of `segment`, which `governor` gave and at which the robot stands.

        `clear` says what the body would enter that it may not (zones); empty when nothing.
        """
        c = correction
        self._model = model
        self._governor = governor
        self._frame = frame
        self._ramp_factor = limits.ramp_factor
        self._cycle_s = segment.cycle_s
        self._limits = limits
        self._braking = self._admission = Admission(model, limits, segment.cycle_s)
        self._cap_m_s: float | None = None
        self._clear = clear
        self._speed = np.repeat([c.speed_m_s, c.angular_speed_rad_s], 3)
        self._acceleration = np.repeat([c.acceleration_m_s2, c.angular_acceleration_rad_s2], 3)
        self._jerk = np.repeat([c.jerk_m_s3, c.angular_jerk_rad_s3], 3)
        self._given = CorrectedBlock.standing(segment.remainder(segment.length, ""))
        self._index = 0
        self._efforts = [_Effort(1.0, 1.0, 1.0), _PATH_WAITS]
        """What was admissible last, of path and correction together, and of the correction while the path waits."""
        self.requests: Sequence[RateRequest] = ()
        self.holds: Sequence[Hold] = ()
        self.target = Target.none()
        """Where the correction shall be at the tick of `state`."""
        self.ruled_by = ""

    @property
    def state(self) -> JointState:
        return self._given.states.at(self._index)

    @property
    def tau(self) -> float:
        """Path time [s] of `state`."""
        return self._given.path.state(self._index).tau

    @property
    def offset(self) -> Numbers:
        """`(6,)` the correction in `state`."""
        return self._given.offset(self._index)

    @property
    def given(self) -> CorrectedBlock:
        """What `samples` and `brake` gave last."""
        return self._given

    def resume(self, ticks: int, given: CorrectedBlock | None = None, governor: Governor | None = None) -> None:
        """Go on from `ticks` after where the last `samples` began: blocks overlap.

        Where those were not played, `given` is the block that is, and `governor` the one of its motion.
        """
        self._given, self._index = given or self._given, ticks
        self._governor = governor or self._governor

    def follow(self, governor: Governor) -> None:
        """Go on with another motion, which begins where the present one has ended; the correction stays as it is."""
        self._governor = governor
        self._given, self._index = self._given.after(self._index).onto(governor.rest(0.0)), 0

    def cap(self, tcp_speed_m_s: float | None) -> None:
        """Bound the speed of TCP and flange, path and correction together; `None` lifts the bound."""
        if tcp_speed_m_s != self._cap_m_s:
            self._cap_m_s = tcp_speed_m_s
            bound = np.inf if tcp_speed_m_s is None else tcp_speed_m_s
            self._admission = Admission(self._model, self._limits, self._cycle_s, bound)

    def samples(self, count: int) -> States:
        """The next `count` ticks."""
        self._given = self._search(self._given.after(self._index), count)
        self._index = count
        return self._given.states.after(1).first(count)

    def brake(self) -> States:
        """The ramp that was checked with the samples given last, or what is left of it."""
        return self._given.states.after(self._index + 1)

    def _search(self, begun: CorrectedBlock, count: int) -> CorrectedBlock:
        """The path and the correction as wished, as far as the joints allow; else the fastest stop of both."""
        slowest = min(self.requests, key=lambda each: each.rate, default=RateRequest(1.0, ""))
        if slowest.rate <= 0.0:
            self.ruled_by = slowest.who
            return self._stopped(begun, _TRIES)
        why = f"correction: {_CANNOT_FOLLOW}"
        for which, last in enumerate(self._efforts):
            found, effort, reason = self._eased(begun, count, last.more(), _TRIES)
            self._efforts[which] = effort.at_least(_LEAST)
            if found is not None:
                held_up = effort.rate < 1.0
                self.ruled_by = (reason or why) if held_up else found.path.ruled_by
                return found
            why = reason or why
            if not self._within_reach(begun):
                break
        self.ruled_by = why
        return self._stopped(begun, 1)

    def _within_reach(self, begun: CorrectedBlock) -> bool:
        """Whether the target can be reached from where the path is."""
        (pose,) = self._corrected(begun.path.q[:1], self.target.offset[None])
        return in_reach(self._model, pose, begun.states.q[0])

    def _eased(
        self, begun: CorrectedBlock, count: int, effort: _Effort, tries: int
    ) -> tuple[CorrectedBlock | None, _Effort, str]:
        """The first admissible block of a few tries; the effort tried last, and what was in the way, for people."""
        why = ""
        for _ in range(tries):
            found = self._attempt(begun, count, effort)
            if isinstance(found, CorrectedBlock):
                return found, effort, why
            if isinstance(found, str):
                return None, effort, f"correction: {found}"
            why = f"correction: {found.why}" if found.why else why
            effort = effort.slower() if isinstance(found, _InTheWay) else effort.within(found)
            if min(effort.acceleration, effort.speed) < _LEAST:
                break
        return None, effort, why

    def _stopped(self, begun: CorrectedBlock, tries: int) -> CorrectedBlock:
        """The fastest stop of path and correction, found in some tries; what was given before when none is faster."""
        stopped, _, _ = self._eased(begun, 0, _PATH_WAITS, tries)
        return begun if stopped is None or stopped.states.count > begun.states.count else stopped

    def _attempt(self, begun: CorrectedBlock, count: int, effort: _Effort) -> CorrectedBlock | Excess | _InTheWay | str:
        """One block with an effort; what exceeds a limit or is in the way, or why there is none."""
        requests = [*self.requests, RateRequest(effort.rate, "correction")]
        stop = count == 0 or effort.rate == 0.0
        path = self._governor.next(begun.path, 0, requests, self.holds, stop, self._cap_m_s, effort.ramp)
        try:
            correction = self._correction(begun.correction[:, 0], count, effort)
            ticks = max(path.rest_index, correction.shape[1] - 1) + RESTING_SAMPLES
            correction = correction[:, np.minimum(np.arange(ticks + 1), correction.shape[1] - 1)]
            kept = np.minimum(np.arange(ticks + 1), path.length - 1)
            poses = self._corrected(path.q[kept], correction[0])
            q = tracked(self._model, poses, begun.states.q[0])
        except TrackError as error:
            return why_lost(error)
        except NoCourse:
            return _CANNOT_FOLLOW
        states = self._with_derivatives(begun.states, q)
        excess = (self._admission if count > 0 else self._braking).excess(states, begun.before)
        if max(excess.speed, excess.acceleration, excess.jerk) > 1.0:
            return excess
        why = self._clear(states)
        return _InTheWay(why) if why else CorrectedBlock(path, correction, states, begun.before)

    def _correction(self, present: Numbers, count: int, effort: _Effort) -> Numbers:
        """Offset, velocity, acceleration `(3, m, 6)`, `present` `(3, 6)` first: towards the target, then to rest."""
        hardest, jerk = effort.acceleration * self._acceleration, effort.jerk * self._jerk
        parts, end = [present[:, None]], present
        if count > 0:
            times = sample_times(count + 1, self._cycle_s)[1:]
            speed = effort.speed * self.target.speed
            gap, closing = present[0] - self.target.offset, present[1] - speed
            slow = np.minimum(hardest * _CLOSING_STOP_S / 2.0, jerk * _CLOSING_STOP_S**2 / 4.0)
            way = approach(gap, closing, present[2], effort.speed * np.minimum(self._speed, slow), hardest, jerk)
            following = sampled_course(way, times)
            following[0] += self.target.offset + times[:, None] * speed
            following[1] += speed
            parts.append(following)
            end = following[:, -1]
        ramp = self._ramp_factor
        stopping = course(end[1], end[2], np.zeros(6), ramp * hardest, ramp * jerk)
        if stopping.duration > _LONGEST_RAMP_S:
            raise NoCourse(f"a ramp would last {stopping.duration:.1f} s")
        ticks = math.ceil(stopping.duration / self._cycle_s - 1e-9)
        if ticks > 0:
            braking = sampled_course(stopping, sample_times(ticks + 1, self._cycle_s)[1:])
            braking[0] += end[0]
            braking[1:, -1] = 0.0
            parts.append(braking)
        return np.concatenate(parts, axis=1)

    def _corrected(self, q: Numbers, offsets: Numbers) -> Numbers:
        """TCP poses `(m, 4, 4)` of the path's joints `(m, n)` with offsets `(m, 6)`."""
        poses = self._model.forward(q).copy()
        turned = turn_by(offsets[:, 3:])
        if self._frame is CorrectionFrame.TOOL:
            poses[:, :3, 3] += (poses[:, :3, :3] @ offsets[:, :3, None])[..., 0]
            poses[:, :3, :3] = poses[:, :3, :3] @ turned
        else:
            poses[:, :3, 3] += offsets[:, :3]
            poses[:, :3, :3] = turned @ poses[:, :3, :3]
        return poses

    def _with_derivatives(self, begun: States, q: Numbers) -> States:
        """States of joints `(m, n)` whose first row is where `begun` is, and whose last rows rest."""
        q = np.concatenate([begun.q[:1], q[1:]])
        last = int(np.flatnonzero((np.abs(q - q[-1]) > 1e-10).any(axis=1)).max(initial=-1)) + 1
        q[last:] = q[last]
        around = np.concatenate([q, q[-1:]])
        qd, qdd = np.zeros_like(q), np.zeros_like(q)
        qd[0], qdd[0] = begun.qd[0], begun.qdd[0]
        qd[1:] = (around[2:] - around[:-2]) / (2.0 * self._cycle_s)
        qdd[1:] = np.diff(around, n=2, axis=0) / self._cycle_s**2
        qd[last:], qdd[last:] = 0.0, 0.0
        return States(q, qd, qdd)
