"""One line per robot: what it does, what keeps it, since when, and what to do next."""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum

from cell.config.settings import CellSettings
from cell.messages import (
    Clearance,
    Event,
    GatewayState,
    ManagerState,
    Mode,
    ProgramState,
    RobotState,
    ZoneState,
)
from cell.messages.common import Name, Text
from cell.view.newest import Newest
from cell.view.words import ALARMED, forced_text, mounted_text, pace_text, program_text, unreferenced, why

_NUMBER = re.compile(r"[\d.]+")


class Tone(Enum):
    """How a line should look."""

    MOVES = "moves"
    WAITS = "waits"
    STANDS = "stands"
    ALARM = "alarm"


@dataclass(frozen=True, slots=True)
class Line:
    """What an operator reads of one robot."""

    robot: Name
    tone: Tone
    mode: Text
    program: Text
    """The line in execution, with its number."""
    rate: Text
    """How fast it goes and who rules that; empty where it simply follows its plan."""
    reason: Text
    """What it waits for, or what is wrong."""
    since_s: float | None
    """So long the reason has been the same."""
    waits_for: Name
    """The robot that it waits for; empty for none."""
    next: Text
    """What to do, or that nothing has to be done."""


_NEXT = {
    Mode.STARTING: "wait: its agent has not heard its drives yet; look at Drives if it lasts",
    Mode.DISABLED: "switch its drives on: Enable (cell enable {robot})",
    Mode.ENABLING: "wait: its drives are being switched on",
    Mode.READY: "start its program: Run (cell run {robot}), or jog it",
    Mode.HALTED: "let it go on: Continue (cell continue {robot})",
    Mode.OFF_PATH: "look at the way back, then: Return (cell return {robot})",
    Mode.RETURNING: "nothing: it goes back to its path",
    Mode.JOGGING: "nothing: it is being jogged",
    Mode.FAULT: "remove the cause, then: Reset (cell reset {robot}), Enable",
    Mode.ESTOP: "when the cause is gone: Reset (cell reset), Enable, then Continue or Run",
}
_MOVES = frozenset({Mode.RETURNING, Mode.JOGGING})


class NowLines:
    """The lines of all robots, look by look: it knows since when a reason has been the same."""

    def __init__(self, settings: CellSettings) -> None:
        self._settings = settings
        self._since: dict[Name, tuple[Text, float]] = {}

    def of(self, seen: Newest) -> list[Line]:
        """One line for each robot of the cell file."""
        lost = unreferenced(seen.of(GatewayState).values())
        return [self._line(robot, seen, lost.get(robot, "")) for robot in self._settings.robots]

    def _line(self, robot: Name, seen: Newest, lost: Text) -> Line:
        state = seen.of(RobotState).get(robot)
        if state is None:
            remedy = f"start its agent: robot-agent {self._settings.file} {robot}"
            reason = "its agent does not answer"
            return Line(robot, Tone.ALARM, "silent", "", "", reason, self._age(robot, reason, seen), "", remedy)
        alarms = why(state)
        reason = alarms or (f"does not know where it is: {lost}" if lost else _held(state))
        other = _waits_for(state, seen) if reason else ""
        return Line(
            robot,
            _tone(state, reason),
            state.mode.value.replace("_", " "),
            f"{state.program.line}  {program_text(state)}" if state.program.line else program_text(state),
            ", ".join(filter(None, (_rate(state), mounted_text(state), forced_text(state)))),
            reason,
            self._age(robot, reason, seen),
            other,
            _next(state, reason, lost, other, seen),
        )

    def _age(self, robot: Name, reason: Text, seen: Newest) -> float | None:
        """How long ago a reason came up; numbers in it may change meanwhile."""
        same = _NUMBER.sub("", reason)
        before, at = self._since.get(robot, ("", seen.now))
        if same != before or seen.now < at:
            at = seen.now
        self._since[robot] = same, at
        return seen.now - at if reason else None


def _tone(state: RobotState, reason: Text) -> Tone:
    if state.mode in ALARMED or state.program.state in (ProgramState.FAILED, ProgramState.INTERRUPTED):
        return Tone.ALARM
    if state.mode is Mode.RUNNING:
        return Tone.WAITS if reason else Tone.MOVES
    return Tone.MOVES if state.mode in _MOVES else Tone.STANDS


def _held(state: RobotState) -> Text:
    """Who keeps a running robot at rest, where it waits for nothing that has a name of its own."""
    governor = state.governor
    return governor.ruled_by if state.mode is Mode.RUNNING and governor is not None and governor.rate == 0.0 else ""


def _rate(state: RobotState) -> Text:
    governor = state.governor
    if text := pace_text(state):
        return text
    return f"rate {100.0 * governor.rate:.0f} %" if state.mode is Mode.RUNNING and governor is not None else ""


def _waits_for(state: RobotState, seen: Newest) -> Name:
    """The robot that keeps this one waiting, by what was cleared for it and by the zones."""
    if state.mode is not Mode.RUNNING and state.mode is not Mode.JOGGING:
        return ""
    clearance = seen.of(Clearance).get(state.robot)
    if clearance is not None and clearance.refused is not None and clearance.refused.text == state.waiting_for:
        return clearance.refused.by
    manager = seen.one(ManagerState)
    for name, zone in manager.zones.items() if manager is not None else ():
        if state.waiting_for.startswith(f"zone {name}:") and zone.holder not in (None, state.robot):
            return zone.holder or ""
    return ""


def _next(state: RobotState, reason: Text, lost: Text, other: Name, seen: Newest) -> Text:
    manager = seen.one(ManagerState)
    robot = state.robot
    if manager is None:
        return "start the manager again: nobody moves without it (cell manager)"
    for deadlock in manager.deadlocks:
        if robot in deadlock.robots:
            return deadlock.remedy
    if state.mode is Mode.ESTOP:
        return _NEXT[state.mode]
    if state.mode in ALARMED:
        return _remedy(state, seen) or _NEXT[state.mode].format(robot=robot)
    if lost:
        return lost
    if state.program.flag is not None:
        return f"answer the flag: cell flag {robot} {state.program.flag}"
    if state.mode is not Mode.RUNNING:
        return _NEXT[state.mode].format(robot=robot)
    for name, zone in manager.zones.items():
        if reason.startswith(f"zone {name}:") and zone.state is ZoneState.ORPHANED:
            return f"look whether somebody is inside, then: cell zone clear {name}"
    if other:
        return _other_first(other, seen)
    if reason.startswith("WAIT,"):
        return "nothing: its program pauses"
    return f"see what it waits for: cell why {robot}" if reason else "nothing: it runs"


def _other_first(other: Name, seen: Newest) -> Text:
    """Where another robot is in the way: it goes out of it by itself, or somebody has to let it."""
    state = seen.of(RobotState).get(other)
    if state is None or state.mode is Mode.RUNNING or state.mode in _MOVES:
        return f"nothing: it goes on when {other} is out of its way"
    return f"first {other}, which is in its way: {_NEXT[state.mode].format(robot=other)}"


def _remedy(state: RobotState, seen: Newest) -> Text:
    """What the newest event with one of the robot's alarms says."""
    told: Mapping[Text, Text] = {
        each.message.text: each.message.remedy for _, each in seen.events if isinstance(each.message, Event)
    }
    return next((told[alarm] for alarm in state.alarms if told.get(alarm)), "")
