"""From motions to set-point blocks: which one comes next, where it joins, and what body it implies."""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from cell.config.settings import Times
from cell.messages import Body, DriveFeedback, OutputEvent, SetpointBlock
from robot_agent.agent.blocks.corrected_blocks import corrected_block, resume
from robot_agent.agent.blocks.corrections import Correcting
from robot_agent.agent.blocks.timeline import SentBlock, Span, Timeline
from robot_agent.agent.drives.axes import samples_in_axes, torques_in_axes
from robot_agent.agent.planning.planner import Planner
from robot_agent.agent.planning.plans import Planned, Sampled
from robot_agent.dynamics import AxisTorques
from robot_agent.kinematics import OpenMechanism
from robot_agent.trajectory import Governor, Hold, RateRequest, Segment
from robot_agent.trajectory.sources import CorrectedSource, JogSource, States, Target, sampled, states_from
from robot_agent.workspace import Sweep, body_message, sweep, unknown_body

_MEASURED_LAG_S = 0.1
"""How far behind the commanded position the measured one is searched for."""
_SETTLED = 2
"""Samples at rest between a ramp and the way on: without them the jerk of both adds up in the sample between them."""


@dataclass(frozen=True, slots=True)
class Wishes:
    """What the core wants of the next block."""

    requests: tuple[RateRequest, ...]
    stop: bool
    holds: Callable[[Planned, Segment, int], list[Hold]]
    """The holds on a motion at a sample of a segment: zones that may not be entered, the end of a step."""
    cap_m_s: float | None = None
    """The TCP may not be faster."""
    follower: Planned | None = None
    """The motion to begin once the present one is at rest; nothing, where it is the present one already."""
    not_before_tick: int = 0
    """The follower does not begin earlier (a programmed pause)."""
    on_time: bool = False
    """Nor does it begin later (a common start)."""
    end_tick: int | None = None
    """The motion ends then, if it can."""
    correction: Correcting | None = None
    """The follower is corrected."""
    jog: JogSource | None = None
    """What an operator's jog key wants; it rules while the robot is jogged."""


