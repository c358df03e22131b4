"""Zones: who may enter, who gives them away, and on what ground."""

from collections import defaultdict
from dataclasses import dataclass
from math import inf

from cell.core import Request
from cell.messages import (
    AdoptZone,
    Call,
    ClearZone,
    Event,
    ManagerState,
    Presence,
    Reply,
    SetpointBlock,
    Token,
    ZoneGeometry,
    ZoneState,
    ZoneStatus,
)
from tests.sim.judge.facts import Facts, Shown
from tests.sim.judge.invariant import Handlers, Invariant

_WITHIN_M = 1e-3
_LAGS_S = 0.1
"""So long after the last block that it was sent under a grant a robot that lags after it may still widen its body."""
_HELD = (ZoneState.GRANTED, ZoneState.OCCUPIED)


class NoBreach(Invariant):
    """No robot is ever in a zone without a grant, also in the manager's eyes. But one that its drives brake may come
    anywhere, and an operator may free a zone of which a robot that was not heard says that it may still be inside."""

    name = "no breach"

    def __init__(self, facts: Facts) -> None:
        super().__init__(facts)
        self._since: dict[tuple[str, str], float] = {}
        """Since when the bodies that a robot publishes touch a zone."""
        self._known: set[tuple[str, str]] = set()
        """Of these it was told before; a manager that is started anew tells it once more."""

    @property
    def published(self) -> Handlers:
        return {Event: self._event, Presence: self._presence}

    def _presence(self, _: str, presence: Presence) -> None:
        shown = self.facts.seen(presence)
        for zone, box in self.facts.boxes.items():
            if shown.touches(zone, box):
                self._since.setdefault((presence.robot, zone), self.facts.now)
            else:
                self._since.pop((presence.robot, zone), None)
                self._known.discard((presence.robot, zone))

    def _event(self, process: str, event: Event) -> None:
        if event.code != "zone_breach":
            return
        robot, _, rest = event.text.partition(" is in zone ")
        if robot not in self.facts.robots:
            return
        zone = rest.partition(",")[0].removesuffix(" without a grant")
        decided = [
            at
            for at, call in self.facts.told["manager"].calls
            if isinstance(call.command, AdoptZone | ClearZone) and call.command.zone == zone
        ]
        if (robot, zone) in self._known or (decided and self._since.get((robot, zone), inf) < decided[-1]):
            return
        feedback = self.facts.feedback.get(robot)
        if (feedback is None or feedback.enabled) and not self.facts.hindered(robot):
            self.broken(process, event.text)
        self._known.add((robot, zone))


class EntersByFreshGrant(Invariant):
    """The published body, and so all that a robot is sent, comes into a zone only while the newest manager state that
    its agent was told names it holder, by the token that it says it holds; and that state answers a presence that was
    sent less than the age limit ago. A robot that its drives brake may come anywhere; one that ends within what its
    body was before stays in what that touched, though its body, worked out anew each time, may touch less in between.
    """

    name = "enters by a fresh grant"

    def __init__(self, facts: Facts) -> None:
        super().__init__(facts)
        self._touched: dict[str, set[str]] = {}
        """The zones that a robot has touched since it leads nowhere else."""

    @property
    def published(self) -> Handlers:
        return {Presence: self._presence}

    def _presence(self, _: str, presence: Presence) -> None:
        robot, facts = presence.robot, self.facts
        before, feedback = facts.shown.get(robot), facts.feedback.get(robot)
        touched = self._touched.pop(robot, set())
        if before is None or before.message.boot != presence.boot or feedback is None or not feedback.enabled:
            return
        if not before.message.body.known or not presence.body.known or facts.hindered(robot):
            return
        shown = facts.seen(presence)
        if before.misses(shown.poses[-1:], presence.body.tcp_m[-1:].astype(float)).max(initial=0.0) > _WITHIN_M:
            touched = set()
        touched.update(zone for zone, box in facts.boxes.items() if before.touches(zone, box))
        for zone in {zone for zone, box in facts.boxes.items() if shown.touches(zone, box)} - touched:
            self._entered(robot, zone, presence)
        self._touched[robot] = touched

    def _entered(self, robot: str, zone: str, presence: Presence) -> None:
        facts = self.facts
        manager = facts.told[f"robot/{robot}"].manager
        status = manager.zones.get(zone) if manager is not None else None
        if status is None or status.holder != robot or status.state not in (ZoneState.GRANTED, ZoneState.OCCUPIED):
            self.broken(robot, f"its body comes into zone {zone}; the newest manager state does not grant it")
        if presence.holds.get(zone) != status.token:
            self.broken(robot, f"its body comes into zone {zone}, granted by {status.token}, held is {presence.holds}")
        age = facts.manager_age(robot)
        if age > facts.cell.times.fresh_s + _LAGS_S:
            self.broken(robot, f"its body comes into zone {zone} by a manager state that is {age:.3f} s old")


