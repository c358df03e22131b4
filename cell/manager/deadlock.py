"""Robots that wait for each other's zones, or for zones and room: none of them ever goes on.

Each holds a zone that the next one needs, or stands in its way. Those that want room alone are a stand-off
(`cell/manager/separation/standoff.py`).
"""

from collections.abc import Mapping

from cell.manager.circles import LastingCircles, circles_of
from cell.manager.zones import Sight, Zone
from cell.messages import Deadlock, Refusal, Token, ZoneState

_NOW_S = 0.1
"""A zone that is wanted within so long is one that the robot waits for, if it does not get it."""
_ROOM = ""
"""What a robot waits for that is kept out of the room of another one, in the place of a zone's name."""

Steps = tuple[tuple[str, str], ...]
"""(robot, what it waits for), which is the next robot's."""


class DeadlockWatch:
    """Looks for circles of waiting robots once a cycle."""

    def __init__(self) -> None:
        self._circles = LastingCircles[Steps]()

    @property
    def present(self) -> tuple[Deadlock, ...]:
        """Those that were told and still last."""
        return self._circles.present

    def look(
        self,
        zones: Mapping[str, Zone],
        sights: Mapping[str, Mapping[str, Sight]],
        kept_out: Mapping[str, Refusal],
        cell_time: float,
        now: float,
    ) -> list[Deadlock]:
        """The deadlocks that are new.

        `sights` by zone and robot; `kept_out`: robots at rest that are cleared no room, and why.
        """
        waiting = _waiting(zones, sights)
        for robot, refusal in kept_out.items():
            waiting.setdefault(robot, {})[_ROOM] = refusal.by
        circles = [circle for circle in circles_of(waiting) if any(what != _ROOM for _, what in circle)]
        return self._circles.look(circles, now, lambda steps: _deadlock(steps, zones, kept_out, cell_time))


def _waiting(zones: Mapping[str, Zone], sights: Mapping[str, Mapping[str, Sight]]) -> dict[str, dict[str, str]]:
    """Robot: the zones that it needs now, by name, and who holds each."""
    waiting: dict[str, dict[str, str]] = {}
    for name, zone in sorted(zones.items()):
        if zone.holder is not None and zone.state in (ZoneState.GRANTED, ZoneState.OCCUPIED):
            for robot in zone.queue:
                if sights[name][robot].needed_in_s < _NOW_S:
                    waiting.setdefault(robot, {})[name] = zone.holder
    return waiting


def _deadlock(steps: Steps, zones: Mapping[str, Zone], kept_out: Mapping[str, Refusal], cell_time: float) -> Deadlock:
    """Named, with the way out: the robot that got its zone last goes back."""
    blocked_by = {zones[zone].holder: (zone, robot) for robot, zone in steps if zone != _ROOM}
    back = max(blocked_by, key=lambda robot: zones[blocked_by[robot][0]].token or Token(0, 0))
    zone, other = blocked_by[back]
    text = "; ".join(
        kept_out[robot].text if what == _ROOM else f"{robot} waits for zone {what} held by {zones[what].holder}"
        for robot, what in steps
    )
    remedy = (
        f"let one go back, for example {back}: `cell override {back} -100` until it is out of {zone}, then "
        f"`cell halt {back}`; where what is kept of its path begins inside, `cell halt {back}`, then jog it out "
        f"(`cell jog {back} --help`); {other} goes on by itself, after it `cell override {back} 100`, "
        f"after a jog `cell return {back}`, "
        f"and `cell continue {back}`"
    )
    needed = tuple(what for _, what in steps if what != _ROOM)
    return Deadlock(tuple(robot for robot, _ in steps), needed, cell_time, text, remedy)