class Executive:
    """Keeps one enabled robot supplied with blocks. Made when the drives are enabled, dropped when they are not."""

    def __init__(
        self,
        planner: Planner,
        standing: Planned,
        feedback: DriveFeedback,
        times: Times,
        numbers: Iterator[int],
        torques: AxisTorques | None = None,
    ) -> None:
        """`numbers` counts the blocks of the present claim, those sent while disabled included; `torques` go along."""
        self._robot = feedback.robot
        self._planner = planner
        self._cycle_s = planner.cycle_s
        self._lead = math.ceil(times.lead_s / self._cycle_s)
        self._nominal_s = times.nominal_s
        self._owner = feedback.owner
        self._numbers = numbers
        self._torques = torques
        self.nominal = round(times.nominal_s / self._cycle_s)
        """So many samples of a block are what is meant to come; the others are there in case no block follows."""
        self._governors: dict[int, tuple[Planned, Governor]] = {}
        self._jog: JogSource | None = None
        self._standing: tuple[Span, Sweep] | None = None
        """Where it stood last, and its body there."""
        first = SentBlock(feedback.block, feedback.tick, standing, self._governor(standing).rest(0.0))
        self.timeline = Timeline(first)

    @property
    def cycle_s(self) -> float:
        return self._cycle_s

    def stand(self, standing: Planned, tick: int, tau: float = 0.0) -> None:
        """Forget the motion in which the robot stands still since before `tick`.

        It stands at `tau` [s] of `standing` instead, which is the same place.
        """
        self._governors.clear()
        segment = self._governor(standing).rest(tau)
        self.timeline = Timeline(SentBlock(self.timeline.newest.sequence, tick, standing, segment))

    @property
    def at_motion_end(self) -> bool:
        """Whether the newest accepted block ends where its motion ends."""
        newest = self.timeline.newest
        return newest.path_segment.stop_tau >= newest.path.motion.duration_s

    @property
    def corrected(self) -> bool:
        """Whether a correction is part of where the newest accepted block leads."""
        return self.timeline.newest.followed is not None

    def path_at_rest(self, tick: int) -> bool:
        """Whether path time stands at and after a tick; a tool that follows something may still move."""
        return self.timeline.path_rest_tick <= tick if self.corrected else self.at_rest(tick)

    def at_rest(self, tick: int) -> bool:
        """Whether nothing that was sent moves at or after a tick."""
        return self.rest_s(tick, None) == 0.0

    def rest_s(self, tick: int, candidate: SentBlock | None) -> float:
        """From a tick until all that was sent, and a candidate, is at rest [s]; 0.0 when nothing of it moves."""
        if self.timeline.stands(tick, candidate):
            return 0.0
        played_out = self.timeline.played_out_tick
        last = played_out if candidate is None else max(played_out, candidate.rest_tick)
        return max(1, last - tick) * self._cycle_s

    def next_block(self, feedback: DriveFeedback, age_s: float, wishes: Wishes) -> SentBlock:
        """The block to send now; it continues the newest accepted one and ends at rest."""
        base = self.timeline.newest
        tick = feedback.tick + int(age_s / self._cycle_s)
        join = max(tick + self._lead, base.first_tick)
        self._jog = wishes.jog or self._jog
        jogged = isinstance(base.planned, Sampled) and base.followed is None
        if self._jog is not None and (wishes.jog is not None or jogged):
            return self._jog_on(self._jog, base, join, wishes.stop)
        ahead_s = (join - feedback.tick) * self._cycle_s - age_s
        block = self._start_follower(base, join, wishes, ahead_s)
        if block is None and base.followed is not None:
            return self._follow(base.followed.source, base, join, base.path, wishes, ahead_s)
        if block is None:
            governor, previous = self._governor(base.planned), base.segment
            if join >= base.rest_tick:
                join = max(join, self.timeline.path_rest_tick + _SETTLED)
                previous, index = governor.rest(float(base.segment.tau[-1])), 0
            else:
                index = base.index(join)
            holds = wishes.holds(base.planned, previous, index)
            requests = self._requests(wishes, base.planned, join, previous.state(index).tau)
            segment = governor.next(previous, index, requests, holds, wishes.stop, wishes.cap_m_s)
            block = self._block(join, base.planned, segment)
        return block

    def sent(self, block: SentBlock, events: tuple[OutputEvent, ...] = (), program: bool = False) -> SetpointBlock:
        """Note that a block is sent with these events, and give its message, whose nominal part contains them.

        `program`: a program runs.
        """
        follows = self.timeline.newest.sequence
        self.timeline.sent(replace(block, events=events))
        segment = block.segment
        nominal = max([segment.nominal, *(event.tick - block.first_tick + 1 for event in events)])
        rows = np.minimum(np.arange(max(segment.length, nominal)), segment.length - 1)
        position, velocity = samples_in_axes(self._planner.model.coupling, segment.q[rows], segment.qd[rows])
        torque = torques_in_axes(self._torques, segment)
        return SetpointBlock(
            self._robot, self._owner, block.sequence, follows, block.first_tick, self._cycle_s, nominal,
            position, velocity, None if torque is None else torque[rows], events, program,
        )  # fmt: skip

    def body(self, feedback: DriveFeedback, candidate: SentBlock | None) -> Body:
        """Everything between the measured position and rest, for what was sent and for `candidate`.

        The whole reach when nobody knows where the robot is: it is not referenced, or its joints cannot be as measured.
        """
        measured = self._measured(feedback)
        if measured is None:
            return unknown_body(self._planner.model, self._planner.pose_world_base)
        tick, widen_m = measured
        spans = self.timeline.spans(tick, candidate)
        pieces = [(self._stood(span), 0, 0) if span.stands else (span.planned.sweep, *span.samples) for span in spans]
        return body_message(self._planner.model, self._planner.pose_world_base, pieces, widen_m)

    def _stood(self, span: Span) -> Sweep:
        """Exactly where the robot stands: not grown to the samples around it, which a zone may begin between."""
        known = self._standing
        if known is None or known[0].planned.motion is not span.planned.motion or known[0].last_tau != span.last_tau:
            q = span.planned.motion.q(np.array([span.last_tau]))
            known = self._standing = span, sweep(self._planner.model, self._planner.pose_world_base, q)
        return known[1]

    def _measured(self, feedback: DriveFeedback) -> tuple[int, float] | None:
        """The tick whose commanded position is nearest to the measured one, and the distance of the two bodies [m]."""
        if not feedback.referenced:
            return None
        span = int(_MEASURED_LAG_S / self._cycle_s)
        ticks = range(feedback.tick - span, feedback.tick + 1)
        commanded = np.array([block.segment.q[i] for block, i in map(self.timeline.at, ticks)])
        if (commanded == commanded[0]).all():  # it stands, as it does most of the time
            commanded = commanded[:1]
        try:
            points = self._planner.model.capsules(np.vstack([commanded, feedback.position]))
        except OpenMechanism:
            return None
        away = points[:-1] - points[-1]
        distances = np.sqrt(np.einsum("...k,...k", away, away).max(axis=(1, 2)))
        nearest = int(np.argmin(distances))
        return ticks[nearest], float(distances[nearest])

    def _jog_on(self, jog: JogSource, base: SentBlock, join: int, stop: bool) -> SentBlock:
        """The next block of a jog, or its way to rest."""
        index = base.index(join)
        before = base.segment.history(index)
        jog.resume(states_from(base.planned.motion, base.segment, index), before)
        present = States.one(jog.state)
        nominal = jog.samples(0 if stop else self.nominal)
        states = present.then(nominal).then(jog.brake())
        model = self._planner.model
        motion, segment = sampled(model, states, nominal.count, before, self._cycle_s, jog.ruled_by)
        return self._block(join, self._planner.sampled(motion), segment)

    def _begin_correction(self, follower: Planned, correcting: Correcting) -> CorrectedSource:
        governor, planner = self._governor(follower), self._planner
        limits, frame, clear = correcting.limits, correcting.frame, correcting.clear
        return CorrectedSource(planner.model, planner.limits, governor, governor.rest(0.0), limits, frame, clear)

    def _follow(
        self, source: CorrectedSource, base: SentBlock, tick: int, planned: Planned, wishes: Wishes, ahead_s: float
    ) -> SentBlock:
        """The next block of a correction; it begins `ahead_s` from now."""
        correcting = wishes.correction
        governor = self._governor(planned)
        goes_on = base.followed is not None and planned is base.followed.planned
        resume(source, base, tick, planned, governor)
        segment, index = (base.path_segment, tick - base.first_tick) if goes_on else (governor.rest(0.0), 0)
        source.requests = self._requests(wishes, planned, tick, segment.state(index).tau)
        if wishes.stop or correcting is None:
            source.requests = (*wishes.requests, RateRequest(0.0, "stop"))
        source.holds = wishes.holds(planned, segment, index)
        source.target = Target.none() if correcting is None else correcting.target.after(ahead_s)
        source.cap(wishes.cap_m_s)
        return corrected_block(self._planner, source, base, tick, planned, self.nominal, next(self._numbers))

    def _start_follower(self, base: SentBlock, join: int, wishes: Wishes, ahead_s: float) -> SentBlock | None:
        follower = wishes.follower
        begun = follower is not None and follower.motion is base.path.motion
        if follower is None or begun or wishes.stop or not self.at_motion_end:
            return None
        start = max(join, base.path_rest_tick, wishes.not_before_tick)
        if start > join + self._nominal_s / self._cycle_s or (wishes.on_time and start > wishes.not_before_tick):
            return None
        if wishes.correction is not None:
            return self._start_corrected(base, join, start, follower, wishes, ahead_s)
        governor = self._governor(follower)
        standing = governor.rest(0.0)
        holds = wishes.holds(follower, standing, 0)
        requests = self._requests(wishes, follower, start, 0.0)
        segment = governor.next(standing, 0, requests, holds, cap_m_s=wishes.cap_m_s)
        return self._block(start, follower, segment) if segment.tau[-1] > 0.0 else None

    def _start_corrected(
        self, base: SentBlock, join: int, start: int, follower: Planned, wishes: Wishes, ahead_s: float
    ) -> SentBlock | None:
        """The first block on `follower`; a tool that follows something already joins at once or waits where it is."""
        holds = wishes.holds(follower, self._governor(follower).rest(0.0), 0)
        held = any(hold.tau <= 0.0 for hold in holds) or any(request.rate <= 0.0 for request in wishes.requests)
        if wishes.correction is None or held or (base.followed is not None and start > join):
            return None
        followed = base.followed
        source = self._begin_correction(follower, wishes.correction) if followed is None else followed.source
        return self._follow(source, base, start, follower, wishes, ahead_s + (start - join) * self._cycle_s)

    def _requests(self, wishes: Wishes, planned: Planned, tick: int, tau: float) -> tuple[RateRequest, ...]:
        """What is asked for of a motion that is at `tau` [s] at a tick."""
        left_s = 0.0 if wishes.end_tick is None else (wishes.end_tick - tick) * self._cycle_s
        if left_s <= 0.0 or tau >= planned.motion.duration_s:
            return wishes.requests
        ending = RateRequest.ending_in(left_s, planned.motion.duration_s - tau, "ending together")
        return (*wishes.requests, ending)

    def _block(self, first_tick: int, planned: Planned, segment: Segment) -> SentBlock:
        return SentBlock(next(self._numbers), first_tick, planned, segment)

    def _governor(self, planned: Planned) -> Governor:
        known = self._governors.get(id(planned.motion))
        if known is None:
            limits = self._planner.limits
            known = planned, Governor(planned.motion, limits, self._cycle_s, self._nominal_s)
            newest = list(self._governors.items())[-2:]
            self._governors = dict([*newest, (id(planned.motion), known)])
        return known[1]