class NothingLeadsIn(Invariant):
    """No block for drives that are on leaves with a presence whose body comes into a zone that the newest manager state
    does not grant, or that state is old; whatever becomes of the drives."""

    name = "no block leads into a zone without a grant"

    def __init__(self, facts: Facts) -> None:
        super().__init__(facts)
        self._into: dict[str, tuple[float, str]] = {}
        """When a robot has published a body that comes into a zone without a grant, and into which."""

    @property
    def published(self) -> Handlers:
        return {Presence: self._presence, SetpointBlock: self._block}

    def _presence(self, _: str, presence: Presence) -> None:
        robot, facts = presence.robot, self.facts
        before, shown = facts.shown.get(robot), facts.seen(presence)
        if before is None or before.message.boot != presence.boot:
            return
        for zone, box in facts.boxes.items():
            if shown.touches(zone, box) and not before.touches(zone, box) and not self._granted(presence, zone):
                self._into[robot] = facts.now, zone

    def _granted(self, presence: Presence, zone: str) -> bool:
        manager = self.facts.told[f"robot/{presence.robot}"].manager
        status = manager.zones.get(zone) if manager is not None else None
        if status is None or status.holder != presence.robot or status.state not in _HELD:
            return False
        return presence.holds.get(zone) == status.token and self.facts.manager_fresh(presence.robot)

    def _block(self, _: str, block: SetpointBlock) -> None:
        at, zone = self._into.get(block.robot, (-inf, ""))
        feedback = self.facts.feedback.get(block.robot)
        if at == self.facts.now and feedback is not None and feedback.enabled:
            self.broken(block.robot, f"block {block.sequence} leads into zone {zone}, which it is not granted")


class HoldsWhatIsGranted(Invariant):
    """A robot that hears the manager, and knows where a zone is and that it is outside, holds no grant of it but the
    one that it is told."""

    name = "an agent holds only what it is granted"
    _YOUNG_S = 0.03
    """So much younger than the age limit the manager's state has to be, so that nobody can take it for old."""

    def __init__(self, facts: Facts) -> None:
        super().__init__(facts)
        self._placed: set[tuple[str, str]] = set()
        """Boots, and the zones of which they have heard where they are."""

    @property
    def delivered(self) -> Handlers:
        return {ZoneGeometry: self._geometry}

    @property
    def published(self) -> Handlers:
        return {Presence: self._presence}

    def _geometry(self, name: str, geometry: ZoneGeometry) -> None:
        self._placed.add((self.facts.told[name].boot, geometry.zone))

    def _presence(self, name: str, presence: Presence) -> None:
        facts = self.facts
        manager = facts.told[name].manager
        if manager is None or facts.manager_age(presence.robot) > facts.cell.times.fresh_s - self._YOUNG_S:
            return
        before = facts.shown.get(presence.robot)
        if before is None or before.message.boot != presence.boot:
            return
        for zone, token in presence.holds.items():
            status = manager.zones[zone]
            mine = status.holder == presence.robot and status.token == token
            placed = (presence.boot, zone) in self._placed
            if placed and not mine and not facts.seen(presence).touches(zone, facts.boxes[zone]):
                told = f"{status.state.value}, held by {status.holder or 'nobody'} by {status.token}"
                self.broken(presence.robot, f"it holds zone {zone} by {token} and is outside; it was told {told}")


class KeepsWhileInside(Invariant):
    """A robot that holds a zone goes on holding it, by this token or a newer one, while its body is inside."""

    name = "an agent holds a zone while it is inside"

    @property
    def published(self) -> Handlers:
        return {Presence: self._presence}

    def _presence(self, _: str, presence: Presence) -> None:
        before = self.facts.shown.get(presence.robot)
        if before is None or before.message.boot != presence.boot:
            return
        for zone in before.message.holds.keys() - presence.holds.keys():
            if self.facts.seen(presence).touches(zone, self.facts.boxes[zone]):
                self.broken(presence.robot, f"it does not hold zone {zone} any more, and its body is inside")


