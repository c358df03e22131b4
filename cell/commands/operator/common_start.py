"""`cell run` with several robots: one start at a moment of the cell clock."""

from collections.abc import Sequence

import typer

from cell.commands.client.connection import STATE_TIMEOUT_S, Connection
from cell.commands.errors import CommandError, quoted
from cell.messages import CellTime, Halt, Run

AHEAD_S = 2.0


def run_together(operator: Connection, robots: Sequence[str], ahead_s: float, lasting_s: float | None = None) -> None:
    """Order all robots to begin `ahead_s` from now, and to end their first motions `lasting_s` later if they can.

    Raises `CommandError` when one refuses, the others halted.
    """
    twice = sorted({robot for robot in robots if robots.count(robot) > 1})
    if twice:
        raise CommandError(f"{twice[0]} a second time, allowed is each robot once")
    for robot in robots:
        operator.check_robot(robot)
    manager = operator.view.wait_for(lambda seen: seen.manager is not None, STATE_TIMEOUT_S).manager
    if manager is None:
        raise CommandError(
            "the manager does not answer, and a common start goes by its clock",
            f"start it with: cell manager {quoted(operator.file)}",
        )
    order = Run(CellTime(manager.boot, manager.cell_time + ahead_s), lasting_s)
    ordered: list[str] = []
    for robot in robots:
        try:
            reply = operator.ask_robot(robot, order)
            refusal = "" if reply.ok else f"{robot} refuses: {reply.text}"
        except CommandError as error:
            refusal = f"{robot}: {error}"
            ordered.append(robot)
        if refusal:
            _halt(operator, ordered)
            raise CommandError(refusal)
        ordered.append(robot)
    begin = "begin together" if len(robots) > 1 else "begins"
    typer.echo(f"{', '.join(robots)} {begin} at cell time {manager.cell_time + ahead_s:.2f} s")


def _halt(operator: Connection, robots: Sequence[str]) -> None:
    """Halt robots that must not begin, whether or not they have heard of it."""
    for robot in robots:
        try:
            typer.echo(operator.ask_robot(robot, Halt()).text, err=True)
        except CommandError as error:
            typer.echo(f"{robot}: {error}: halt it by hand", err=True)
