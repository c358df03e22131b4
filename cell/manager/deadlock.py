"""Robots that wait for each other's zones, each holding one that the next one needs: none of them ever goes on."""

from collections.abc import Mapping

from cell.manager.circles import LastingCircles, circles_of
from cell.manager.zones import Sight, Zone
from cell.messages import Deadlock, Token, ZoneState

_NOW_S = 0.1
"""A zone that is wanted within so long is one that the robot waits for, if it does not get it."""


class DeadlockWatch:
    """Looks for circles of waiting robots once a cycle."""

    def __init__(self) -> None:
        self._circles = LastingCircles[tuple[tuple[str, str], ...]]()

    @property
    def present(self) -> tuple[Deadlock, ...]:
        """Those that were told and still last."""
        return self._circles.present

    def look(
        self, zones: Mapping[str, Zone], sights: Mapping[str, Mapping[str, Sight]], cell_time: float, now: float
    ) -> list[Deadlock]:
        """The deadlocks that are new; `sights` by zone and robot."""
        circles = circles_of(_waiting(zones, sights))
        return self._circles.look(circles, now, lambda steps: _deadlock(steps, zones, cell_time))


def _waiting(zones: Mapping[str, Zone], sights: Mapping[str, Mapping[str, Sight]]) -> dict[str, dict[str, str]]:
    """Robot: the zones that it needs now, by name, and who holds each."""
    waiting: dict[str, dict[str, str]] = {}
    for name, zone in sorted(zones.items()):
        if zone.holder is not None and zone.state in (ZoneState.GRANTED, ZoneState.OCCUPIED):
            for robot in zone.queue:
                if sights[name][robot].needed_in_s < _NOW_S:
                    waiting.setdefault(robot, {})[name] = zone.holder
    return waiting


def _deadlock(steps: tuple[tuple[str, str], ...], zones: Mapping[str, Zone], cell_time: float) -> Deadlock:
    """Named, with the way out: the robot that got its zone last goes back."""
    blocked_by = {zones[zone].holder: (zone, robot) for robot, zone in steps}
    back = max(blocked_by, key=lambda robot: zones[blocked_by[robot][0]].token or Token(0, 0))
    zone, other = blocked_by[back]
    text = "; ".join(f"{robot} waits for zone {zone} held by {zones[zone].holder}" for robot, zone in steps)
    remedy = (
        f"let one go back, for example {back}: `cell override {back} -100` until it is out of {zone}, then "
        f"`cell halt {back}`; where what is kept of its path begins inside, `cell halt {back}`, then jog it out "
        f"(`cell jog {back} --help`); {other} goes on by itself, after it `cell override {back} 100`, "
        f"after a jog `cell return {back}`, "
        f"and `cell continue {back}`"
    )
    return Deadlock(tuple(robot for robot, _ in steps), tuple(zone for _, zone in steps), cell_time, text, remedy)
