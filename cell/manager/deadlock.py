"""Robots that wait for each other's zones, for zones and room, or for either and at a MEET: none of them ever goes on.

Each holds a zone that the next one needs, stands in its way, or is waited for at a MEET. Those that want room alone are
a stand-off (`cell/manager/separation/standoff.py`), those at MEETs alone are found in `cell/manager/meetings.py`.
"""

from collections.abc import Collection, Iterator, Mapping
from enum import Enum, auto
from typing import NamedTuple

from cell.manager.circles import LastingCircles, circles_of
from cell.manager.zones import Sight, Zone
from cell.messages import Deadlock, Refusal, Token, ZoneState

_NOW_S = 0.1
"""A zone that is wanted within so long is one that the robot waits for, if it does not get it."""


class _Kind(Enum):
    ZONE = auto()
    ROOM = auto()
    MEETING = auto()


class _Wait(NamedTuple):
    """What a robot waits for."""

    kind: _Kind
    name: str
    """Of the zone or the meeting."""
    other: str
    """Whose it is, or who is missing."""


Steps = tuple[tuple[str, _Wait], ...]
"""Each robot waits for the next one, the last for the first."""


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
        waiting: dict[str, dict[_Wait, str]] = {}
        for robot, wait in [*_for_zones(zones, sights), *_for_room(kept_out), *_for_others(at_meetings)]:
            waiting.setdefault(robot, {})[wait] = wait.other
        circles = [circle for circle in circles_of(waiting) if _kinds(circle) not in ({_Kind.ROOM}, {_Kind.MEETING})]
        return self._circles.look(circles, now, lambda steps: _deadlock(steps, zones, kept_out, cell_time))


def _kinds(steps: Steps) -> set[_Kind]:
    return {wait.kind for _, wait in steps}


def _for_zones(zones: Mapping[str, Zone], sights: Mapping[str, Mapping[str, Sight]]) -> Iterator[tuple[str, _Wait]]:
    for name, zone in sorted(zones.items()):
        if zone.holder is not None and zone.state in (ZoneState.GRANTED, ZoneState.OCCUPIED):
            for robot in zone.queue:
                if sights[name][robot].needed_in_s < _NOW_S:
                    yield robot, _Wait(_Kind.ZONE, name, zone.holder)


def _for_room(kept_out: Mapping[str, Refusal]) -> Iterator[tuple[str, _Wait]]:
    for robot, refusal in kept_out.items():
        yield robot, _Wait(_Kind.ROOM, "", refusal.by)


def _for_others(at_meetings: Mapping[str, tuple[str, Collection[str]]]) -> Iterator[tuple[str, _Wait]]:
    for robot, (meeting, missing) in at_meetings.items():
        for other in missing:
            yield robot, _Wait(_Kind.MEETING, meeting, other)


def _deadlock(steps: Steps, zones: Mapping[str, Zone], kept_out: Mapping[str, Refusal], cell_time: float) -> Deadlock:
    """Named, with the way out."""
    needed = tuple(wait.name for _, wait in steps if wait.kind is _Kind.ZONE)
    text = "; ".join(_says(robot, wait, kept_out) for robot, wait in steps)
    remedy = _back_from_a_meet(steps) if _Kind.MEETING in _kinds(steps) else _back_out_of_a_zone(steps, zones)
    return Deadlock(tuple(robot for robot, _ in steps), needed, cell_time, text, remedy)


def _says(robot: str, wait: _Wait, kept_out: Mapping[str, Refusal]) -> str:
    match wait.kind:
        case _Kind.ROOM:
            return kept_out[robot].text
        case _Kind.MEETING:
            return f"{robot} waits at meeting {wait.name} for {wait.other}"
        case _Kind.ZONE:
            return f"{robot} waits for zone {wait.name} held by {wait.other}"


def _back_from_a_meet(steps: Steps) -> str:
    """Where a robot waits for the others, it is in the way of one of them."""
    back = next(robot for robot, wait in steps if wait.kind is _Kind.MEETING)
    other = next(robot for robot, wait in steps if wait.other == back)
    return (
        f"let {back} back from its MEET: `cell override {back} -100` until {other} has got through, then "
        f"`cell override {back} 100`; then correct the programs: {back} waits there in the way of {other}"
    )


def _back_out_of_a_zone(steps: Steps, zones: Mapping[str, Zone]) -> str:
    """The robot that got its zone last goes back."""
    blocked_by = {wait.other: (wait.name, robot) for robot, wait in steps if wait.kind is _Kind.ZONE}
    back = max(blocked_by, key=lambda robot: zones[blocked_by[robot][0]].token or Token(0, 0))
    zone, other = blocked_by[back]
    return (
        f"let one go back, for example {back}: `cell override {back} -100` until it is out of {zone}, then "
        f"`cell halt {back}`; where what is kept of its path begins inside, `cell halt {back}`, then jog it out "
        f"(`cell jog {back} --help`); {other} goes on by itself, after it `cell override {back} 100`, "
        f"after a jog `cell return {back}`, "
        f"and `cell continue {back}`"
    )
