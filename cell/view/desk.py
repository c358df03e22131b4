"""Where an operator's orders go from the page: to the running cell, or nowhere, where a recording is shown."""

from collections.abc import Callable
from typing import Protocol

from cell.messages import Command, Heard, JogHeld, Reply
from cell.messages.common import Text


class NoAnswer(Exception):
    """Nobody has answered an order; for people, with what to do."""


class Desk(Protocol):
    """Takes orders."""

    operator: Text
    """Who gives them, for the log."""

    def ask(self, to: Text, command: Command, heard: Heard) -> Reply:
        """Ask `robot/<r>`, `gateway/<g>` or `manager`, in view of its state `heard`, and wait. Raises `NoAnswer`."""

    def hold(self, message: JogHeld) -> None:
        """Say that a jog key is held; never waits."""

    def stop_all(self, tell: Callable[[Text], None]) -> None:
        """Send an emergency stop on every door of the cell, at once and repeated; never waits.

        What became of it goes to `tell` within 1 s, from another thread, and again when more doors have opened.
        """
