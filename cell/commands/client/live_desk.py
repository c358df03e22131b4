"""Orders from a page or a monitor to the running cell."""

import threading
import time
from collections.abc import Callable, Sequence
from typing import Self

from cell.commands.client.connection import TRY_S, Connection, ask_until_answered
from cell.commands.emergency.answers import Answers
from cell.commands.emergency.door import DOOR_S, OPEN_S, PERIOD_S, Door, Stop
from cell.commands.emergency.words import HARD_WIRED, operator_name
from cell.commands.errors import CommandError
from cell.messages import Command, Go, Heard, Jog, JogHeld, Reply
from cell.net.errors import CallError
from cell.net.session import new_call
from cell.view.desk import NoAnswer

_DOORS_OPEN_S = 8.0
"""So long a stop is repeated through every door."""


class LiveDesk:
    """Orders to the running cell; any thread may give them. A context manager, which ends with no stop on its way."""

    def __init__(self, operator: Connection, by: str, endpoints: Sequence[str] = ()) -> None:
        """`by`: what the operator uses, for example "by the page"; `endpoints`: doors beside the cell file's."""
        self._operator = operator
        self._endpoints = endpoints
        self.operator = f"{operator_name()} {by}"
        self._stops: list[threading.Thread] = []
        self._leaving = False

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        """Stay until the manager has latched each stop, or nobody has in all the time of one."""
        self._leaving = True
        for stop in self._stops:
            stop.join()

    def ask(self, to: str, command: Command, heard: Heard) -> Reply:
        """See `Desk`; what is worded by the files here is not sent to an agent that runs with others."""
        if isinstance(command, Jog | Go):
            try:
                self._operator.check_files(to, self._operator.presence(to.removeprefix("robot/")).digest)
            except CommandError as error:
                raise NoAnswer(f"{command.verb}: {error.what}; nothing was sent; {error.next_step}") from error
        patience_s = command.answer_within_s + TRY_S
        try:
            return ask_until_answered(
                self._operator.session, to, new_call(command, heard), patience_s, self._operator.stop
            )
        except CallError as error:
            raise NoAnswer(f"{command.verb}: {to} gave no usable answer: {error}; look what was done") from error

    def hold(self, message: JogHeld) -> None:
        """See `Desk`."""
        self._operator.session.publish(message)

    def stop_all(self, tell: Callable[[str], None]) -> None:
        """See `Desk`: by the path of `cell estop`, which needs neither the manager nor this session."""
        stop = threading.Thread(target=self._stop_all, args=(tell,))
        self._stops.append(stop)
        stop.start()

    def _stop_all(self, tell: Callable[[str], None]) -> None:
        settings, doors, answers = self._operator.settings, list[Door](), Answers()
        own = (settings.manager_endpoint, *(gateway.endpoint for gateway in settings.gateways.values()))
        stop = Stop(self.operator, "operator")
        try:
            for endpoint in dict.fromkeys((*own, *self._endpoints)):
                doors.append(Door(endpoint, (settings.name,), stop, answers, lambda: None))
            self._tell(doors, answers, tell)
        except Exception as error:
            tell(f"the emergency stop may not have gone out, {HARD_WIRED}: {error!r}")
        finally:
            for door in doors:
                door.close()
            for door in doors:
                door.join(OPEN_S)

    def _tell(self, doors: list[Door], answers: Answers, tell: Callable[[str], None]) -> None:
        """Tell what becomes of a stop until its time is over, or an operator leaves and the manager has latched it."""
        began, pause, told = time.monotonic(), threading.Event(), ""
        while (waited_s := time.monotonic() - began) < _DOORS_OPEN_S and not (self._leaving and answers.latched):
            text = _became(doors, waited_s >= DOOR_S)
            if text not in ("", told):
                told = text
                tell(text)
            pause.wait(PERIOD_S)


def _became(doors: list[Door], all_tried: bool) -> str:
    """What became of a stop; who does not answer is told after all doors had their time."""
    sent = [door.state for door in doors if door.sent]
    closed = [door.state for door in doors if not door.sent] if all_tried else []
    if sent:
        return "; ".join((f"emergency stop sent through {', '.join(sent)}", *closed))
    return f"NO emergency stop was sent, {HARD_WIRED}: {'; '.join(closed)}" if all_tried else ""
