"""Whose turn it is: in which order robots wait for zones, and which of them are granted what is free.

A *wish* is all that a robot needs at one moment: the zones that it wants in the same number of seconds. It gets all of
them or none, so nobody holds one of them while it waits for another.

Wishes have one order, over all zones. The one of higher rank goes first, of the same rank the one that came first. Its
rank is the highest priority of its robot in its zones, and one more for each time that a later wish was granted one of
these zones before it: so nobody is overtaken more often than priorities differ. A wish that waits for one zone keeps
the others of it from those that come after it, or it would never find all of them free; but not from a robot that holds
a zone already, since it may be the one that is waited for.

Where robots are kept apart, the order of all who share room (`cell/manager/separation/order.py`) has the last word: a
robot that would stand with the zone in the way of another one lets that one through first, whatever its rank, and may
be overtaken more often by that.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

from cell.manager.zones import Sight, Zone
from cell.messages import Refusal, Token, ZoneState

Sights = Mapping[str, Mapping[str, Sight]]
"""By zone and robot."""
_HELD = (ZoneState.GRANTED, ZoneState.OCCUPIED)
NOTHING = Refusal("", "")
"""Against a grant."""


@dataclass(slots=True)
class _InLine:
    """A robot's place in the line for one zone."""

    number: int
    """Of the cycle in which it came."""
    overtaken: int = 0


@dataclass(frozen=True, slots=True)
class _Wish:
    robot: str
    zones: tuple[str, ...]
    """Those that it has not got yet."""
    rank: int
    came: tuple[int, str]
    possible: bool
    """Nothing but other robots' grants and wishes stands against it."""


@dataclass(slots=True)
class ZoneTurns:
    """The line of all who wait; `line_up` once a cycle, then `grant`."""

    priorities: Mapping[str, Mapping[str, int]]
    """By zone and robot; 0 where none is given."""
    _places: dict[tuple[str, str], _InLine] = field(default_factory=dict)
    _cycle: int = 0
    _wishes: list[_Wish] = field(default_factory=list)
    _put_off: dict[str, Refusal] = field(default_factory=dict)
    """By robot: who gets through before it has what is free."""

    def line_up(self, zones: Mapping[str, Zone], sights: Sights) -> None:
        """Follow who waits for what, and bring each zone's queue into the order of the wishes."""
        self._cycle += 1
        waiting = [(name, robot) for name, zone in zones.items() for robot in zone.queue if robot != zone.holder]
        self._places = {place: self._places.get(place) or _InLine(self._cycle) for place in waiting}
        wanted: dict[tuple[str, float], list[str]] = {}
        for name, robot in waiting:
            wanted.setdefault((robot, sights[name][robot].needed_in_s), [])
        for (robot, needed_in_s), names in wanted.items():
            for name, zone in zones.items():
                sight = sights[name].get(robot)
                has = zone.holder == robot and zone.state in _HELD
                if sight is not None and sight.wants and sight.needed_in_s == needed_in_s and not has:
                    names.append(name)
        wishes = (self._wish(robot, names, zones, sights) for (robot, _), names in wanted.items())
        self._wishes = sorted(wishes, key=lambda wish: (-wish.rank, wish.came))
        for name, zone in zones.items():
            zone.queue = [
                each.robot for each in self._wishes if name in each.zones and (name, each.robot) in self._places
            ]

    def _wish(self, robot: str, names: list[str], zones: Mapping[str, Zone], sights: Sights) -> _Wish:
        places = {name: place for name in names if (place := self._places.get((name, robot))) is not None}
        ranks = (self.priorities[name].get(robot, 0) + place.overtaken for name, place in places.items())
        came = min(place.number for place in places.values()), robot
        possible = all(name in places and zones[name].comes_free for name in names)
        return _Wish(robot, tuple(names), max(ranks), came, possible and all(sights[n][robot].known for n in names))

    def grant(
        self,
        zones: Mapping[str, Zone],
        sights: Sights,
        new_token: Callable[[], Token],
        sequence: int,
        why_not_yet: Callable[[str, Sequence[str]], Refusal | None] = lambda _robot, _zones: None,
    ) -> list[tuple[str, str]]:
        """Give what is free to those whose turn it is: zones and robots. `sequence` is that of the next state.

        `why_not_yet` says why a robot must not have these zones although they are free; None: it may.
        """
        self._put_off = {}
        kept: set[str] = set()
        granted: list[tuple[str, str]] = []
        holders = {zone.holder for zone in zones.values() if zone.state in _HELD}
        for wish in self._wishes:
            free = all(zones[name].open_to(wish.robot, sights[name][wish.robot]) for name in wish.zones)
            if not free or (wish.robot not in holders and not kept.isdisjoint(wish.zones)):
                kept.update(wish.zones if wish.possible else ())
                continue
            if why := why_not_yet(wish.robot, wish.zones):
                self._put_off[wish.robot] = why
                continue
            for name in wish.zones:
                zones[name].grant(wish.robot, sights[name][wish.robot].boot, new_token(), sequence)
                granted.append((name, wish.robot))
                del self._places[name, wish.robot]
            self._overtake(wish)
        return granted

    def _overtake(self, granted: _Wish) -> None:
        for wish in self._wishes:
            shares = not {*wish.zones}.isdisjoint(granted.zones)
            for name in wish.zones if shares and wish.possible and wish.came < granted.came else ():
                if (name, wish.robot) in self._places:
                    self._places[name, wish.robot].overtaken += 1

    def why_free(self, name: str, zones: Mapping[str, Zone]) -> Refusal:
        """Why the first who waits for a free zone has not got it: what it needs with it, or who goes before it."""
        wish = next((wish for wish in self._wishes if name in wish.zones), None)
        if wish is None:
            return NOTHING
        missing = [why for other in wish.zones if other != name and (why := _why_not(wish.robot, zones[other]))]
        if missing:
            return Refusal("", f"{wish.robot} needs with it {' and '.join(missing)}")
        return self._put_off.get(wish.robot, NOTHING)


def _why_not(robot: str, zone: Zone) -> str:
    """Why a robot that waits for a zone has it not; empty when it is free and its turn."""
    if zone.state in _HELD:
        return f"zone {zone.name}, held by {zone.holder}"
    if zone.state is not ZoneState.FREE:
        return f"zone {zone.name}, which is {zone.state.value}"
    if robot not in zone.queue:
        return f"zone {zone.name}, which is closed for it"
    return "" if zone.queue[0] == robot else f"zone {zone.name}, for which {zone.queue[0]} waits first"
