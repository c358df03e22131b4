"""Changes of zones while the cell runs: all robots at rest, the cell file first, then the running cell.

A change is announced in the manager's state. From then on each agent that hears it lets nothing move its robot, and the
zone is granted to nobody. It is written only when every robot of the cell has confirmed, by a fresh presence that
answers such a state and says that it stands, and when none is inside the zone as it will be. The first state without
the announcement names the new version. An agent that has not heard it does not move: the newest state that it knows has
the announcement, and no older one can be fresh again. So nobody ever moves by the zone of before, and two robots never
by two different ones (`docs/architecture.md`, section 4.7).
"""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from cell.config.settings import CellSettings, ZoneSettings
from cell.config.zone_edit import changed_zone
from cell.core import Effect
from cell.manager.occupancy import ZoneSpace
from cell.manager.zones import Sight, Zone
from cell.messages import Mode, Presence, SetZone, ZoneState

CONFIRMED_WITHIN_S = 2.0
"""A robot that does not confirm by then keeps the zone as it is."""
WRITTEN_WITHIN_S = 5.0
"""So long all robots stay at rest for a disk."""
_GOES_ON = (Mode.RUNNING, Mode.RETURNING, Mode.JOGGING, Mode.ENABLING)


@dataclass(frozen=True, slots=True)
class WriteZone(Effect):
    """Write a change of a zone into the cell file; `ZonesWritten` or `ZoneNotWritten` comes back."""

    file: Path
    change: SetZone
    running: dict[str, ZoneSettings]


@dataclass(frozen=True, slots=True)
class ZonesWritten:
    """All zones as the cell file gives them now."""

    zones: dict[str, ZoneSettings]


@dataclass(frozen=True, slots=True)
class ZoneNotWritten:
    """The cell file stays as it is; why, for people."""

    reason: str


@dataclass(slots=True)
class _Change:
    """A change that is announced."""

    request_id: str
    call_id: str
    order: SetZone
    space: ZoneSpace
    """As it will be."""
    announced_in: int
    """Of the manager's states; 0: nobody has to know."""
    until: float
    writing: bool = False


@dataclass(frozen=True, slots=True)
class Over:
    """The end of a change."""

    request_id: str
    call_id: str
    order: SetZone
    refusal: str
    """Why it is not done; empty when it is in force."""


