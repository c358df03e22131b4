"""Orders from a page or a monitor to the running cell."""

import threading
import time
from typing import Self

from cell.commands.client.connection import TRY_S, Connection, ask_until_answered
from cell.commands.emergency.answers import Answers
from cell.commands.emergency.door import OPEN_S, PERIOD_S, Door, Stop
from cell.commands.emergency.words import operator_name
from cell.commands.errors import CommandError
from cell.messages import Command, Go, Heard, Jog, JogHeld, Reply
from cell.net.errors import CallError
from cell.net.session import new_call
from cell.view.desk import NoAnswer

_DOORS_OPEN_S = 8.0
"""So long a stop is repeated through every door."""


class LiveDesk:
    """Orders to the running cell; any thread may give them. A context manager, which ends with no stop on its way."""

    def __init__(self, operator: Connection, by: str) -> None:
        """`by`: what the operator uses, for example "by the page"."""
        self._operator = operator
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

    def stop_all(self) -> None:
        """See `Desk`: by the path of `cell estop`, which needs neither the manager nor this session."""
        stop = threading.Thread(target=self._stop_all)
        self._stops.append(stop)
        stop.start()

    def _stop_all(self) -> None:
        settings = self._operator.settings
        endpoints = (settings.manager_endpoint, *(gateway.endpoint for gateway in settings.gateways.values()))
        stop, answers = Stop(self.operator, "operator"), Answers()
        doors = [Door(endpoint, (settings.name,), stop, answers, lambda: None) for endpoint in endpoints]
        deadline, pause = time.monotonic() + _DOORS_OPEN_S, threading.Event()
        while time.monotonic() < deadline and not (self._leaving and answers.latched):
            pause.wait(PERIOD_S)
        for door in doors:
            door.close()
        for door in doors:
            door.join(OPEN_S)
