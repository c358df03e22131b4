"""`cell estop`: send the stop on every door at once, then find out who stands, then tell."""

import os
import signal
import sys
import threading
import time
from shlex import quote

from cell.commands.emergency.answers import Answers, Member
from cell.commands.emergency.door import DOOR_S, Door, Stop
from cell.commands.emergency.recipients import DELAY_S, Recipients, read_leniently, read_strictly, stored_beside
from cell.commands.emergency.wanted import Wanted, wanted
from cell.commands.emergency.words import HARD_WIRED, open_standard_streams, operator_name, say

STANDSTILL_S = 5.0
"""After the cell's `estop_delay_s` a gateway has this long for a quick stop, for brakes and for switching off."""
NEWS_S = 3.0
"""After this an operator is told for whom the command still waits."""
REMINDER = "This is a software stop: it supports and never replaces a hard-wired emergency stop."
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
    stop, answers, sent = Stop(operator_name(), asked.reason), Answers(), threading.Event()
    doors = [Door(endpoint, cells, stop, answers, sent.set) for endpoint, cells in _ways(asked, said, stored)]
    try:
        if not doors or not sent.wait(DOOR_S):
            return _unsent(asked, doors)
        told = _tell_sent(doors, set())
        members = _members(asked, said, stored)
        missing = _tell_who_stands(answers, members, doors, told)
        for door in doors:
            if not door.sent:
                say(door.state, error=True)
    finally:
        _close(doors)
    return _end(asked, members, missing, _strangers(doors, members))


def _ways(asked: Wanted, said: Recipients, stored: list[Recipients]) -> list[tuple[str, tuple[str, ...]]]:
    """Every endpoint with the names of the cells that are meant there; without names, all that are there are."""
    cells = tuple(dict.fromkeys(each.cell for each in (said, *stored) if each.cell))
    own = [endpoint for each in (said, *stored) for endpoint in each.endpoints]
    others = cells if asked.file_given else ()
    ways = [*((endpoint, others) for endpoint in asked.endpoints), *((endpoint, cells) for endpoint in own)]
    return list(dict.fromkeys(ways))


def _tell_sent(doors: list[Door], told: set[str]) -> set[str]:
    """Tell through which doors the stop went out, those that were `told` excepted; return all that are told now."""
    sent = dict.fromkeys(door.state for door in doors if door.sent)
    if new := [state for state in sent if state not in told]:
        say(f"emergency stop sent through {', '.join(new)}")
    return told | {*sent}


def _strangers(doors: list[Door], members: list[Recipients]) -> list[str]:
    """The cells that were stopped and of which nobody can say who belongs to them."""
    return sorted({cell for door in doors for cell in door.others} - {each.cell for each in members})


def _close(doors: list[Door]) -> None:
    """End all sessions in order; one whose other side has frozen is left to the end of the process."""
    deadline = time.monotonic() + _CLOSE_S
    for door in doors:
        door.close()
    for door in doors:
        if door.sent:
            door.join(max(0.0, deadline - time.monotonic()))


def _unsent(asked: Wanted, doors: list[Door]) -> int:
    why = "; ".join(door.state for door in doors) or (
        f"{asked.file}: no such cell file, or no endpoint in it, and no process of the cell has stored one"
    )
    say(f"cell: NO emergency stop was sent: {why}\n  next: {HARD_WIRED}; endpoints can be named with -e", error=True)
    return 1


def _members(asked: Wanted, said: Recipients, stored: list[Recipients]) -> list[Recipients]:
    """The cells that must confirm, with all that belongs to them; empty when nobody can say."""
    strict = read_strictly(asked.file)
    if strict is not None:
        return [strict]
    return [each for each in stored if each.cell == said.cell] or stored


def _tell_who_stands(answers: Answers, members: list[Recipients], doors: list[Door], told: set[str]) -> list[str]:
    """Tell who confirms, as it comes, until all have or the time is up; return who has not.

    Doors that open meanwhile are told, too; `told` are those that were. When nobody can say who belongs to a cell, the
    whole time is waited and nobody of it is missing.
    """
    open_ = {(each.cell, *who) for each in members for who in each.members()}
    waits_s = max((each.estop_delay_s for each in members), default=DELAY_S) + STANDSTILL_S
    confirmed: set[Member] = set()
    began = time.monotonic()
    waiting_told = manager_told = False
    pause = threading.Event()
    while open_ or not members or _strangers(doors, members) or not manager_told:
        told = _tell_sent(doors, told)
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


def _name(member: Member, members: list[Recipients]) -> str:
    cell, role, name = member
    return f"{role} {name}" + (f" of {cell}" if [cell] != [each.cell for each in members] else "")


def _tell_manager(latched: bool, text: str) -> None:
    if latched:
        say(f"manager: {text}")
    else:
        say(f"the manager does not confirm ({text}); robots and gateways hear the stop directly", error=True)


def _end(asked: Wanted, members: list[Recipients], missing: list[str], strangers: list[str]) -> int:
    """The last words, and the exit code."""
    if asked.ignored:
        say(f"cell: ignored: {' '.join(map(quote, asked.ignored))}; for the options: cell estop --help", error=True)
    say(REMINDER)
    file = quote(str(asked.file))
    if members and not missing and not strangers:
        say(f"When the cause is gone: cell reset -f {file}")
        return 0
    why = [f"not confirmed in time by: {', '.join(missing)}"] if missing else []
    if strangers or not members:
        why.append(f"nobody can say who belongs to {', '.join(strangers) or 'this cell'}")
    say(f"cell: {'; '.join(why)}\n  next: {HARD_WIRED}, then look with: cell status -f {file}", error=True)
    return 1
