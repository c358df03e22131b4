"""Meetings: robots that wait for each other in their programs, and leave together.

A robot says in its presence at which MEET it waits, under a number that it never uses again. Once the fresh presences
of all robots of a meeting say so, these arrivals are released together: each leaves by its own, at one cell time. The
newest release stays in the manager's state. It is not made again for an arrival that was released before: a robot that
has left repeats by which arrivals, so that a manager that is started again knows who has not heard of it and may leave
still, and takes nobody's old arrival for one of the next time.

Which robots wait is known by what they say. Nothing is stored, and no order of messages matters.
"""

from collections.abc import Collection, Mapping

from cell.manager.circles import LastingCircles, circles_of
from cell.messages import Arrival, Deadlock, MeetingStatus, Mode, Presence

LEAD_S = 0.3
"""Robots leave so long after all have arrived: in that time five states of the manager may be lost."""

_DOING = {
    Mode.STARTING: "which has no drives yet",
    Mode.DISABLED: "which is switched off",
    Mode.ENABLING: "which is switched off",
    Mode.READY: "which runs no program",
    Mode.RUNNING: "which is on its way",
    Mode.HALTED: "which is halted",
    Mode.OFF_PATH: "which is off its path",
    Mode.RETURNING: "which returns to its path",
    Mode.JOGGING: "which is jogged",
    Mode.FAULT: "which is in a fault",
    Mode.ESTOP: "which an emergency stop has stopped",
}


class Meetings:
    """All meetings of a cell."""

    def __init__(self, meetings: Mapping[str, tuple[str, ...]]) -> None:
        """`meetings`: by name, its robots."""
        self._meetings = [_Meeting(name, robots) for name, robots in meetings.items()]
        self._circles = LastingCircles[tuple[tuple[str, str], ...]]()

    def look(self, fresh: Mapping[str, Presence], refused: Mapping[str, str], cell_time: float) -> list[Deadlock]:
        """Release whoever has met by these presences; `refused` robots, and why, do not count.

        Answers the circles that are new of robots that wait for each other at different meetings.
        """
        for meeting in self._meetings:
            meeting.look(fresh, refused, cell_time)
        at = {robot: each.name for each in self._meetings for robot in each.status.there}
        waiting = {
            robot: {other: other for other in each.status.missing if other in at}
            for each in self._meetings
            for robot in each.status.there
        }
        return self._circles.look(
            circles_of(waiting), cell_time, lambda steps: _deadlock([robot for robot, _ in steps], at, cell_time)
        )

    @property
    def waiting(self) -> dict[str, tuple[str, Collection[str]]]:
        """By robot that waits: its meeting, and who is missing there."""
        return {robot: (each.name, each.status.missing) for each in self._meetings for robot in each.status.there}

    @property
    def deadlocks(self) -> tuple[Deadlock, ...]:
        """Circles that were told and still last."""
        return self._circles.present

    @property
    def present(self) -> dict[str, MeetingStatus]:
        """For the manager's state."""
        return {meeting.name: meeting.status for meeting in self._meetings}


class _Meeting:
    def __init__(self, name: str, robots: tuple[str, ...]) -> None:
        self.name = name
        self.status = MeetingStatus()
        self._robots = robots

    def look(self, fresh: Mapping[str, Presence], refused: Mapping[str, str], cell_time: float) -> None:
        counted = {robot: fresh[robot] for robot in self._robots if robot in fresh and robot not in refused}
        waiting = {robot: arrival for robot, said in counted.items() if (arrival := self._arrival(said)) is not None}
        released, leave_at = self.status.released, self.status.leave_at
        if not _meets(released, waiting):
            told = (said.meets.left.get(self.name, {}) for said in counted.values())
            before = next((release for release in told if _meets(release, waiting)), None)
            if before is not None:
                released, leave_at = dict(before), None
            elif len(waiting) == len(self._robots):
                released, leave_at = waiting, cell_time + LEAD_S
        there = tuple(robot for robot, arrival in waiting.items() if released.get(robot) != arrival)
        missing = {
            robot: self._why_missing(counted.get(robot), refused.get(robot))
            for robot in self._robots
            if there and robot not in there
        }
        self.status = MeetingStatus(there, missing, released, leave_at)

    def _arrival(self, said: Presence) -> Arrival | None:
        at = said.meets.waits
        return None if at is None or at.meeting != self.name or at.held_up else Arrival(said.boot, at.number)

    def _why_missing(self, said: Presence | None, refusal: str | None) -> str:
        if refusal is not None:
            return f"which gets no grants: {refusal}"
        if said is None:
            return "which is silent"
        at = said.meets.waits
        if at is None and said.meets.held_up:
            return f"whose program waits: {said.meets.held_up}"
        if at is None and said.mode is Mode.RUNNING and said.stop_time_s == 0.0:
            return "which is on its way, but stands now"
        if at is None:
            return _DOING[said.mode] if said.mode is not None else "which does not say what it does"
        if at.meeting != self.name:
            return f"which waits at meeting {at.meeting}"
        return f"which is there, but {at.held_up}" if at.held_up else "which has not left yet"


def _deadlock(robots: list[str], at: Mapping[str, str], cell_time: float) -> Deadlock:
    """Robots each of which waits for the next one, at another meeting than that, and the way out."""
    following = dict(zip(robots, [*robots[1:], robots[0]], strict=True))
    text = "; ".join(f"{robot} waits at meeting {at[robot]} for {other}" for robot, other in following.items())
    one = robots[-1]
    remedy = (
        f"their programs come to these MEETs in different order: `cell halt {one}`, then `cell run {one} --from LINE` "
        f"with the line behind its MEET {at[one]}, or `cell run {one}` from the beginning; then correct the programs"
    )
    return Deadlock(tuple(robots), (), cell_time, text, remedy)


def _meets(released: Mapping[str, Arrival], waiting: Mapping[str, Arrival]) -> bool:
    """Whether somebody waits whose arrival is among these."""
    return any(released.get(robot) == arrival for robot, arrival in waiting.items())
