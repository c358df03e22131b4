"""`cell estop` as the other commands are declared: its options and its help. `cell.commands.emergency` does it."""

from pathlib import Path
from typing import Annotated

import typer

from cell.commands.options import CELL_FILE, CellFileOption


def estop(
    context: typer.Context,
    reason: Annotated[str, typer.Option("--reason", metavar="TEXT", help="Why, for the others.")] = "operator",
    file: CellFileOption = Path(CELL_FILE),
    endpoint: Annotated[
        list[str] | None,
        typer.Option("-e", "--connect", metavar="ENDPOINT", help="Another door into the cell; may be repeated."),
    ] = None,
    state_dir: Annotated[
        Path | None,
        typer.Option(
            "--state-dir",
            metavar="FOLDER",
            help="The --state-dir of the cell's processes: where the cell listens, should its file be broken.",
        ),
    ] = None,
) -> None:
    """Stop every robot of the cell on its path and switch its drives off; only `cell reset` clears it.

    Works with and without a running manager, and with a broken cell file. It supports and never replaces a hard-wired
    emergency stop.
    """
    from cell.commands.emergency.stop import stop_cell
    from cell.commands.emergency.wanted import Wanted

    source = context.get_parameter_source("file")
    given = source is not None and source.name == "COMMANDLINE"
    raise typer.Exit(stop_cell(Wanted(file.absolute(), given, reason, tuple(endpoint or ()), state_dir)))
