"""Jogging: set points on the fly from any state, for as long as an operator asks for them."""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from robot_agent.kinematics import Model, TrackError
from robot_agent.trajectory.governor.rate_law import sample_times
from robot_agent.trajectory.limits import Limits
from robot_agent.trajectory.sources.admission import Admission, Excess
from robot_agent.trajectory.sources.axes import Axes, Numbers
from robot_agent.trajectory.sources.online import NoCourse, StepTarget, course, sampled_course
from robot_agent.trajectory.sources.states import JointState, States
from robot_agent.trajectory.sources.tcp import NoDirection, why_fast, why_lost

JOG_SPEED_M_S = 0.25
"""Largest speed of TCP and flange while an operator jogs: the reduced speed of ISO 10218-1."""
_TRIES = 6
_SLOWEST = 0.01
"""Share of the wished speed below which the robot rather stands."""
_FASTER = 1.1
"""How much more than what was admissible last is tried next."""
_SLOWER = 0.6
_LONGEST_RAMP_S = 2.0
_ARRIVED = 1e-6
"""[rad or m] A step that ends this near to its goal has ended."""
_BELOW = 1.02
"""How much further than a limit was exceeded the next try goes back."""
_SPARE = 0.9
"""Share of what the joints could do that is used where it changes along the way."""


@dataclass(frozen=True, slots=True)
class JogWish:
    """Change coordinate `index` of some axes at `speed` (signed, [rad/s or m/s]), at most by `step` (> 0)."""

    index: int
    speed: float
    step: float | None = None


@dataclass(frozen=True, slots=True)
class _Effort:
    """Shares of the wished speed, and of what the axes could do of acceleration and jerk."""

    speed: float
    acceleration: float = 1.0
    jerk: float = 1.0

    def slower(self, factor: float) -> "_Effort":
        return replace(self, speed=self.speed * factor)

    def within(self, excess: Excess) -> "_Effort":
        """Less of what exceeds its limit."""
        shares = np.array([excess.speed, excess.acceleration, excess.jerk])
        speed, acceleration, jerk = np.where(shares > 1.0, 1.0 / (_BELOW * shares), 1.0).tolist()
        return _Effort(self.speed * speed, self.acceleration * acceleration, self.jerk * jerk)


_STOP = _Effort(0.0)


@dataclass(frozen=True, slots=True)
class _Rejected:
    """Why states may not be sent, and what to try next."""

    why: str
    next: _Effort


