"""What a robot does in a mode: it stands, runs its program, is jogged, or goes back to its path.

Each of these says what it wants of the next block, which zones it comes to, and why the robot stands. They look at what
the agent knows and change nothing.
"""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from itertools import takewhile

from cell.messages import Mode, Sections
from robot_agent.agent.blocks.corrections import Corrections
from robot_agent.agent.blocks.executive import Executive
from robot_agent.agent.blocks.motion_source import MotionSource, SentBlock, Wishes
from robot_agent.agent.blocks.sources import CorrectedPath, GovernedPath, Jogged, Supply
from robot_agent.agent.mode import stopped
from robot_agent.agent.operator.jogging import Jogging
from robot_agent.agent.parameters import MANUAL_SPEED_M_S
from robot_agent.agent.planning.lookahead import Item
from robot_agent.agent.planning.planner import Planner
from robot_agent.agent.planning.plans import Planned
from robot_agent.agent.program.interruption import Interruption
from robot_agent.agent.program.pace import Pace
from robot_agent.agent.program.program_run import ProgramRun
from robot_agent.agent.space.shared_space import SharedSpace, onward
from robot_agent.agent.zones.zone_claims import ZoneClaims
from robot_agent.language import AwaitAnswer, AwaitInput, Decide, Meet, Pause, TrackingOn
from robot_agent.trajectory import Hold, RateRequest, Segment
from robot_agent.workspace import BACKING_RATE, with_entry

_AHEAD_S = 0.6
"""A zone is asked for this long, plus the time to stop, before it is entered; a grant takes about 0.05 s."""
_SPACE_AHEAD_S = 0.2
"""So much of a motion is asked for beyond where the robot would come to rest; an answer takes about 0.03 s."""
_BEFORE_A_START_S = 0.3
"""So long before a pause ends the space of the next motion is asked for."""


@dataclass(frozen=True, slots=True)
class Cause:
    """For people; empty while the robot moves, and where it has nothing to do."""

    text: str
    zone: str = ""
    """The zone that it waits for, where it is that."""


@dataclass(frozen=True, slots=True)
class Standing:
    """Nobody moves it, or it brakes: halted, switched off, in a fault."""

    mode: Mode
    run: ProgramRun
    zones: ZoneClaims
    pace: Pace
    jogging: Jogging
    corrections: Corrections
    interruption: Interruption
    space: SharedSpace

    def wishes(self, executive: Executive, now: float) -> Wishes:
        """For a block that is made at `now` [s]."""

        def holds(planned: Planned, segment: Segment, index: int) -> list[Hold]:
            tau = segment.state(index).tau
            return [*self.pace.holds(planned, segment, index), *self._zone_holds(planned, tau, now)]

        jog = self.jogging.source
        return Wishes(
            requests=tuple(self._requests(now)),
            stop=stopped(self.mode),
            holds=holds,
            cap_m_s=self.pace.cap_m_s,
            source=None if jog is None else Jogged(executive.supply, jog),
        )

    def wants(self, _executive: Executive, _tick: int) -> dict[str, float]:
        """The zones that the robot comes to soon after a tick: zone to seconds until it is entered."""
        return self.jogging.wants

    def ahead(self, _newest: SentBlock, _planner: Planner, _tick: int, _now: float) -> Sections | None:
        """The sections that come after those that `newest` passes up to rest, in the order of travel.

        None where the robot is to stay within what it uses already.
        """
        return None

    def reason(self, executive: Executive | None, tick: int, now: float) -> Cause:
        """Why it stands, or jogs slower than wished."""
        at_rest = executive is None or executive.at_rest(tick)
        if self.zones.kept_still and at_rest:
            return Cause(self.zones.kept_still)
        return self._reason(executive if at_rest else None, tick, now)

    def _reason(self, _resting: Executive | None, _tick: int, now: float) -> Cause:
        """The same where nobody keeps it still; `resting` is None where it moves or its drives are off."""
        return Cause(self.corrections.problem(now) if self.mode is Mode.HALTED else "")

    def _requests(self, now: float) -> list[RateRequest]:
        requests = list(self.pace.requests)
        if not self.zones.fresh(now):
            requests.append(RateRequest(0.0, "the manager is silent"))
        if self.mode is not Mode.RUNNING:
            requests.append(RateRequest(0.0, "halted" if self.mode is Mode.HALTED else self.mode.value))
        if self.space.beside_path:
            requests.append(RateRequest(0.0, "the robot is measured beside its path"))
        if self.run.correction_ends:
            requests.append(RateRequest(0.0, "TRACK OFF"))
        if self.pace.backwards and self.space.kept_apart:
            requests.append(RateRequest(-BACKING_RATE, "robots are kept apart"))
        return requests

    def _zone_holds(self, planned: Planned, tau: float, now: float) -> list[Hold]:
        return [hold for _, hold in self._closed(planned, tau, now)]

    def _closed(self, planned: Planned, tau: float, now: float) -> list[tuple[str, Hold]]:
        """What of a motion may not be entered now from `tau` [s], with the zone where it is that."""
        return [*self.zones.holds_on(planned, tau, now), *self.space.holds_on(planned, self.corrections.beside_m)]

    def _way_on(self, newest: SentBlock, following: Planned | None, now: float) -> Sections:
        """Along what `newest` is on and what follows it, as far as may be asked for and no zone or input is closed."""
        path, stop, beside_m = newest.path, newest.path_segment.stop_tau, self.corrections.beside_m
        until, ends = stop + _SPACE_AHEAD_S, path.motion.duration_s
        some = Sections()
        if stop < ends:
            until = self._free_until(path, stop, until, now)
            some = onward(path, beside_m, stop, min(until, ends))
        if following is None or following.motion is path.motion or until <= ends:
            return some
        farther = self._free_until(following, 0.0, until - ends, now)
        return some.joined(onward(following, beside_m, 0.0, farther)) if farther > 0.0 else some

    def _free_until(self, planned: Planned, tau: float, until: float, now: float) -> float:
        return min([until, *(hold.tau for _, hold in self.zones.holds_on(planned, tau, now) if hold.until > tau)])

    def _may_move(self, now: float) -> bool:
        return all(request.rate != 0.0 for request in self._requests(now))


