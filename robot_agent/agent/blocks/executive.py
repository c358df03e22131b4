"""From motions to set-point blocks: which one comes next, where it joins, and what body it implies."""

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from cell.config.settings import Times
from cell.messages import Body, DriveFeedback, OutputEvent, SetpointBlock
from robot_agent.agent.blocks.motion_source import Join, SentBlock, Wishes
from robot_agent.agent.blocks.sources import GovernedPath, Supply
from robot_agent.agent.blocks.timeline import Timeline
from robot_agent.agent.drives.axes import samples_in_axes, torques_in_axes
from robot_agent.agent.planning.passed import Passed, Piece, Span
from robot_agent.agent.planning.planner import Planner
from robot_agent.agent.planning.plans import Planned
from robot_agent.dynamics import AxisTorques
from robot_agent.kinematics import OpenMechanism
from robot_agent.workspace import FOLLOWING_M, Sweep, body_message, sweep, unknown_body

_MEASURED_LAG_S = 0.1
"""How far behind the commanded position the measured one is searched for."""


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
        self.cycle_s = planner.cycle_s
        self._lead = math.ceil(times.lead_s / self.cycle_s)
        self._owner = feedback.owner
        self._numbers = numbers
        self._torques = torques
        self.supply = Supply(planner, times.nominal_s)
        self._standing: tuple[Span, Sweep] | None = None
        """Where it stood last, and its body there."""
        self._told: tuple[list[Piece], float, Body] | None = None
        """The newest body, of which pieces of motions, and how much it is widened: one that stands has the same."""
        self._rested: tuple[NDArray[np.float64], float] | None = None
        """Joints commanded and measured `(2, n)` of one that stood last, and how far its bodies are apart there [m]."""
        self.timeline = Timeline(self._resting(feedback.block, feedback.tick, standing, 0.0))
        self._left_tick = feedback.tick
        """What was commanded before it lies behind the robot."""

    def stand(self, standing: Planned, tick: int, tau: float = 0.0) -> None:
        """Forget the motion in which the robot stands still since before `tick`.

        It stands at `tau` [s] of `standing` instead, which is the same place.
        """
        self.timeline = Timeline(self._resting(self.timeline.newest.sequence, tick, standing, tau))

    def _resting(self, sequence: int, tick: int, planned: Planned, tau: float) -> SentBlock:
        segment = self.supply.governor(planned.motion).rest(tau)
        return SentBlock(sequence, tick, GovernedPath(self.supply, planned), planned, segment)

    @property
    def at_motion_end(self) -> bool:
        """Whether the newest accepted block ends where its motion ends."""
        return self.timeline.newest.at_motion_end

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
        return max(1, last - tick) * self.cycle_s

    def next_block(self, feedback: DriveFeedback, age_s: float, wishes: Wishes) -> SentBlock:
        """The block to send now; it continues the newest accepted one and ends at rest."""
        base = self.timeline.newest
        tick = max(feedback.tick + int(age_s / self.cycle_s) + self._lead, base.first_tick)
        ahead_s = (tick - feedback.tick) * self.cycle_s - age_s
        join = Join(base, tick, self.timeline.path_rest_tick, ahead_s, next(self._numbers), wishes)
        source = wishes.source
        if source is None or not source.begin(join):
            source = base.source
            source.resume(join)
        return source.brake() if wishes.stop else source.samples()

    def sent(
        self, block: SentBlock, events: tuple[OutputEvent, ...] = (), program: bool = False, epoch: int = 0
    ) -> SetpointBlock:
        """Note that a block is sent with these events, and give its message, whose nominal part contains them.

        `program`: a program runs; `epoch`: the highest of a manager that is known.
        """
        follows = self.timeline.newest.sequence
        self.timeline.sent(replace(block, events=events))
        segment = block.segment
        nominal = max([segment.nominal, *(event.tick - block.first_tick + 1 for event in events)])
        rows = np.minimum(np.arange(max(segment.length, nominal)), segment.length - 1)
        position, velocity = samples_in_axes(self._planner.model.coupling, segment.q[rows], segment.qd[rows])
        torque = torques_in_axes(self._torques, segment)
        return SetpointBlock(
            self._robot, self._owner, block.sequence, follows, block.first_tick, self.cycle_s, nominal,
            position, velocity, None if torque is None else torque[rows], events, program, epoch,
        )  # fmt: skip

    def passed(self, feedback: DriveFeedback, candidate: SentBlock | None) -> Passed:
        """All between the measured position and rest, for what was sent and for `candidate`."""
        measured = self._measured(feedback)
        if measured is None:
            unknown = unknown_body(self._planner.model, self._planner.pose_world_base)
            return Passed(unknown, [], [], 0.0, self._left_tick)
        tick, widen_m = measured
        spans = self.timeline.spans(tick, candidate)
        pieces = [self._piece(span) for span in spans]
        return Passed(self._body(pieces, widen_m), spans, pieces, widen_m, tick)

    def leave(self, passed: Passed) -> None:
        """Whatever it may not pass by this lies behind it, and is searched no more: it has been told and given back."""
        self._left_tick = passed.from_tick

    def _piece(self, span: Span) -> Piece:
        return (self._stood(span), 0, 0) if span.stands else (span.planned.sweep, *span.samples)

    def _body(self, pieces: list[Piece], widen_m: float) -> Body:
        if self._told is None or self._told[:2] != (pieces, widen_m):
            body = body_message(self._planner.model, self._planner.pose_world_base, pieces, widen_m)
            self._told = pieces, widen_m, body
        return self._told[2]

    def _stood(self, span: Span) -> Sweep:
        """Exactly where the robot stands: not grown to the samples around it, which a zone may begin between."""
        known = self._standing
        if known is None or known[0].planned.motion is not span.planned.motion or known[0].last_tau != span.last_tau:
            q = span.planned.motion.q(np.array([span.last_tau]))
            known = self._standing = span, sweep(self._planner.model, self._planner.pose_world_base, q)
        return known[1]

    def _measured(self, feedback: DriveFeedback) -> tuple[int, float] | None:
        """After which tick it was commanded to where it is measured, and how far bodies are apart [m].

        Nearest is a place on the straight way from a tick's to the next one's; capsule ends and TCP go it together.
        Where a way comes back to where it was, the robot may be on the way there or on the way back. It is on the first
        one within its following budget until that lies behind it.
        """
        if not feedback.referenced:
            return None
        earliest = max(feedback.tick - int(_MEASURED_LAG_S / self.cycle_s), self._left_tick)
        first_tick = min(earliest, feedback.tick)
        commanded = self.timeline.commanded(first_tick, feedback.tick)
        if (commanded == commanded[0]).all():  # it stands, as it does most of the time
            commanded = commanded[:1]
        joints = np.vstack([commanded, feedback.position])
        if self._rested is not None and np.array_equal(joints, self._rested[0]):
            return first_tick, self._rested[1]
        try:
            points = self._planner.model.body_and_tcp(joints)
        except OpenMechanism:
            return None
        away = points[-1] - points[:-1]
        steps = points[1:-1] - points[:-2]
        along = np.einsum("mcek,mcek->m", away[:-1], steps)
        whole = np.einsum("mcek,mcek->m", steps, steps)
        share = (along / np.where(whole > 0.0, whole, 1.0)).clip(0.0, 1.0)
        away[:-1] -= share[:, None, None, None] * steps
        distances = np.sqrt(np.einsum("mcek,mcek->mce", away, away).max(axis=(1, 2)))
        least = float(distances.min())
        self._rested = (joints, least) if len(commanded) == 1 else None
        near = int(np.argmax(distances <= max(least, FOLLOWING_M)))
        departs = np.flatnonzero(distances[near + 1 :] > distances[near:-1])
        coming = distances[near : near + int(departs[0]) + 1] if len(departs) else distances[near:]
        return first_tick + near + int(np.argmin(coming)), least