class GivenUpStaysGivenUp(Invariant):
    """A token that a robot knew and did not hold in a presence with its body outside is never held by it again."""

    name = "a token given up is never taken again"

    def __init__(self, facts: Facts) -> None:
        super().__init__(facts)
        self._dead: dict[tuple[str, str], Token] = {}

    @property
    def published(self) -> Handlers:
        return {Presence: self._presence}

    def _presence(self, name: str, presence: Presence) -> None:
        told = self.facts.told[name]
        for zone, token in presence.holds.items():
            if self._dead.get((presence.boot, zone)) == token:
                self.broken(presence.robot, f"it holds {token} of zone {zone} again after it gave it up")
        for zone, status in told.manager.zones.items() if told.manager is not None else ():
            mine = status.holder == presence.robot and status.token is not None and zone not in presence.holds
            if mine and not self.facts.seen(presence).touches(zone, self.facts.boxes[zone]):
                self._dead[presence.boot, zone] = status.token


@dataclass(frozen=True, slots=True)
class ZoneNews:
    """What a manager says of a zone, and what it said before."""

    zone: str
    state: ManagerState
    status: ZoneStatus
    before: ZoneStatus | None
    """In the state before, of the same manager."""
    decided: bool
    """An operator's decision on the zone has reached the manager between the two."""


class _OfManager(Invariant):
    """Compares each state of a manager with the one before, in view of what the manager was told by then."""

    def __init__(self, facts: Facts) -> None:
        super().__init__(facts)
        self._decided_at: dict[str, float] = {}
        """When an operator's decision on a zone last reached the present manager."""

    @property
    def published(self) -> Handlers:
        return {ManagerState: self._state}

    def _state(self, _: str, state: ManagerState) -> None:
        before = self.facts.manager
        if before is not None and before.boot != state.boot:
            before = None
        since = -inf if before is None else self.facts.sent[before.boot, before.sequence]
        calls = [call.command for at, call in self.facts.told["manager"].calls if at >= since]
        decided = {command.zone for command in calls if isinstance(command, AdoptZone | ClearZone)}
        if before is not None:  # of what a living robot holds nobody decides
            decided -= {zone for zone, status in before.zones.items() if status.state in _HELD}
        for zone, status in state.zones.items():
            if zone in decided:
                self._decided_at[zone] = self.facts.now
            self.judge(ZoneNews(zone, state, status, None if before is None else before.zones[zone], zone in decided))

    def lived(self, name: str, what: str) -> None:
        if name == "manager" and what == "started":
            self._decided_at.clear()
            self.restarted()

    def restarted(self) -> None:
        """A manager was started."""

    def judge(self, news: ZoneNews) -> None:
        """One zone of the newest state."""
        raise NotImplementedError


class BreachStops(Invariant):
    """A robot in a zone that is not its own is a protective stop."""

    name = "a breach is a stop"

    def __init__(self, facts: Facts) -> None:
        super().__init__(facts)
        self._told = ""

    @property
    def published(self) -> Handlers:
        return {Event: self._event, ManagerState: self._state}

    def _event(self, _: str, event: Event) -> None:
        if event.code == "zone_breach":
            self._told = event.text

    def _state(self, name: str, state: ManagerState) -> None:
        told, self._told = self._told, ""
        if told and not state.estops:
            self.broken(name, f"{told}; no emergency stop is in force")


