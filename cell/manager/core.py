"""The cell manager as a core: who may be in which zone, and the emergency stop (`docs/architecture.md`, section 4)."""

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import replace
from math import inf

from cell.config.settings import CellSettings
from cell.core import Answer, Effect, Frozen, Publish, Request
from cell.manager.deadlock import DeadlockWatch
from cell.manager.estop_latch import EstopLatch
from cell.manager.frames import FrameNotWritten, Frames, FramesWritten
from cell.manager.meetings import Meetings
from cell.manager.occupancy import ZoneSpace
from cell.manager.presences import MOST_STRANGERS, Presences
from cell.manager.records import AssuranceEnded, JournalFailed, JournalWritten, Store, Stored, ZoneDecided
from cell.manager.separation.assurances import Sighting
from cell.manager.separation.separation import Separation, SpaceNews
from cell.manager.setup_turns import SetupTurns
from cell.manager.variables import Variables
from cell.manager.zone_changes import Over, WriteZone, ZoneChanges, ZoneNotWritten, ZonesWritten
from cell.manager.zone_turns import NOTHING, ZoneTurns
from cell.manager.zones import Intrusion, Sight, Zone
from cell.messages import (
    AdoptZone,
    Call,
    ClearSetup,
    ClearZone,
    ConfineRobot,
    EndAssurance,
    Estop,
    Event,
    GatewayState,
    Heard,
    ManagerState,
    PlaceFrame,
    PlannedWay,
    Presence,
    Refusal,
    Reply,
    ResetEstop,
    RobotStands,
    RobotVariables,
    SetEstop,
    SetZone,
    Severity,
    TeachFrame,
    Token,
    TokenGone,
    Who,
    ZoneState,
    ZoneStatus,
)

_STATE_PERIOD_S = 0.05
_GEOMETRY_PERIOD_S = 1.0
_RELEASING = (
    ResetEstop, ClearZone, AdoptZone, ClearSetup, ConfineRobot, RobotStands, PlaceFrame, TeachFrame, SetZone
)  # fmt: skip
"""What is carried out soon after it was ordered, or never."""


