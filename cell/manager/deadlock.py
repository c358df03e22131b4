"""Robots that wait for each other's zones, each holding one that the next one needs: none of them ever goes on.

Nobody backs by itself: what a program has switched on its way can not be undone by going back. So people are told.
"""

from collections.abc import Mapping
from dataclasses import dataclass

from cell.manager.zones import Sight, Zone
from cell.messages import Token, ZoneDeadlock, ZoneState

LASTING_S = 1.0
"""What lasts so long is no passing moment; what was not seen for so long is over."""


@dataclass(slots=True)
class _Circle:
    seen_first: float
    seen_last: float
    deadlock: ZoneDeadlock | None = None
    """Once it was told."""


class DeadlockWatch:
    """Looks for circles of waiting robots once a cycle, and remembers since when each is there."""

    def __init__(self) -> None:
        self._circles: dict[tuple[tuple[str, str], ...], _Circle] = {}

    @property
    def present(self) -> tuple[ZoneDeadlock, ...]:
        """Those that were told and still last."""
        return tuple(circle.deadlock for circle in self._circles.values() if circle.deadlock is not None)

    def look(
        self, zones: Mapping[str, Zone], sights: Mapping[str, Mapping[str, Sight]], cell_time: float, now: float
    ) -> list[ZoneDeadlock]:
        """The deadlocks that are new; `sights` by zone and robot."""
        for steps in _circles(_waiting(zones, sights)):
            self._circles.setdefault(steps, _Circle(now, now)).seen_last = now
        self._circles = {steps: each for steps, each in self._circles.items() if now - each.seen_last <= LASTING_S}
        found = []
        for steps, circle in self._circles.items():
            if circle.deadlock is None and circle.seen_last == now and now - circle.seen_first >= LASTING_S:
                circle.deadlock = _deadlock(steps, zones, cell_time)
                found.append(circle.deadlock)
        return found


def _waiting(zones: Mapping[str, Zone], sights: Mapping[str, Mapping[str, Sight]]) -> dict[str, tuple[str, str]]:
    """Robot: a zone that it needs now, and who holds it; the first by name if there are several."""
    waiting: dict[str, tuple[str, str]] = {}
    for name, zone in sorted(zones.items()):
        if zone.holder is not None and zone.state in (ZoneState.GRANTED, ZoneState.OCCUPIED):
            for robot in zone.queue:
                if sights[name][robot].needs_now:
                    waiting.setdefault(robot, (name, zone.holder))
    return waiting


def _circles(waiting: Mapping[str, tuple[str, str]]) -> list[tuple[tuple[str, str], ...]]:
    """All circles, as (robot, the zone that it waits for), beginning with the first robot by name."""
    found, done = [], set[str]()
    for start in sorted(waiting):
        way: list[str] = []
        robot = start
        while robot in waiting and robot not in way and robot not in done:
            way.append(robot)
            robot = waiting[robot][1]
        if robot in way:
            circle = way[way.index(robot) :]
            first = circle.index(min(circle))
            found.append(tuple((each, waiting[each][0]) for each in (*circle[first:], *circle[:first])))
        done |= set(way)
    return found


def _deadlock(steps: tuple[tuple[str, str], ...], zones: Mapping[str, Zone], cell_time: float) -> ZoneDeadlock:
    """Named, with the way out: the robot that got its zone last goes back."""
    blocked_by = {zones[zone].holder: (zone, robot) for robot, zone in steps}
    back = max(blocked_by, key=lambda robot: zones[blocked_by[robot][0]].token or Token(0, 0))
    zone, other = blocked_by[back]
    text = "; ".join(f"{robot} waits for zone {zone} held by {zones[zone].holder}" for robot, zone in steps)
    remedy = (
        f"let one go back, for example {back}: `cell override {back} -100` until it is out of {zone}, then "
        f"`cell halt {back}`; where its motion begins inside, `cell halt {back}`, then jog it out (`cell jog {back} "
        f"--help`), which ends its program; {other} goes on by itself, after it `cell override {back} 100` and "
        f"`cell continue {back}`, or `cell run {back}`"
    )
    return ZoneDeadlock(tuple(robot for robot, _ in steps), tuple(zone for _, zone in steps), cell_time, text, remedy)