class GrantsAreDue(_OfManager):
    """A zone is granted only after every robot has reported or an operator decided, to a robot that lately asked for
    it and was heard, and never under an emergency stop."""

    name = "grants are due"

    def __init__(self, facts: Facts) -> None:
        super().__init__(facts)
        self._reported: dict[str, set[str]] = defaultdict(set)
        """By boot of a manager: robots that have answered it once."""

    @property
    def delivered(self) -> Handlers:
        return {Presence: self._presence}

    def _presence(self, name: str, presence: Presence) -> None:
        if name == "manager" and presence.heard is not None:
            self._reported[presence.heard.boot].add(presence.robot)

    def judge(self, news: ZoneNews) -> None:
        zone, state, status, before = news.zone, news.state, news.status, news.before
        token, holder = status.token, status.holder
        if token is None or holder is None or token.epoch != state.epoch or news.decided:
            return
        if before is not None and before.token == token:
            return
        told = self.facts.told["manager"]
        missing = sorted(set(self.facts.robots) - self._reported[state.boot])
        if missing and zone not in self._decided_at:
            self.broken("manager", f"it grants zone {zone} to {holder} before {', '.join(missing)} reported")
        if not self.facts.presence_fresh(holder):
            age = self.facts.presence_age(holder)
            self.broken("manager", f"it grants zone {zone} to {holder}, last heard {age:.3f} s ago")
        presence = told.presences[holder]
        if presence.digest != state.digest:
            self.broken("manager", f"it grants zone {zone} to {holder}, whose configuration is {presence.digest[:8]}")
        if not presence.body.known:
            self.broken("manager", f"it grants zone {zone} to {holder}, which does not know where it is")
        if zone not in presence.wants:
            self.broken("manager", f"it grants zone {zone} to {holder}, which does not ask for it")
        together = (other for other, in_s in presence.wants.items() if in_s == presence.wants.get(zone))
        left = [other for other in together if other in state.zones and state.zones[other].holder != holder]
        if left:
            self.broken("manager", f"it grants zone {zone} to {holder} without {', '.join(left)}, needed with it")
        if state.estops:
            self.broken("manager", f"it grants zone {zone} to {holder} under an emergency stop")


class FirstComeFirstServed(Invariant):
    """Who came for one zone alone stands in its line behind those who were there before. No priorities are drawn."""

    name = "first come, first served"

    def __init__(self, facts: Facts) -> None:
        super().__init__(facts)
        self._came: dict[tuple[str, str], int] = {}
        """By zone and robot: the state of the manager that showed it in the line first."""

    @property
    def published(self) -> Handlers:
        return {ManagerState: self._state}

    def lived(self, name: str, _: str) -> None:
        if name == "manager":
            self._came.clear()

    def _state(self, _: str, state: ManagerState) -> None:
        line = {(zone, robot) for zone, status in state.zones.items() for robot in status.queue}
        presences = self.facts.told["manager"].presences
        wanted = {(zone, robot) for robot, presence in presences.items() for zone in presence.wants}
        kept = {place: came for place, came in self._came.items() if place in line & wanted}
        self._came = dict.fromkeys(line, state.sequence) | kept
        for zone, status in state.zones.items():
            for behind, robot in enumerate(status.queue[1:], 1):
                before = [other for other in status.queue[:behind] if self._alone(other)]
                early = [other for other in before if self._came[zone, other] > self._came[zone, robot]]
                if early and (zone, robot) in kept:
                    self.broken("manager", f"{early[0]} came after {robot} for zone {zone} and stands before it")

    def _alone(self, robot: str) -> bool:
        presence = self.facts.told["manager"].presences.get(robot)
        return presence is not None and len(presence.wants) == 1


class AdoptsAlone(Invariant):
    """An operator's adoption is carried out only where no other robot says that it is inside."""

    name = "who adopts a zone is alone in it"

    def __init__(self, facts: Facts) -> None:
        super().__init__(facts)
        self._asked: dict[str, AdoptZone] = {}

    @property
    def delivered(self) -> Handlers:
        return {Request: self._call}

    @property
    def published(self) -> Handlers:
        return {Reply: self._reply}

    def _call(self, _: str, request: Request) -> None:
        call = request.call
        if isinstance(call, Call) and isinstance(call.command, AdoptZone):
            self._asked[call.id] = call.command

    def _reply(self, name: str, reply: Reply) -> None:
        asked = self._asked.get(reply.id)
        if asked is None or not reply.ok or name != "manager":
            return
        for robot, presence in self.facts.told["manager"].presences.items():
            inside = Shown(presence, 0.0, 0.0).touches(asked.zone, self.facts.boxes[asked.zone])
            if robot != asked.robot and inside and self.facts.presence_fresh(robot):
                self.broken(name, f"zone {asked.zone} is adopted by {asked.robot}, and {robot} says to be inside")


