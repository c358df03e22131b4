"""The robot's half of a meeting: it says that it has come to a MEET, and leaves when the manager releases that arrival.

What the manager knows of it stands in `cell/manager/meetings.py`. A MEET is come to once, however often its program is
halted there: the number stays the same until the robot has left, or the program has ended.
"""

from cell.messages import Arrival, Attendance, CellTime, MeetingStatus, Meets, Mode
from robot_agent.agent.cell_clock import CellClock
from robot_agent.agent.program.program_run import ProgramRun
from robot_agent.agent.zones.zone_claims import ZoneClaims
from robot_agent.language import Meet

_IN_TIME_S = 0.06
"""So long before the others leave a robot must know of it, to leave with them: its next block is made by then."""
_GOES_ON_S = 0.1
"""A halt has to be over so long before: then the feedback has said so too."""


class Meetings:
    """At most one MEET at a time, that of `run`."""

    def __init__(self, robot: str, boot: str, run: ProgramRun, zones: ZoneClaims, clock: CellClock) -> None:
        self._robot = robot
        self._boot = boot
        self._run = run
        self._zones = zones
        self._clock = clock
        self._meet: Meet | None = None
        """The newest to which the program came."""
        self._number = 0
        self._waited = 0
        """Ticks at that MEET, without those in which the program was halted."""
        self._tick: int | None = None
        """The newest at which it waited; None while it does not."""
        self._waits: Attendance | None = None
        self._left: dict[str, dict[str, Arrival]] = {}
        self._leaving: tuple[str, int] | None = None
        """The meeting of which it knows in time when all leave, and that tick; None once they have left."""
        self._halted_at = 0
        """The newest tick at which its program was halted meanwhile."""

    def told(self, mode: Mode) -> Meets:
        """For the presence; only a robot that runs its program waits."""
        if mode is not Mode.RUNNING:
            return Meets(None, dict(self._left))
        return Meets(self._waits, dict(self._left), self._run.held_up if self._run.at_wait is not None else "")

    def follow(self, tick: int, cycle_s: float, now: float) -> str:
        """Wait at the MEET to which the program has come by `tick`, leave it, or end the program at its time-out.

        Answers what an operator should know of how it left; mostly nothing.
        """
        meet, behind = self._run.at_meeting, self._left_behind(tick, cycle_s)
        if meet is None:
            self._waits = self._tick = None
            return behind
        if meet is not self._meet:
            self._meet, self._number, self._waited = meet, self._number + 1, 0
        elif self._tick is not None:
            self._waited += tick - self._tick
        self._tick = tick
        uncertain = self._clock.uncertain(now)
        self._waits = Attendance(meet.meeting, self._number, "does not know cell time well enough" if uncertain else "")
        state = self._zones.state if self._zones.fresh(now) else None
        status = None if state is None else state.meetings.get(meet.meeting)
        if state is not None and status is not None and self._is_released(status):
            return self._leave(meet, status, state.boot, tick, now)
        self._run.held_up = f"meeting {meet.meeting}: {uncertain or self._why(status, now)}"
        if meet.timeout_s is not None and self._waited * cycle_s >= meet.timeout_s:
            self._run.fail(f"line {meet.line}: not left within {meet.timeout_s:g} s: {self._run.held_up}")
            self._waits = None
        return behind

    def _is_released(self, status: MeetingStatus) -> bool:
        return status.released.get(self._robot) == Arrival(self._boot, self._number)

    def _leave(self, meet: Meet, status: MeetingStatus, boot: str, tick: int, now: float) -> str:
        left_s, at_tick, late = 0.0, tick, "the manager that let them go is gone"
        if status.leave_at is not None:
            moment = CellTime(boot, status.leave_at)
            left_s, heard_tick = self._clock.until(moment, now) or 0.0, self._clock.tick_at(moment, now)
            at_tick, late = max(heard_tick or tick, tick), "it heard late of it"
        self._left[meet.meeting] = dict(status.released)
        self._waits = None
        self._run.leave_meeting(tick, at_tick)
        self._leaving = (meet.meeting, at_tick) if left_s >= _IN_TIME_S else None
        return "" if self._leaving is not None else _late(meet.meeting, late)

    def _left_behind(self, tick: int, cycle_s: float) -> str:
        """The others leave at that tick, without a robot whose program is halted so long that its next block is not
        made by then."""
        if self._leaving is None:
            return ""
        meeting, leave_tick = self._leaving
        if self._run.held:
            self._halted_at = tick
        if tick < leave_tick:
            return ""
        self._leaving = None
        in_time = (leave_tick - self._halted_at) * cycle_s >= _GOES_ON_S
        return "" if in_time else _late(meeting, "its program was halted until it was too late for that")

    def _why(self, status: MeetingStatus | None, now: float) -> str:
        """Why it waits, for people."""
        if status is None:
            fresh = self._zones.fresh(now)
            return "the manager knows no such meeting" if fresh else self._zones.silence
        if not status.missing:
            return "the manager has not heard of it yet"
        missing = "waits for " + ", and for ".join(f"{robot}, {what}" for robot, what in status.missing.items())
        deadlocks = () if self._zones.state is None else self._zones.state.deadlocks
        mine = next((each for each in deadlocks if self._robot in each.robots), None)
        return missing if mine is None else f"{missing}; that lasts for ever, {mine.text}: {mine.remedy}"


def _late(meeting: str, why: str) -> str:
    return f"leaves meeting {meeting} not together with the others: {why}"