class BeingJogged(Standing):
    """An operator's jog key moves it."""

    def ahead(self, newest: SentBlock, planner: Planner, tick: int, _now: float) -> Sections | None:
        return self.jogging.ahead(planner, newest.segment.q[-1], newest.rest_tick <= tick)

    def _reason(self, _resting: Executive | None, _tick: int, _now: float) -> Cause:
        source = self.jogging.source
        if source is None:
            return Cause("")
        return Cause(source.ruled_by if source.held else self.jogging.ended_by)


class Running(Standing):
    """Its program moves it."""

    def wishes(self, executive: Executive, now: float) -> Wishes:
        correction = self.corrections.wish(executive.supply.planner, now)
        path = executive.timeline.newest.path
        return replace(
            super().wishes(executive, now),
            source=self._next(executive.supply, path, corrected=correction is not None),
            not_before_tick=0 if self.pace.backwards else self.run.begins_tick(path),
            on_time=self.run.starting,
            end_tick=self.run.end_tick,
            correction=correction,
        )

    def ahead(self, newest: SentBlock, _planner: Planner, tick: int, now: float) -> Sections | None:
        if not self._may_move(now) or self.zones.kept_still:
            return None
        if self.pace.backwards:
            return self._way_back(newest)
        waits_s = (self.run.begins_tick(newest.path) - tick) * newest.planned.motion.cycle_s
        waits = waits_s > _BEFORE_A_START_S or bool(self.corrections.waiting)
        return self._way_on(newest, None if waits else self.run.follower(newest.path), now)

    def _way_back(self, newest: SentBlock) -> Sections:
        """As far back as may be asked for, along what `newest` is on and what came before it."""
        path, stop, beside_m = newest.path, newest.path_segment.stop_tau, self.corrections.beside_m
        some = onward(path, beside_m, stop, stop - _SPACE_AHEAD_S)
        before = self.run.before(path) if stop < _SPACE_AHEAD_S else None
        if before is None:
            return some
        ends = before.motion.duration_s
        return some.joined(onward(before, beside_m, ends, ends + stop - _SPACE_AHEAD_S))

    def _next(self, supply: Supply, path: Planned, corrected: bool) -> MotionSource | None:
        """What moves the robot next from the end of a motion, or backwards from its beginning."""
        if self.pace.backwards:
            before = self.run.before(path)
            return None if before is None else GovernedPath(supply, before, backwards=True)
        follower = self.run.follower(path)
        if follower is None or self.corrections.waiting:
            return None
        return CorrectedPath(supply, follower) if corrected else GovernedPath(supply, follower)

    def wants(self, executive: Executive, tick: int) -> dict[str, float]:
        if self.pace.override == 0.0 and executive.path_at_rest(tick):
            return self.corrections.wants
        path = executive.timeline.newest.path
        pause_s = max(0, self.run.begins_tick(path) - tick) * executive.cycle_s
        wants = self.corrections.wants | _zones_ahead(executive, self._coming(path), tick, pause_s)
        later = self._asked_for_later()
        return {zone: entered_s for zone, entered_s in wants.items() if zone not in later}

    def _asked_for_later(self) -> frozenset[str]:
        """Zones in which its plan ends while more is being planned: it may need another one to come out of them."""
        planning = self.run.lookahead.plans_more
        return self.space.outlook.ends_in - self.zones.holds.keys() if planning else frozenset()

    def _coming(self, path: Planned) -> list[Item]:
        """What comes next, up to where the program waits, or is decided: others may need a zone to come there."""
        if self.corrections.waiting:
            return []
        coming = takewhile(lambda item: not self._waits(item), self.run.lookahead.items)
        return [*self.run.trail.after(path), *coming]

    def _waits(self, item: Item) -> bool:
        part = isinstance(item, TrackingOn) and self.corrections.waits_for_part(item.name)
        return part or isinstance(item, Meet | AwaitInput | AwaitAnswer | Decide)

    def _reason(self, resting: Executive | None, tick: int, now: float) -> Cause:
        if resting is None:  # what it follows may move it while its program waits
            return Cause(self.run.held_up if self.run.at_wait is not None else "")
        path = resting.timeline.newest.path
        if self.pace.backwards:
            return self._held_back_backwards(resting.timeline.newest, now)
        why = self.run.why_idle(path, tick, resting.cycle_s) or self.corrections.waiting
        return Cause(why) if why else self._held_back(resting, self.run.follower(path), self.pace.override, now)

    def _held_back(self, executive: Executive, follower: Planned | None, override: float, now: float) -> Cause:
        """Who holds it back on its path or in front of the next motion."""
        if not self.zones.fresh(now):
            return Cause(self.zones.silence)
        if follower is None and self.zones.unheard:
            return self._unheard
        newest = executive.timeline.newest
        if newest.followed is not None and newest.segment.ruled_by:
            return Cause(newest.segment.ruled_by)
        motion, tau = newest.path, newest.path_segment.stop_tau
        if executive.at_motion_end and follower is not None:
            motion, tau = follower, 0.0
        if override == 0.0:
            return Cause(self.pace.requests[0].who)
        blocking = [held for held in self._closed(motion, tau, now) if held[1].until > tau]
        if not blocking:
            return Cause("")
        zone, hold = min(blocking, key=lambda held: held[1].tau)
        return Cause(hold.who, zone)

    def _held_back_backwards(self, newest: SentBlock, now: float) -> Cause:
        """Who holds it on its way back, in a motion or at the beginning of one, by what is known now."""
        if not self.zones.fresh(now):
            return Cause(self.zones.silence)
        motion, tau = newest.path, newest.path_segment.stop_tau
        asked = (each.who for each in self._requests(now) if each.rate == 0.0)
        if why := next(asked, "") or self.pace.forgotten(motion, tau):
            return Cause(why)
        if newest.at_motion_begin:
            before = self.run.before(motion)
            if before is None:
                return Cause(f"{self.pace.requests[0].who}: at the beginning of what is kept of its path")
            motion, tau = before, before.motion.duration_s
        blocking = [held for held in self._closed(motion, tau, now) if held[1].tau < tau]
        if not blocking:
            return Cause("")
        zone, hold = max(blocking, key=lambda held: held[1].until)
        return Cause(hold.who, zone)

    @property
    def _unheard(self) -> Cause:
        names = ", ".join(self.zones.unheard)
        return Cause(f"the manager has not said yet where zone {names} is, and nothing is planned before")