class HolderLetsGo(_OfManager):
    """A grant ends only by a presence that the holder sent lately, after it could know of the grant, without the token
    and with its body outside; or by an operator's decision."""

    name = "a grant ends by its holder"

    def __init__(self, facts: Facts) -> None:
        super().__init__(facts)
        self._granted: dict[str, tuple[Token, str, int, float]] = {}
        """By zone: the newest token, the boot that it was given to, the state that said so first, and when."""

    def restarted(self) -> None:
        self._granted.clear()

    def judge(self, news: ZoneNews) -> None:
        zone, state, status, before = news.zone, news.state, news.status, news.before
        told = self.facts.told["manager"]
        if before is not None and before.token is not None and status.token != before.token and not news.decided:
            self._ended(zone, status, before)
        if status.token is not None and (before is None or before.token != status.token):
            boot = told.presences[status.holder or ""].boot
            self._granted[zone] = status.token, boot, state.sequence, self.facts.now

    def _ended(self, zone: str, status: ZoneStatus, before: ZoneStatus) -> None:
        holder = before.holder
        if holder is None or status.state is ZoneState.ORPHANED:
            return
        facts, (token, boot, sequence, at) = self.facts, self._granted[zone]
        if self._decided_at.get(zone, -inf) >= at:
            return  # a clearing that was refused because of somebody else has struck this robot off
        presence = facts.told["manager"].presences[holder]
        what = f"zone {zone} is {status.state.value} for {status.holder or 'everyone'}, which {holder} held by {token}"
        if not facts.presence_fresh(holder):
            self.broken("manager", f"{what}; {holder} was last heard {facts.presence_age(holder):.3f} s ago")
        if presence.holds.get(zone) == token:
            self.broken("manager", f"{what} and still holds")
        if Shown(presence, 0.0, 0.0).touches(zone, facts.boxes[zone]):
            self.broken("manager", f"{what}; its body is inside")
        heard = presence.heard
        if presence.boot == boot and (heard is None or heard.sequence < sequence):
            self.broken("manager", f"{what}; its presence was sent before it could know of the grant")


class ClaimsAreHonoured(_OfManager):
    """A manager that was started, and that every robot has answered, lets a grant of an earlier one live on, where the
    holder alone says to have it."""

    name = "grants outlive a manager"

    def judge(self, news: ZoneNews) -> None:
        zone, state, status, before = news.zone, news.state, news.status, news.before
        if news.decided or zone in self._decided_at:
            return
        facts, presences = self.facts, self.facts.told["manager"].presences
        if not all(facts.presence_surely_fresh(robot) for robot in facts.robots):
            return
        if before is not None and before.token is not None and before.token.epoch == state.epoch:
            return
        for robot, presence in presences.items():
            token = presence.holds.get(zone)
            if token is None or token.epoch >= state.epoch or presence.digest != state.digest:
                continue
            others = [each for name, each in presences.items() if name != robot]
            rivals = [
                each.robot
                for each in others
                if zone in each.holds or Shown(each, 0.0, 0.0).touches(zone, facts.boxes[zone])
            ]
            if not rivals and status.holder != robot:
                what = f"{robot} alone says to hold zone {zone} by {token}; the manager calls it {status.state.value}"
                self.broken("manager", f"{what}, held by {status.holder or 'nobody'}")


class OccupiedIsTheCase(_OfManager):
    """A zone is called occupied exactly while the body of its holder touches it, as the manager was told it."""

    name = "occupied is what is the case"

    def __init__(self, facts: Facts) -> None:
        super().__init__(facts)
        self._known: dict[tuple[str, str], tuple[Presence, bool]] = {}

    def judge(self, news: ZoneNews) -> None:
        zone, status, before = news.zone, news.status, news.before
        holder = status.holder
        if holder is None or status.state not in (ZoneState.GRANTED, ZoneState.OCCUPIED) or news.decided:
            return
        if before is None or before.token != status.token or not self.facts.presence_fresh(holder):
            return
        inside = self._inside(zone, self.facts.told["manager"].presences[holder])
        if inside is not (status.state is ZoneState.OCCUPIED):
            where = "inside" if inside else "outside"
            self.broken("manager", f"zone {zone} is {status.state.value}, and the body of {holder} is {where}")

    def _inside(self, zone: str, presence: Presence) -> bool:
        known = self._known.get((zone, presence.robot))
        if known is None or known[0] is not presence:
            touches = Shown(presence, 0.0, 0.0).touches(zone, self.facts.boxes[zone])
            known = self._known[zone, presence.robot] = presence, touches
        return known[1]