class ManagerCore:
    """The one manager of a cell. `epoch` must be greater than that of every manager before it (`next_epoch`)."""

    def __init__(self, settings: CellSettings, boot: str, epoch: int, stored: Stored, process: int = 0) -> None:
        """`stored` is what the journal held before this start, `process` the id that `who` answers with."""
        self._settings = settings
        self._boot = boot
        self._epoch = epoch
        self._process = process
        self._presences = Presences(boot, settings.digest, frozenset(settings.robots), settings.times.fresh_s)
        self._spaces = {name: ZoneSpace(zone) for name, zone in settings.zones.items()}
        self._zones = {name: Zone(name, zone.robots, settings.robots, epoch) for name, zone in settings.zones.items()}
        self._changes = ZoneChanges(settings, boot)
        self._turns = ZoneTurns({name: zone.priority for name, zone in settings.zones.items()})
        self._since = dict.fromkeys(settings.zones, 0.0)
        self._latch = EstopLatch(stored)
        self._setup = SetupTurns(settings.robots, boot, settings.times)
        self._deadlocks = DeadlockWatch()
        self._meetings = Meetings(settings.meetings)
        self._variables = Variables(settings.variables)
        self._frames = Frames(settings, epoch)
        kept_apart = settings.separation is not None
        self._separation = Separation(settings, boot, epoch, stored.assured) if kept_apart else None
        self._moving: tuple[str, str, PlaceFrame | TeachFrame] | None = None
        """Request, call and command of the frame that is being written."""
        self._calls: list[Request] = []
        self._effects: list[Effect] = []
        self._tokens = 0
        self._sequence = 0
        self._events = 0
        self._protective_stops = 0
        self._breaches: dict[tuple[str, str], str] = {}
        """By zone and robot: why a robot gets no grants until it is out, or an operator lets it adopt the zone."""
        self._started: float | None = None
        self._published: ManagerState | None = None
        self._state_due = self._geometry_due = 0.0

    # Messages

    def receive(self, message: object, now: float) -> None:
        """Take one message; see `cell.core`."""
        match message:
            case Presence():
                self._hear_presence(message, now)
                self._setup.heard_robot(message, now)
                self._confirmed(message.estop_acknowledged, f"robot {message.robot}", now)
            case PlannedWay() if self._separation is not None:
                self._separation.planned(message)
            case GatewayState():
                self._setup.heard_gateway(message)
                self._confirmed(message.estop, f"gateway {message.gateway}", now)
            case RobotVariables():
                self._variables.heard(message)
            case TokenGone():
                self._presences.token_gone(message)
            case Estop():
                self._set_estop(message, now)
            case Request():
                self._calls.append(message)
            case JournalFailed(reason, unsaved):
                remedy = "make room, or mend the disk: it is tried again every second; until it succeeds, a manager "
                remedy += f"that is started again does not know: {'; '.join(map(str, unsaved))}"
                self._tell(Severity.ALARM, "journal_failed", f"the journal cannot be written: {reason}", remedy)
            case JournalWritten():
                self._tell(Severity.INFO, "journal_written", "the journal is written again, nothing is missing", "")
            case FramesWritten() | FrameNotWritten():
                self._frame_written(message)
            case ZonesWritten() | ZoneNotWritten():
                self._zone_change_over(self._changes.written(message))
            case Frozen():
                self._presences.forget_echoes()

    def _hear_presence(self, presence: Presence, now: float) -> None:
        left_out = bool(self._presences.strangers_left_out)
        if self._separation is not None:
            for news in self._separation.hear(presence):
                self._tell_of_space(news, now)
        self._presences.hear(presence, lambda robot: any(robot in zone.suspects for zone in self._zones.values()), now)
        if not left_out and (names := self._presences.strangers_left_out):
            text = f"more than {MOST_STRANGERS} robots that are not in the cell file report themselves; left out: "
            remedy = "stop agents that do not belong to this cell, or start them with its cell file"
            self._tell(Severity.ALARM, "too_many_robots", text + ", ".join(sorted(names)), remedy)

    def _tell_of_space(self, news: SpaceNews, now: float) -> None:
        self._tell(news.severity, news.code, news.text, news.remedy)
        if news.stops:
            self._stop_all(news.text, now)

    def _confirmed(self, estop_id: str | None, who: str, now: float) -> None:
        effects = self._latch.heard_confirmation(estop_id, who, now)
        if effects:
            self._effects += effects
            self._tell(Severity.ALARM, "estop", f"{who} stands under emergency stop {estop_id}", "then `cell reset`")

    def _set_estop(self, estop: Estop, now: float) -> None:
        if self._latch.comes_again(estop):
            text = f"emergency stop {estop.id} by {estop.by} is NOT set: its id was cleared before, it may be a copy"
            remedy = "`cell estop` stops the cell; who sent this must give each stop a new id"
            self._tell(Severity.ALARM, "estop_over", text, remedy)
        effects = self._latch.latch(estop, now)
        if effects:
            self._effects += effects
            text = f"emergency stop by {estop.by}: {estop.reason}"
            self._tell(Severity.ALARM, "estop", text, "find the cause, then `cell reset`")

    # The cycle

    def step(self, now: float) -> list[Effect]:
        """Everything due at `now`; see `cell.core`."""
        if self._started is None:
            self._started = now
        self._presences.update(now)
        refused = self._breach_reasons() | self._presences.refused()
        sights = {name: self._presences.sights(space, refused, now) for name, space in self._spaces.items()}
        before = {name: (zone.state, zone.holder) for name, zone in self._zones.items()}
        for name, zone in self._zones.items():
            for intrusion in zone.look(sights[name], self._sequence + 1):
                self._intruded(intrusion, now)
        for request in self._calls:
            self._answer(request, sights, now)
        self._calls.clear()
        self._follow_zone_change(refused, now)
        self._turns.line_up(self._zones, sights)
        if not self._latch.in_force and self._changes.announced is None:
            going = self._presences.fresh_ones(now).keys()
            self._turns.grant(
                self._zones, sights, self._new_token, self._sequence + 1,
                lambda robot, zones: self._why_not_yet(robot, zones, going, now),
            )  # fmt: skip
        self._follow_changes(before, sights, now)
        self._follow_setup(now)
        self._follow_assurances(now)
        for deadlock in self._meetings.look(self._presences.fresh_ones(now), refused, self._cell_time(now)):
            self._tell(Severity.WARNING, "meeting_deadlock", deadlock.text, deadlock.remedy)
        kept_out = self._separation.waiting if self._separation is not None else {}
        for deadlock in self._deadlocks.look(
            self._zones, sights, kept_out, self._meetings.waiting, self._cell_time(now), now
        ):
            self._tell(Severity.WARNING, "zone_deadlock", deadlock.text, deadlock.remedy)
        self._publish_state(sights, refused, now)
        self._publish_geometry(now)
        if variables := self._variables.news():
            self._effects.append(Publish(variables))
        if self._separation is not None:
            self._tell_holders(self._separation)
            clearances, told = self._separation.clear(self._cell_time(now))
            self._effects += map(Publish, clearances)
            for news in told:
                self._tell_of_space(news, now)
        self._effects += self._latch.step(self._presences.acknowledged(now), self._presences.silent(now), now)
        effects, self._effects = self._effects, []
        return effects

    def _breach_reasons(self) -> dict[str, str]:
        self._breaches = {(z, r): why for (z, r), why in self._breaches.items() if r in self._zones[z].suspects}
        return {robot: why for (_, robot), why in self._breaches.items()}

    def _why_not_yet(self, robot: str, zones: Sequence[str], going: Collection[str], now: float) -> Refusal | None:
        """Why a robot must not have zones that are free; None: it may."""
        if self._separation is None:
            return None
        self._tell_holders(self._separation)
        return self._separation.why_not_grant(robot, zones, going, self._cell_time(now))

    def _tell_holders(self, separation: Separation) -> None:
        separation.hold({name: zone.holder for name, zone in self._zones.items()})

    def _new_token(self) -> Token:
        self._tokens += 1
        return Token(self._epoch, self._tokens)

    def _intruded(self, intrusion: Intrusion, now: float) -> None:
        whose = f", which belongs to {intrusion.other}" if intrusion.other else " without a grant"
        where = f"{intrusion.robot} {'is' if intrusion.real else 'may be'} in zone {intrusion.zone}{whose}"
        way_out = _way_out(intrusion.zone, {intrusion.robot: intrusion.known})
        if not intrusion.real:
            self._tell(Severity.WARNING, "zone_blocked", where, way_out)
            return
        self._tell(Severity.ALARM, "zone_breach", where, f"look at the robots, then `cell reset`; {way_out}")
        self._breaches[intrusion.zone, intrusion.robot] = f"{where}: {way_out}"
        self._stop_all(where, now)

    def _stop_all(self, why: str, now: float) -> None:
        """A protective stop."""
        self._protective_stops += 1
        stop_id = f"protective-{self._boot}-{self._protective_stops}"
        self._set_estop(Estop(stop_id, True, "manager", f"protective stop: {why}"), now)

    def _follow_changes(
        self,
        before: Mapping[str, tuple[ZoneState, str | None]],
        sights: Mapping[str, Mapping[str, Sight]],
        now: float,
    ) -> None:
        for name, zone in self._zones.items():
            state, holder = before[name]
            if (zone.state, zone.holder) == (state, holder):
                continue
            self._since[name] = self._cell_time(now)
            if zone.state is ZoneState.ORPHANED and state is not ZoneState.ORPHANED:
                text, remedy = f"zone {name} is blocked: {zone.reason}", "it is free once all report themselves outside"
                self._tell(Severity.WARNING, "zone_orphaned", text, f"{remedy}; {_ways_out(zone, sights[name])}")

    def _follow_setup(self, now: float) -> None:
        fresh = self._presences.fresh_ones(now)
        stopped = "an emergency stop is set: cell reset" if self._latch.in_force else ""
        if self._changes.announced is not None:
            stopped = f"zone {self._changes.announced} is being changed"

        def age(heard: Heard | None) -> float:
            return self._presences.age_of(heard, now)

        for news in self._setup.step(fresh, stopped, age, self._sequence + 1, now):
            self._tell(news.severity, news.code, news.text, news.remedy)

    def _follow_assurances(self, now: float) -> None:
        if self._separation is None:
            return
        for over in self._separation.follow(self._sightings(now), now):
            self._effects.append(Store(AssuranceEnded(over.robot)))
            severity = Severity.WARNING if over.remedy else Severity.INFO
            self._tell(severity, "assurance_over", over.text, over.remedy)

    def _sightings(self, now: float) -> dict[str, Sighting]:
        fresh = self._presences.fresh_ones(now)
        in_setup = "" if self._setup.status is None else self._setup.status.robot

        def age(heard: Heard | None) -> float:
            return self._presences.age_of(heard, now)

        robots = self._settings.robots
        return {each: Sighting(fresh.get(each), self._setup.powered(each, age), each == in_setup) for each in robots}

    # Calls

    def _answer(self, request: Request, sights: Mapping[str, dict[str, Sight]], now: float) -> None:
        call = request.call
        if not isinstance(call, Call):
            raise TypeError(f"a request carries a Call, found {type(call).__name__}")
        command = call.command
        match command:
            case SetEstop():
                self._stop_on_call(request.request_id, call.id, command, now)
            case _ if isinstance(command, _RELEASING) and (refusal := self._too_old(call, now)):
                self._effects.append(Answer(request.request_id, Reply(call.id, False, refusal)))
            case ResetEstop():
                self._reset(request.request_id, call.id, command, now)
            case ClearZone() | AdoptZone():
                ok, text = self._decide(command, sights)
                self._effects.append(Answer(request.request_id, Reply(call.id, ok, text)))
            case ClearSetup(robot, by):
                ok, text = self._setup.clear(robot, lambda heard: self._presences.age_of(heard, now))
                if ok:
                    self._tell(Severity.INFO, "setup_cleared", f"{text}, by {by}", "")
                self._effects.append(Answer(request.request_id, Reply(call.id, ok, text)))
            case ConfineRobot() | RobotStands() | EndAssurance():
                ok, text = self._assure(command, now)
                self._effects.append(Answer(request.request_id, Reply(call.id, ok, text)))
            case PlaceFrame() | TeachFrame():
                self._move_frame(request.request_id, call.id, command)
            case SetZone():
                self._change_zone(request.request_id, call.id, command, now)
            case Who():
                text = f"manager of cell {self._settings.name} (boot {self._boot}, epoch {self._epoch}, "
                text += f"process {self._process})"
                self._effects.append(Answer(request.request_id, Reply(call.id, True, text)))
            case _:
                text = f"the manager does not know the command {command.verb!r}"
                self._effects.append(Answer(request.request_id, Reply(call.id, False, text)))

    def _too_old(self, call: Call, now: float) -> str:
        """Why an order that releases something is not carried out: what its caller looked at is long over; or empty.

        A stop is never refused for its age.
        """
        age_s, allowed_s = self._presences.age_of(call.heard, now), self._settings.times.command_s
        if age_s <= allowed_s:
            return ""
        found = "no longer known" if age_s == inf else f"{age_s:.2f} s old"
        return (
            f"{call.command.verb} is too old to be carried out: it answers a state of the manager that is {found}, "
            f"{allowed_s:g} s are allowed; nothing was done: look with `cell status`, then give the order again"
        )

    def _stop_on_call(self, request_id: str, call_id: str, command: SetEstop, now: float) -> None:
        self._set_estop(Estop(command.id, True, command.by, command.reason), now)
        if self._latch.holds(command.id):
            self._latch.answer_when_stopped(request_id, call_id, "the emergency stop is set", now)
            return
        text = f"emergency stop {command.id} was cleared before and is never set again: send it under a new id"
        self._effects.append(Answer(request_id, Reply(call_id, False, text)))

    def _reset(self, request_id: str, call_id: str, command: ResetEstop, now: float) -> None:
        effects, ended = self._latch.clear(command.ids, command.by, now)
        self._effects += effects
        for estop in ended:
            text = f"emergency stop by {estop.by} ({estop.reason}) cleared by {command.by}"
            self._tell(Severity.INFO, "estop_cleared", text, "")
        if left := self._latch.in_force:
            what = f"cleared: {_named(ended)}; " if ended else "nothing is cleared; "
            text = f"{what}still in force: {_named(left)}; find the cause, then `cell reset`"
            self._effects.append(Answer(request_id, Reply(call_id, False, text)))
        elif not ended:
            self._effects.append(Answer(request_id, Reply(call_id, True, "no emergency stop was set")))
        else:
            self._latch.answer_when_dropped(request_id, call_id, f"cleared: {_named(ended)}", now)

    def _decide(self, command: ClearZone | AdoptZone, sights: Mapping[str, dict[str, Sight]]) -> tuple[bool, str]:
        zone = self._zones.get(command.zone)
        if zone is None:
            return False, f"no zone {command.zone!r}; this cell has {', '.join(sorted(self._zones)) or 'none'}"
        if isinstance(command, ClearZone):
            what, (ok, found) = "cleared", zone.clear(sights[zone.name], self._sequence + 1)
        elif refusal := self._presences.refused().get(command.robot):
            return False, f"{command.robot} gets no grants: {refusal}"
        else:
            what = f"adopted by {command.robot}"
            ok, found = zone.adopt(command.robot, sights[zone.name], self._new_token, self._sequence + 1)
        if ok:
            self._effects.append(Store(ZoneDecided(zone.name, what, command.by, found)))
            self._tell(Severity.INFO, "zone_decided", f"zone {zone.name} {what}, by {command.by}", "")
        return ok, found

    def _edited(self) -> str:
        """What is being written into the cell file, for people; empty for nothing."""
        what = "" if self._moving is None else f"frame {self._moving[2].frame} is being moved"
        if self._changes.under_way is not None:
            what = f"zone {self._changes.under_way} is being changed"
        return what and f"{what}; give the order again in a moment"

    # Changes of zones

    def _change_zone(self, request_id: str, call_id: str, order: SetZone, now: float) -> None:
        space, refusal = self._changes.planned(order)
        refusal = self._edited() or refusal
        if space is not None and not refusal:
            refused = self._breach_reasons() | self._presences.refused()
            if space.geometry != self._spaces[order.zone].geometry:
                sights = self._presences.sights(space, refused, now)
                refusal = self._changes.hindrance(self._presences.fresh_ones(now), self._zones[order.zone], sights)
                if self._setup.status is not None:
                    refusal = "; ".join(filter(None, (refusal, f"{self._setup.status.robot} is in set-up")))
                refusal = refusal and f"zone {order.zone} is not changed: {refusal}"
        if space is None or refusal:
            self._effects.append(Answer(request_id, Reply(call_id, False, refusal)))
        elif space.geometry == self._spaces[order.zone].geometry:
            self._effects.append(self._changes.unseen(request_id, call_id, order, space))
        else:
            self._changes.announce(request_id, call_id, order, space, self._sequence + 1, now)

    def _follow_zone_change(self, refused: dict[str, str], now: float) -> None:
        name, space = self._changes.announced, self._changes.space
        if name is None or space is None:
            return
        sights = self._presences.sights(space, refused, now)
        news = self._changes.step(self._presences.fresh_ones(now), self._zones[name], sights, now)
        if isinstance(news, WriteZone):
            self._effects.append(news)
        else:
            self._zone_change_over(news)

    def _zone_change_over(self, over: Over | None) -> None:
        """The cell file has the zone as ordered, and so has the cell from here on; or both have the old one."""
        if over is None:
            return
        name = over.order.zone
        if over.refusal:
            text = f"zone {name} stays as it was: {over.refusal}"
            self._effects.append(Answer(over.request_id, Reply(over.call_id, False, text)))
            return
        self._spaces[name] = ZoneSpace(self._changes.zones[name])
        self._turns.priorities = {each: settings.priority for each, settings in self._changes.zones.items()}
        self._geometry_due = 0.0
        geometry, priority = self._spaces[name].geometry, self._changes.zones[name].priority
        ranks = ", ".join(f"{robot} {n}" for robot, n in priority.items())
        text = f"zone {name}: {geometry.described()}{f', priority {ranks}' if ranks else ''}"
        self._effects.append(Store(ZoneDecided(name, "changed", over.order.by, text)))
        self._tell(Severity.INFO, "zone_changed", f"{text}, by {over.order.by}", "")
        self._effects.append(Answer(over.request_id, Reply(over.call_id, True, text, data=str(geometry.version))))

    def _assure(self, command: ConfineRobot | RobotStands | EndAssurance, now: float) -> tuple[bool, str]:
        robot = command.robot
        if robot not in self._settings.robots:
            return False, f"no robot {robot!r}; this cell has {', '.join(sorted(self._settings.robots))}"
        if self._separation is None:
            return False, f"this cell does not keep its robots apart (`separation`): nobody waits for {robot}"
        if isinstance(command, EndAssurance):
            if not self._separation.assurances.end(robot):
                return True, f"nobody has said where {robot} stays"
            self._effects.append(Store(AssuranceEnded(robot)))
            text = f"what was said of where {robot} stays counts no more"
            self._tell(Severity.INFO, "assurance_over", f"{text}, by {command.by}", "")
            return True, text
        word, text = self._separation.assurances.give(command, self._sightings(now)[robot])
        if word is not None:
            self._effects.append(Store(word))
            self._tell(Severity.INFO, "robot_assured", f"{text}; said by {command.by}", "")
        return word is not None, text

    # Frames

    def _move_frame(self, request_id: str, call_id: str, command: PlaceFrame | TeachFrame) -> None:
        refusal = self._frames.why_not(command.frame)
        refusal = self._edited() or refusal
        if refusal:
            self._effects.append(Answer(request_id, Reply(call_id, False, refusal)))
            return
        self._moving = request_id, call_id, command
        self._effects.append(self._frames.write(command))

    def _frame_written(self, outcome: FramesWritten | FrameNotWritten) -> None:
        """The cell file has the new place, and so has the cell from here on; or both have the old one."""
        if self._moving is None:
            return
        (request_id, call_id, command), self._moving = self._moving, None
        name = command.frame
        if isinstance(outcome, FrameNotWritten):
            self._effects.append(Answer(request_id, Reply(call_id, False, outcome.reason)))
            return
        way = self._frames.way(name, outcome.frames)
        moved = [other for other in self._frames.take(outcome.frames) if other != name]
        self._geometry_due = 0.0
        with_it = f", and with it {', '.join(moved)}" if moved else ""
        text = f"frame {name} moves {way}{with_it}"
        self._tell(Severity.INFO, "frame_moved", f"{text}, by {command.by}", "")
        reply = Reply(call_id, True, text, data=str(self._frames.versions[name]))
        self._effects.append(Answer(request_id, reply))

    # What is told

    def _publish_state(self, sights: Mapping[str, dict[str, Sight]], refused: Mapping[str, str], now: float) -> None:
        state = ManagerState(
            cell=self._settings.name,
            boot=self._boot,
            epoch=self._epoch,
            sequence=self._sequence + 1,
            cell_time=self._cell_time(now),
            digest=self._settings.digest,
            heard=self._presences.heard(),
            zones={name: self._status(zone, sights[name]) for name, zone in self._zones.items()},
            refused=dict(refused),
            estops=self._latch.in_force,
            setup=self._setup.status,
            setup_refused=dict(self._setup.refused),
            heard_gateways=self._setup.heard(),
            deadlocks=(
                *self._deadlocks.present,
                *self._meetings.deadlocks,
                *(self._separation.standoffs if self._separation is not None else ()),
            ),
            frames=dict(self._frames.versions),
            meetings=self._meetings.present,
            zone_change=self._changes.announced,
            assured=dict(self._separation.assurances.present) if self._separation is not None else {},
        )
        if now < self._state_due and self._published is not None and _same(state, self._published):
            return
        self._sequence += 1
        self._presences.sent_state(self._sequence, now)
        self._published = state
        self._state_due = now + _STATE_PERIOD_S
        self._effects.append(Publish(state))

    def _status(self, zone: Zone, sights: Mapping[str, Sight]) -> ZoneStatus:
        blocked = f"{zone.reason}: {_ways_out(zone, sights)}" if zone.state is ZoneState.ORPHANED else ""
        free = self._why_free(zone, sights)
        return ZoneStatus(
            zone.state,
            zone.holder,
            zone.token,
            tuple(zone.queue),
            self._spaces[zone.name].geometry.version,
            self._since[zone.name],
            blocked or free.text,
            free.by,
        )

    def _why_free(self, zone: Zone, sights: Mapping[str, Sight]) -> Refusal:
        """Why a free zone is not granted to anyone."""
        if zone.state is not ZoneState.FREE:
            return NOTHING
        if zone.awaited:
            names = ", ".join(sorted(zone.awaited))
            return Refusal("", f"no grants before {names} reported, or `cell zone clear {zone.name}`")
        if self._changes.announced is not None:
            return Refusal("", f"zone {self._changes.announced} is being changed")
        if self._latch.in_force:
            return Refusal("", "emergency stop")
        lost = [robot for robot in zone.queue if not sights[robot].known]
        if lost:
            return Refusal("", f"{', '.join(lost)} not referenced")
        return self._turns.why_free(zone.name, self._zones)

    def _publish_geometry(self, now: float) -> None:
        if now < self._geometry_due:
            return
        self._geometry_due = now + _GEOMETRY_PERIOD_S
        self._effects += [Publish(space.geometry) for space in self._spaces.values()]
        self._effects += [Publish(frame) for frame in self._frames.poses]

    def _tell(self, severity: Severity, code: str, text: str, remedy: str) -> None:
        self._events += 1
        self._effects.append(Publish(Event("manager", self._events, severity, code, text, remedy, boot=self._boot)))

    def _cell_time(self, now: float) -> float:
        return now - (self._started if self._started is not None else now)