class Returning(Running):
    """It goes back to the path of its interrupted program."""

    def wishes(self, executive: Executive, now: float) -> Wishes:
        """Forwards along the way back at reduced speed, whatever direction the operator wants on the path itself."""
        way = self.interruption.follower
        requests = [RateRequest(abs(each.rate), each.who) for each in self.pace.requests]
        if not self.zones.fresh(now):
            requests.append(RateRequest(0.0, "the manager is silent"))
        return Wishes(
            requests=tuple(requests),
            stop=False,
            holds=lambda planned, segment, index: self._zone_holds(planned, segment.state(index).tau, now),
            cap_m_s=MANUAL_SPEED_M_S,
            source=None if way is None else GovernedPath(executive.supply, way),
        )

    def ahead(self, newest: SentBlock, _planner: Planner, _tick: int, now: float) -> Sections | None:
        if not self.zones.fresh(now) or self.zones.kept_still or self.pace.override == 0.0:
            return None
        return self._way_on(newest, self.interruption.follower, now)

    def wants(self, executive: Executive, tick: int) -> dict[str, float]:
        way = self.interruption.follower
        return _zones_ahead(executive, () if way is None else (way,), tick)

    def _reason(self, resting: Executive | None, _tick: int, now: float) -> Cause:
        way = self.interruption.follower
        if resting is None:
            return Cause("")
        if way is None:
            return self._unheard if self.zones.unheard else Cause(self.interruption.waiting)
        return self._held_back(resting, way, abs(self.pace.override), now)


Parts = tuple[ProgramRun, ZoneClaims, Pace, Jogging, Corrections, Interruption, SharedSpace]
_DOING = {Mode.RUNNING: Running, Mode.JOGGING: BeingJogged, Mode.RETURNING: Returning}


def doing(parts: Parts, mode: Mode) -> Standing:
    """What a robot does in a mode."""
    return _DOING.get(mode, Standing)(mode, *parts)


def _zones_ahead(executive: Executive, items: Iterable[Item], tick: int, pause_s: float = 0.0) -> dict[str, float]:
    """The zones that are crossed soon after `tick`: zone to seconds until then; `items` are what comes next.

    Zones between which the robot cannot stop have the same seconds, those until the first of them is entered.
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
            for crossing, entry in with_entry(item.crossings):
                if until_s + crossing.leave_tau > 0.0 and until_s + entry < ahead_s:
                    entered_s = until_s + (entry if until_s + entry >= 0.0 else crossing.enter_tau)
                    wants.setdefault(crossing.zone, max(0.0, entered_s))
            until_s += item.motion.duration_s
    return wants