class ZoneChanges:
    """The zones in force, and the one change that is under way."""

    def __init__(self, cell: CellSettings, boot: str) -> None:
        self._cell = cell
        self._boot = boot
        self.zones = dict(cell.zones)
        self._change: _Change | None = None
        self._unwritten: str | None = None
        """The zone whose change nobody waits for any more, while the disk still has it."""

    @property
    def under_way(self) -> str | None:
        """The zone that is being changed, or written although nobody waits for that any more."""
        return self._unwritten if self._change is None else self._change.order.zone

    @property
    def announced(self) -> str | None:
        """The zone that is being changed, and for which all robots stay at rest."""
        return self._change.order.zone if self._change is not None and self._change.announced_in else None

    @property
    def space(self) -> ZoneSpace | None:
        """The zone that is being changed as it will be."""
        return None if self._change is None else self._change.space

    def planned(self, order: SetZone) -> tuple[ZoneSpace | None, str]:
        """The zone as it will be; or why it cannot be so, for people."""
        zone = self.zones.get(order.zone)
        if zone is None:
            return None, f"no zone {order.zone!r}; this cell has {', '.join(sorted(self.zones)) or 'none'}"
        if self.under_way is not None:
            return None, f"zone {self.under_way} is being changed; give the order again in a moment"
        if strangers := sorted(order.priority.keys() - set(zone.robots)):
            allowed = f"allowed: {', '.join(zone.robots)}"
            return None, f"a priority of {strangers[0]}, which may not ask for zone {zone.name}; {allowed}"
        return ZoneSpace(changed_zone(zone, order, self._cell.frames)), ""

    def unseen(self, request_id: str, call_id: str, order: SetZone, space: ZoneSpace) -> WriteZone:
        """Begin a change that leaves the zone where it is: who goes first is the manager's matter alone."""
        self._change = _Change(request_id, call_id, order, space, 0, 0.0, writing=True)
        return WriteZone(self._cell.file, order, dict(self.zones))

    def announce(
        self, request_id: str, call_id: str, order: SetZone, space: ZoneSpace, sequence: int, now: float
    ) -> None:
        """Begin a change that nothing speaks against, with the manager state `sequence`."""
        self._change = _Change(request_id, call_id, order, space, sequence, now + CONFIRMED_WITHIN_S)

    def step(
        self, fresh: Mapping[str, Presence], zone: Zone, sights: Mapping[str, Sight], now: float
    ) -> WriteZone | Over | None:
        """What comes next. `sights`: the robots as seen from the zone as it will be."""
        change = self._change
        if change is None:
            return None
        if change.writing:
            return None if now < change.until else self._given_up(change)
        refusal = self.hindrance(fresh, zone, sights)
        unheard = [robot for robot in self._cell.robots if not self._answers(fresh.get(robot), change)]
        if not refusal and not unheard:
            change.writing, change.until = True, now + WRITTEN_WITHIN_S
            return WriteZone(self._cell.file, change.order, dict(self.zones))
        if now < change.until:
            return None
        return self._over(change, refusal or f"{', '.join(unheard)} did not confirm: look with `cell status`")

    def hindrance(self, fresh: Mapping[str, Presence], zone: Zone, sights: Mapping[str, Sight]) -> str:
        """Who and what stands against a change now, and what to do, for people; empty for nothing."""
        reasons = [why for robot in self._cell.robots if (why := _restless(robot, fresh.get(robot)))]
        if zone.state in (ZoneState.GRANTED, ZoneState.OCCUPIED):
            reasons.append(f"{zone.holder} holds it: lead it out with `cell jog {zone.holder}`")
        elif zone.state is ZoneState.ORPHANED:
            reasons.append(f"it is blocked ({zone.reason}): see `cell status`")
        elif zone.awaited:
            reasons.append(f"the manager has not heard {', '.join(sorted(zone.awaited))} yet")
        for robot in sorted(robot for robot, sight in sights.items() if sight.inside):
            if sights[robot].known:
                reasons.append(f"{robot} stands where the zone is to be: lead it out with `cell jog {robot}`")
            else:
                reasons.append(f"{robot} does not know where it is and may be inside: `cell drives` says how to help")
        return "; ".join(reasons)

    def _answers(self, presence: Presence | None, change: _Change) -> bool:
        heard = None if presence is None else presence.heard
        return heard is not None and heard.boot == self._boot and heard.sequence >= change.announced_in

    def written(self, outcome: ZonesWritten | ZoneNotWritten) -> Over | None:
        """Take over what the file gives now; None where nobody waits for it."""
        self._unwritten, change = None, self._change
        if change is None:
            return None
        if isinstance(outcome, ZoneNotWritten):
            return self._over(change, outcome.reason)
        self.zones = dict(outcome.zones)
        return self._over(change, "")

    def _given_up(self, change: _Change) -> Over:
        """The running cell keeps the zone as it was; the file may come to have the other one."""
        self._unwritten = change.order.zone
        refusal = (
            f"{self._cell.file} was not written within {WRITTEN_WITHIN_S:g} s: see to the disk, then look at the file: "
            "it may have the zone as ordered by then; the same order again brings file and cell together"
        )
        return self._over(change, refusal)

    def _over(self, change: _Change, refusal: str) -> Over:
        self._change = None
        return Over(change.request_id, change.call_id, change.order, refusal)


def _restless(robot: str, presence: Presence | None) -> str:
    """Why a robot may move; empty when it stands and nothing is to move it."""
    if presence is None:
        return f"{robot} is silent: start its agent (`cell status` says how)"
    if presence.mode in _GOES_ON:
        return f"{robot} is {presence.mode.value}: `cell halt {robot}`"
    return "" if presence.stop_time_s == 0.0 else f"{robot} is not at rest yet"
