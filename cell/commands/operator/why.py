"""`cell why`: what a robot waits for, who keeps it waiting, and what would let it go on."""

import time
from pathlib import Path

import typer

from cell.commands.client.cell_view import Snapshot
from cell.commands.client.connection import STATE_TIMEOUT_S, connect
from cell.commands.errors import CommandError
from cell.commands.options import CELL_FILE, CellFileOption, ConnectOption, RobotArgument
from cell.messages import Clearance, Mode, RobotState
from cell.view.words import unreferenced
from cell.view.words import why as reason_of

_LISTENS_S = 0.3
"""Who asks for room is answered much more often than that."""
_STANDS = {
    Mode.READY: "no program runs: cell run {robot}",
    Mode.HALTED: "it is halted: cell continue {robot}",
    Mode.DISABLED: "its drives are off: cell enable {robot}",
    Mode.OFF_PATH: "it stands beside its path: cell return {robot}",
    Mode.STARTING: "it has not heard its drives yet: cell drives",
    Mode.ENABLING: "its drives are being switched on",
    Mode.JOGGING: "it is being jogged",
    Mode.ESTOP: "an emergency stop holds it: cell reset",
    Mode.FAULT: "it is in a fault: cell reset {robot}",
}
"""What would let a robot go on that does not wait for another one."""


def why(robot: RobotArgument, file: CellFileOption = Path(CELL_FILE), endpoint: ConnectOption = None) -> None:
    """Say what a robot waits for: who keeps it waiting, which links, since when, and what would free it.

    Whoever keeps it waiting is looked at in the same way, and so on.
    """
    with connect(file, endpoint) as operator:
        operator.check_robot(robot)
        answers = operator.session.watch("robot/*/clearance")
        seen = operator.view.wait_for(lambda seen: robot in seen.robots and seen.manager is not None, STATE_TIMEOUT_S)
        time.sleep(_LISTENS_S)
        clearances = {each.robot: each for each in answers.take_new() if isinstance(each, Clearance)}
        seen = operator.view.look()
        if robot not in seen.robots:
            raise CommandError(f"robot {robot} does not answer", "see who is silent: cell status")
        for line in explained(robot, seen, clearances):
            typer.echo(line)


def explained(robot: str, seen: Snapshot, clearances: dict[str, Clearance]) -> list[str]:
    """What a robot waits for, then what that one waits for who keeps it waiting, until it is clear who can help."""
    lines: list[str] = []
    asked: list[str] = []
    while robot and robot not in asked:
        asked.append(robot)
        line, robot = _one(robot, seen, clearances.get(robot))
        lines.append(line)
    deadlocks = seen.manager.deadlocks if seen.manager is not None else ()
    mine = next((each for each in deadlocks if not set(each.robots).isdisjoint(asked)), None)
    if mine is not None:
        lines.append(f"{' and '.join(mine.robots)} wait for each other: {mine.remedy}")
    return lines


def _one(robot: str, seen: Snapshot, clearance: Clearance | None) -> tuple[str, str]:
    """What one robot waits for, and who keeps it waiting; empty for nobody."""
    state = seen.robots.get(robot)
    if state is None:
        return f"{robot} does not answer: cell status says what starts its agent", ""
    if lost := unreferenced(seen.gateways.values()).get(robot):
        return f"{robot} does not know where it is: {lost}", ""
    reason = reason_of(state)
    refusal = None if clearance is None else clearance.refused
    if refusal is not None and reason == refusal.text:
        return f"{robot} waits{_since(refusal.since, seen)}: {reason}", refusal.by
    for name, zone in seen.manager.zones.items() if seen.manager is not None else ():
        if reason.startswith(f"zone {name}:"):
            holder = zone.holder if zone.holder is not None and zone.holder != robot else zone.by
            stood = state.waited_s.get(name)
            since = "" if stood is None else f", at rest for this zone {stood:.1f} s since its program began"
            return f"{robot} waits{since}: {reason}", holder
    for name, meeting in seen.manager.meetings.items() if seen.manager is not None else ():
        if reason.startswith(f"meeting {name}:"):
            return f"{robot} waits: {reason}", next(iter(meeting.missing), "")
    if reason and state.program.waits_s is not None and reason == state.waiting_for:
        return f"{robot} waits, for {state.program.waits_s:.1f} s so far: {reason}", ""
    if reason:
        helps = f"; {_stands(robot, state)}" if state.mode in _STANDS and "`cell " not in reason else ""
        return f"{robot} ({state.mode.value}): {reason}{helps}", ""
    return f"{robot} waits for nothing: {_stands(robot, state)}", ""


def _since(since: float, seen: Snapshot) -> str:
    return "" if seen.manager is None else f", for {max(0.0, seen.manager.cell_time - since):.1f} s so far"


def _stands(robot: str, state: RobotState) -> str:
    if state.virtual is not None:
        return f"it stands, and its program runs virtually: cell stop {robot}"
    if state.mode in _STANDS:
        return _STANDS[state.mode].format(robot=robot)
    return f"it moves, line {state.program.line} {state.program.text}"
