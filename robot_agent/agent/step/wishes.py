"""What is wanted of the next block, by everyone who may want something of it."""

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import takewhile

from cell.messages import Mode
from robot_agent.agent.blocks.corrections import Corrections
from robot_agent.agent.blocks.executive import Executive
from robot_agent.agent.blocks.motion_source import MotionSource, Wishes
from robot_agent.agent.blocks.sources import CorrectedPath, GovernedPath, Jogged, Supply
from robot_agent.agent.operator.jogging import Jogging
from robot_agent.agent.planning.lookahead import Item
from robot_agent.agent.planning.plans import Planned
from robot_agent.agent.program.interruption import Interruption
from robot_agent.agent.program.pace import MANUAL_SPEED_M_S, Pace
from robot_agent.agent.program.program_run import ProgramRun
from robot_agent.agent.zones.zone_claims import ZoneClaims
from robot_agent.language import Pause, TrackingOn
from robot_agent.trajectory import Hold, RateRequest, Segment

_AHEAD_S = 0.6
"""A zone is asked for this long, plus the time to stop, before it is entered; a grant takes about 0.05 s."""


@dataclass(frozen=True, slots=True)
class Wisher:
    """Puts together what the operator, the zones, the program, its corrections and a jog want."""

    run: ProgramRun
    zones: ZoneClaims
    pace: Pace
    jogging: Jogging
    corrections: Corrections
    interruption: Interruption

    def wishes(self, mode: Mode, supply: Supply, now: float) -> Wishes:
        """For a block that is made at `now` [s]."""

        def holds(planned: Planned, segment: Segment, index: int) -> list[Hold]:
            zones = (hold for _, hold in self.zones.holds_on(planned, now))
            return [*self.pace.holds(planned, segment, index), *zones]

        if mode is Mode.RETURNING:
            return self._back_to_path(supply, now)
        correction = self.corrections.wish(supply.planner, now) if mode is Mode.RUNNING else None
        return Wishes(
            requests=tuple(self._requests(mode, now)),
            stop=mode in (Mode.ESTOP, Mode.FAULT),
            holds=holds,
            cap_m_s=self.pace.cap_m_s,
            source=self._next_source(mode, supply, corrected=correction is not None),
            not_before_tick=self.run.begins_tick,
            on_time=self.run.starting,
            end_tick=self.run.end_tick,
            correction=correction,
        )

    def _next_source(self, mode: Mode, supply: Supply, corrected: bool) -> MotionSource | None:
        """A jog, as long as there is one; else the motion that comes next in the program."""
        if self.jogging.source is not None:
            return Jogged(supply, self.jogging.source)
        follower = self.run.follower
        if mode is not Mode.RUNNING or self.corrections.waiting or self.pace.backwards or follower is None:
            return None
        return CorrectedPath(supply, follower) if corrected else GovernedPath(supply, follower)

    def _back_to_path(self, supply: Supply, now: float) -> Wishes:
        """Forwards along the way back at reduced speed, whatever direction the operator wants on the path itself."""
        requests = [RateRequest(abs(each.rate), each.who) for each in self.pace.requests]
        way = self.interruption.follower
        if not self.zones.fresh(now):
            requests.append(RateRequest(0.0, "the manager is silent"))
        return Wishes(
            requests=tuple(requests),
            stop=False,
            holds=lambda planned, _segment, _index: [hold for _, hold in self.zones.holds_on(planned, now)],
            cap_m_s=MANUAL_SPEED_M_S,
            source=None if way is None else GovernedPath(supply, way),
        )

    def wants(self, mode: Mode, executive: Executive, tick: int) -> dict[str, float]:
        """The zones that the robot crosses soon behind `tick`: zone to seconds until it is entered."""
        if mode is Mode.RETURNING:
            follower = self.interruption.follower
            return _zones_ahead(executive, () if follower is None else (follower,), tick)
        if mode is not Mode.RUNNING:
            return self.jogging.wants
        items = self._coming()
        pause_s = max(0, self.run.resume_tick - tick) * executive.cycle_s
        return self.corrections.wants | _zones_ahead(executive, items, tick, pause_s)

    def _coming(self) -> list[Item]:
        """What comes next, up to where the program waits for a part."""
        if self.corrections.waiting:
            return []
        items = self.run.lookahead.items
        return list(
            takewhile(lambda i: not (isinstance(i, TrackingOn) and self.corrections.waits_for_part(i.name)), items)
        )

    def _requests(self, mode: Mode, now: float) -> list[RateRequest]:
        requests = list(self.pace.requests)
        if not self.zones.fresh(now):
            requests.append(RateRequest(0.0, "the manager is silent"))
        if mode is not Mode.RUNNING:
            requests.append(RateRequest(0.0, "halted" if mode is Mode.HALTED else mode.value))
        if self.run.correction_ends:
            requests.append(RateRequest(0.0, "TRACK OFF"))
        return requests


def _zones_ahead(executive: Executive, items: Iterable[Item], tick: int, pause_s: float = 0.0) -> dict[str, float]:
    """The zones that are crossed soon after `tick`: zone to seconds until then; `items` are what comes next.

    The next motion does not begin within `pause_s`.
    """
    wants: dict[str, float] = {}
    block, index = executive.timeline.at(tick)
    newest = executive.timeline.newest
    ahead_s = _AHEAD_S + (newest.rest_tick - tick) * executive.cycle_s
    until_s = -block.path_segment.state(index).tau
    seen: list[object] = []
    for item in (block.path, newest.path, *items):
        if not isinstance(item, Planned) or item.motion not in (block.path.motion, newest.path.motion):
            until_s = max(until_s, pause_s)
        if isinstance(item, Pause):
            until_s += item.duration_s
        elif isinstance(item, Planned) and item.motion not in seen:
            seen.append(item.motion)
            for crossing in item.crossings:
                if until_s + crossing.leave_tau > 0.0 and until_s + crossing.enter_tau < ahead_s:
                    wants.setdefault(crossing.zone, max(0.0, until_s + crossing.enter_tau))
            until_s += item.motion.duration_s
    return wants
