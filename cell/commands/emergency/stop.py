"""`cell estop`: send the stop on every door at once, then find out who stands, then tell."""

import os
import signal
import sys
import threading
import time
from shlex import quote

from cell.commands.emergency.answers import Answers, Member
from cell.commands.emergency.door import Door, Stop
from cell.commands.emergency.reach import DELAY_S, Reach, read_leniently, read_strictly, stored_beside
from cell.commands.emergency.wanted import Wanted, wanted
from cell.commands.emergency.words import open_standard_streams, operator_name, say

DOOR_S = 0.8
"""A door that does not open within this is told; with the command's start, the error of none is out within 1 s."""
STANDSTILL_S = 5.0
"""After the cell's `estop_delay_s` a gateway has this long for a quick stop, for brakes and for switching off."""
NEWS_S = 3.0
"""After this an operator is told for whom the command still waits."""
REMINDER = "This is a software stop: it supports and never replaces a hard-wired emergency stop."
HARD_WIRED = "use the hard-wired emergency stop"
_LOOK_S = 0.02
_CLOSE_S = 0.3


def main() -> None:
    """Run `cell estop` with the words of the command line, and end the process with whatever is still open."""
    signal.signal(signal.SIGHUP, signal.SIG_IGN)
    code = 1
    try:
        open_standard_streams()
        code = stop_cell(wanted(sys.argv[2:]))
    except Exception as error:
        say(f"cell: the emergency stop may not have gone out: {error!r}\n  next: {HARD_WIRED}", error=True)
    finally:
        os._exit(code)


def stop_cell(asked: Wanted) -> int:
    """Send the stop and tell who has confirmed it; the exit code is 0 when everyone has."""
    said = read_leniently(asked.file)
    stored = stored_beside(asked.file, asked.state_dir, said)
    endpoints = dict.fromkeys((*asked.endpoints, *said.endpoints, *(e for reach in stored for e in reach.endpoints)))
    cells = tuple(dict.fromkeys(reach.cell for reach in (said, *stored) if reach.cell))
    stop, answers, sent = Stop(operator_name(), asked.reason), Answers(), threading.Event()
    doors = [Door(endpoint, cells, stop, answers, sent.set) for endpoint in endpoints]
    try:
        if not doors or not sent.wait(DOOR_S):
            return _unsent(asked, doors)
        say(f"emergency stop sent through {', '.join(door.endpoint for door in doors if door.sent)}")
        members = _members(asked, said, stored)
        missing = _tell_who_stands(answers, members)
        for door in doors:
            if not door.sent:
                say(_closed(door), error=True)
    finally:
        _close(doors)
    return _end(asked, members, missing)


def _close(doors: list[Door]) -> None:
    """End all sessions in order; one whose other side has frozen is left to the end of the process."""
    deadline = time.monotonic() + _CLOSE_S
    for door in doors:
        door.close()
    for door in doors:
        if door.sent:
            door.join(max(0.0, deadline - time.monotonic()))


def _closed(door: Door) -> str:
    return f"nobody answers at {door.endpoint}" + (f" ({door.problem})" if door.problem else "")


def _unsent(asked: Wanted, doors: list[Door]) -> int:
    why = "; ".join(map(_closed, doors)) or (
        f"{asked.file}: no such cell file, or no endpoint in it, and no process of the cell has stored one"
    )
    say(f"cell: NO emergency stop was sent: {why}\n  next: {HARD_WIRED}; endpoints can be named with -e", error=True)
    return 1


def _members(asked: Wanted, said: Reach, stored: list[Reach]) -> list[Reach]:
    """The cells that must confirm, with all that belongs to them; empty when nobody can say."""
    strict = read_strictly(asked.file)
    if strict is not None:
        return [strict]
    return [reach for reach in stored if reach.cell == said.cell] or stored


def _tell_who_stands(answers: Answers, members: list[Reach]) -> list[str]:
    """Tell who confirms, as it comes, until all have or the time is up; return who has not.

    When nobody can say who belongs to the cell, the whole time is waited and nobody is missing.
    """
    open_ = {(reach.cell, *who) for reach in members for who in reach.members()}
    waits_s = max((reach.estop_delay_s for reach in members), default=DELAY_S) + STANDSTILL_S
    confirmed: set[Member] = set()
    began = time.monotonic()
    waiting_told = manager_told = False
    pause = threading.Event()
    while open_ or not members or not manager_told:
        for member in sorted(answers.standing() - confirmed):
            confirmed.add(member)
            open_.discard(member)
            say(f"confirmed: {_name(member, members)}")
        if not manager_told and (manager := answers.manager) is not None:
            manager_told = True
            _tell_manager(*manager)
        waited_s = time.monotonic() - began
        if waited_s > waits_s:
            break
        if waited_s > NEWS_S and open_ and not waiting_told:
            waiting_told = True
            names = ", ".join(_name(member, members) for member in sorted(open_))
            say(f"waiting up to {waits_s:.0f} s for: {names}")
        pause.wait(_LOOK_S)
    return [_name(member, members) for member in sorted(open_)]


def _name(member: Member, members: list[Reach]) -> str:
    cell, role, name = member
    return f"{role} {name}" + (f" of {cell}" if len(members) != 1 else "")


def _tell_manager(latched: bool, text: str) -> None:
    if latched:
        say(f"manager: {text}")
    else:
        say(f"the manager does not confirm ({text}); robots and gateways hear the stop directly", error=True)


def _end(asked: Wanted, members: list[Reach], missing: list[str]) -> int:
    """The last words, and the exit code."""
    if asked.ignored:
        say(f"cell: ignored: {' '.join(map(quote, asked.ignored))}; for the options: cell estop --help", error=True)
    say(REMINDER)
    file = quote(str(asked.file))
    if members and not missing:
        say(f"When the cause is gone: cell reset -f {file}")
        return 0
    why = f"not confirmed in time by: {', '.join(missing)}" if members else "nobody can say who belongs to this cell"
    say(f"cell: {why}\n  next: {HARD_WIRED}, then look with: cell status -f {file}", error=True)
    return 1