def _ways_out(zone: Zone, sights: Mapping[str, Sight]) -> str:
    known = {robot: robot in sights and sights[robot].known for robot in sorted(zone.suspects)}
    return _way_out(zone.name, known)


def _way_out(zone: str, known: Mapping[str, bool]) -> str:
    """How an operator ends a blocked zone, in commands that do it. `known`: who may be inside; does it know where?"""
    ways = [
        f"if {robot} alone is inside: `cell zone adopt {zone} {robot}`, then it may drive out"
        if knows
        else f"let {robot} find out where it is: `cell drives` says how"
        for robot, knows in known.items()
    ]
    if len(known) > 1:
        ways.append("if more than one is inside: bring all but one out by `cell move`")
    silent = "it is silent" if len(known) == 1 else "they are silent"
    return "; ".join([*ways, f"if {silent} and you see that nobody is inside: `cell zone clear {zone}`"])


def _named(estops: Iterable[Estop]) -> str:
    return ", ".join(f"the emergency stop by {estop.by} ({estop.reason})" for estop in estops)


def _same(new: ManagerState, old: ManagerState) -> bool:
    """Nothing has changed that somebody waits for."""
    if _boots(new) != _boots(old):
        return False
    same = replace(new, sequence=old.sequence, cell_time=old.cell_time, heard=old.heard)
    return replace(same, heard_gateways=old.heard_gateways) == old


def _boots(state: ManagerState) -> list[dict[str, str]]:
    echoes = (state.heard, state.heard_gateways)
    return [{name: heard.boot for name, heard in echo.items()} for echo in echoes]