class JogSource:
    """One press of a jog key: moves along one coordinate while `held`, and comes to rest when it is not.

    What it gives has been checked together with its ramp: joints inside their limits (soft ones, `SOFT_MARGIN`), speed,
    `ramp` acceleration and jerk, TCP and flange no faster than `JOG_SPEED_M_S`, and whatever `clear` looks at. Where
    the wish is not admissible it goes slower, where no speed is it stands; `ruled_by` says why. If nothing new is
    admissible it follows the ramp that was given before.
    """

    def __init__(
        self,
        model: Model,
        limits: Limits,
        cycle_s: float,
        axes: Axes,
        wish: JogWish,
        clear: Callable[[States], str] | None = None,
    ) -> None:
        """`clear` says what is in the way of states, the present one first; empty when nothing is."""
        self._model = model
        self._limits = limits
        self._cycle_s = cycle_s
        self._axes = axes
        self._wish = wish
        self._clear = clear
        self._admission = Admission(model, limits, cycle_s, JOG_SPEED_M_S)
        self._way = States.standing(model.home)
        self._before = np.repeat(model.home[None], 2, axis=0)
        self._checked = False
        """Whether `_way` was found by this source, with its ramp."""
        self._effort = _Effort(1.0)
        self._goal: Numbers | None = None
        self.held = True
        self.arrived = False
        """Whether the robot stood at the end of its step where it was resumed last."""
        self.ruled_by = ""

    def resume(self, way: States, before: Numbers) -> None:
        """Go on from the first of the states `way`, which end at rest; it is what is commanded if nothing else is.

        `before` `(2, n)` are the joints commanded in the two ticks before.
        """
        self._way, self._before, self._checked = way, before, False
        if self._goal is None and self._wish.step is not None:
            distance = math.copysign(self._wish.step, self._wish.speed)
            self._goal = self._axes.goal(self.state, self._wish.index, distance)
        self.arrived = self._there

    @property
    def state(self) -> JointState:
        return self._way.at(0)

    def lead(self, q: Numbers) -> Numbers:
        """Joint speeds `(n,)` of the wish where the robot stands at `q` `(n,)`. Raises `NoDirection`."""
        state = JointState(q, np.zeros_like(q), np.zeros_like(q))
        return self._axes.lead(state, self._wish.index) * self._wish.speed

    @property
    def at_rest(self) -> bool:
        """Whether the robot stands in `state`, and nothing given so far moves it on."""
        return not self._way.qd.any() and not (self._way.q != self._way.q[0]).any()

    @property
    def _there(self) -> bool:
        """Whether the robot stands at the end of the step in `state`."""
        missing = self._missing
        return missing is not None and abs(missing) <= _ARRIVED and self.at_rest

    def samples(self, count: int) -> States:
        """The next `count` ticks."""
        found = self._search(count)
        source = self._way if found is None else found
        given, ramp = source.after(1).first(count), source.after(count + 1)
        if count > 0:
            self._before = np.concatenate([self._before, self._way.q[:1], given.q])[-3:-1]
            self._way = States.one(given.at(count - 1)).then(ramp)
            self._checked = found is not None
        return given

    def brake(self) -> States:
        """The ramp that was checked with the samples given last; before any, the faster of a new and the old one."""
        old = self._way.after(1)
        found = None if self._checked else self._attempt(_STOP, 0)
        return found.after(1) if isinstance(found, States) and found.count <= old.count else old

    def _search(self, count: int) -> States | None:
        """The fastest admissible way among a few, the present state first; None when there is none."""
        effort, why = _STOP, ""
        if self.held and not self._there:
            effort, why = self._foreseen()
        for _ in range(_TRIES):
            if effort.speed < _SLOWEST:
                effort = replace(effort, speed=0.0)
            found = self._attempt(effort, count)
            if isinstance(found, States):
                break
            why = found.why or why
            if found.next == effort:
                break
            effort = found.next
        self._effort = replace(effort, speed=max(effort.speed, _SLOWEST))
        self.ruled_by = why if effort.speed < 1.0 else ""
        return found if isinstance(found, States) else None

    def _foreseen(self) -> tuple[_Effort, str]:
        """A little more than last time, as far as the joints let the axis move from here, and which joint rules."""
        wish, limits, last = self._wish, self._limits, self._effort
        try:
            lead = self._axes.lead(self.state, wish.index)
        except NoDirection as error:
            return _STOP, str(error)
        reach = np.maximum(np.abs(lead), 1e-9)
        shares = reach * abs(wish.speed) / (_SPARE * limits.velocity)
        joint = int(shares.argmax())
        tcp = self._admission.tcp_share(self.state.q[None], lead[None] * wish.speed)
        speed = min(1.0, _FASTER * last.speed, 1.0 / max(tcp, 1e-9))
        ruling = float(shares[joint]) * speed > 1.0
        why = why_fast(self._model, self.state.q, joint) if ruling else ""
        hardest = float((limits.both_ways / reach).min() / self._axes.acceleration[wish.index])
        jerk = float((limits.jerk / reach).min() / self._axes.jerk[wish.index])
        effort = _Effort(
            1.0 / float(shares[joint]) if ruling else speed,
            min(1.0, _SPARE * hardest, _FASTER * last.acceleration),
            min(1.0, _SPARE * jerk, _FASTER * last.jerk),
        )
        return effort, why

    def _attempt(self, effort: _Effort, count: int) -> States | _Rejected:
        """The wish with an effort, and its ramp; the present state first."""
        try:
            states = self._way.first(1).then(self._generate(effort, count))
        except TrackError as error:
            return _Rejected(why_lost(error), effort.slower(_SLOWER))
        except (NoDirection, NoCourse) as error:
            return _Rejected(str(error), effort.slower(_SLOWER))
        excess = self._admission.excess(states, self._before)
        if max(excess.speed, excess.acceleration, excess.jerk) > 1.0:
            return _Rejected(excess.why, effort.within(excess))
        why = self._admission.outside(states) or self._in_the_way(states, stops=effort.speed == 0.0)
        if not why:
            return states
        return _Rejected(why, effort.slower(_SLOWER) if effort.speed > 0.0 else _STOP)

    def _in_the_way(self, states: States, stops: bool) -> str:
        """What is in the way of states; of a stop only if nothing is in the way that was given before.

        A gentler stop than that one would end farther ahead than where was looked.
        """
        if self._clear is None or (stops and self.at_rest):
            return ""
        why = self._clear(states)
        return "" if why and stops and self._clear(self._way) else why

    def _generate(self, effort: _Effort, count: int) -> States:
        """States after the present one: `count` towards the wish, then the ramp to rest."""
        axes, state = self._axes, self.state
        if effort.speed == 0.0 and self.at_rest:
            return States.standing(state.q, count + 1)
        velocity, acceleration = axes.motion(state)
        hardest, jerk = effort.acceleration * axes.acceleration, effort.jerk * axes.jerk
        end = np.stack([np.zeros_like(velocity), velocity, acceleration])
        going = np.zeros((3, 0, len(velocity)))
        if count > 0:
            target, place = self._target(len(velocity), effort.speed)
            way = course(velocity, acceleration, target, hardest, jerk, place)
            going = sampled_course(way, sample_times(count + 1, self._cycle_s)[1:])
            end = going[:, -1]
        ramp = self._limits.ramp_factor
        stopping = course(end[1], end[2], np.zeros_like(velocity), ramp * hardest, ramp * jerk)
        if stopping.duration > _LONGEST_RAMP_S:
            raise NoCourse(f"a ramp would last {stopping.duration:.1f} s")
        ticks = max(1, math.ceil(stopping.duration / self._cycle_s - 1e-9))
        braking = sampled_course(stopping, sample_times(ticks + 1, self._cycle_s)[1:])
        braking[0] += end[0]
        braking[1:, -1] = 0.0
        return axes.states(state, np.concatenate([going, braking], axis=1))

    def _target(self, count: int, share: float) -> tuple[Numbers, StepTarget | None]:
        """Speeds to reach, or the place of a step."""
        target, wish, missing = np.zeros(count), self._wish, self._missing
        if share > 0.0 and missing is not None:
            return target, StepTarget(wish.index, missing, share * abs(wish.speed))
        target[wish.index] = share * wish.speed
        return target, None

    @property
    def _missing(self) -> float | None:
        """How much of the step is left, signed; None without a step."""
        return None if self._goal is None else self._axes.missing(self.state, self._wish.index, self._goal)
