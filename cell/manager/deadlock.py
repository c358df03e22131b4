"""Robots that wait for each other's zones, for zones and room, or for either and at a MEET: none of them ever goes on.

Each holds a zone that the next one needs, stands in its way, or is waited for at a MEET. Those that want room alone are
a stand-off (`cell/manager/separation/standoff.py`), those at MEETs alone are found in `cell/manager/meetings.py`.
"""

from collections.abc import Collection, Mapping

from cell.manager.circles import LastingCircles, circles_of
from cell.manager.zones import Sight, Zone
from cell.messages import Deadlock, Refusal, Token, ZoneState

_NOW_S = 0.1
"""A zone that is wanted within so long is one that the robot waits for, if it does not get it."""
_ROOM = ""
"""What a robot waits for that is kept out of the room of another one, in the place of a zone's name."""
_MEETING = "meeting "
"""What it waits for at a MEET begins so, which no name of a zone does."""

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
        at_meetings: Mapping[str, tuple[str, Collection[str]]],
        cell_time: float,
        now: float,
    ) -> list[Deadlock]:
        """The deadlocks that are new.

        `sights` by zone and robot; `kept_out`: robots at rest that are cleared no room, and why; `at_meetings`: those
        that wait at a meeting, and for whom.
        """
        waiting = _waiting(zones, sights)
        for robot, (meeting, missing) in at_meetings.items():
            waiting[robot] = {f"{_MEETING}{meeting} {other}": other for other in missing}
        for robot, refusal in kept_out.items():
            waiting.setdefault(robot, {})[_ROOM] = refusal.by
        kinds = {circle: {_kind(what) for _, what in circle} for circle in circles_of(waiting)}
        circles = [circle for circle, its in kinds.items() if its not in ({_ROOM}, {_MEETING})]
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
    needed = tuple(what for _, what in steps if _kind(what) not in (_ROOM, _MEETING))
    robots = tuple(robot for robot, _ in steps)
    following = dict(zip(robots, [*robots[1:], robots[0]], strict=True))
    text = "; ".join(_says(robot, what, following[robot], kept_out) for robot, what in steps)
    met = next((robot for robot, what in steps if _kind(what) == _MEETING), None)
    if met is not None:
        other = next(robot for robot, after in following.items() if after == met)
        remedy = (
            f"let {met} back from its MEET: `cell override {met} -100` until {other} has got through, then "
            f"`cell override {met} 100`; then correct the programs: {met} waits there in the way of {other}"
        )
        return Deadlock(robots, needed, cell_time, text, remedy)
    blocked_by = {zones[zone].holder: (zone, robot) for robot, zone in steps if zone != _ROOM}
    back = max(blocked_by, key=lambda robot: zones[blocked_by[robot][0]].token or Token(0, 0))
    zone, other = blocked_by[back]
    remedy = (
        f"let one go back, for example {back}: `cell override {back} -100` until it is out of {zone}, then "
        f"`cell halt {back}`; where what is kept of its path begins inside, `cell halt {back}`, then jog it out "
        f"(`cell jog {back} --help`); {other} goes on by itself, after it `cell override {back} 100`, "
        f"after a jog `cell return {back}`, "
        f"and `cell continue {back}`"
    )
    return Deadlock(robots, needed, cell_time, text, remedy)


def _kind(what: str) -> str:
    return _MEETING if what.startswith(_MEETING) else what


def _says(robot: str, what: str, other: str, kept_out: Mapping[str, Refusal]) -> str:
    if what == _ROOM:
        return kept_out[robot].text
    if _kind(what) == _MEETING:
        return f"{robot} waits at {_MEETING}{what.split()[1]} for {other}"
    return f"{robot} waits for zone {what} held by {other}"
