"""`cell examples`: the shipped cells, as files to run and to change."""

import shutil
from pathlib import Path

import typer

from cell.commands.errors import CommandError

_SHIPPED = Path(__file__).parents[3] / "cell_configs"


def examples() -> None:
    """Write the example cells with their drives, programs and robot models to the folder cell_configs, here.

    The examples of every command's --help work from here then. A folder of that name stays as it is.
    """
    written = Path("cell_configs")
    if written.exists():
        raise CommandError(f"{written} is there already", "change to another folder")
    try:
        shutil.copytree(_SHIPPED, written, ignore=shutil.ignore_patterns(".zencell"))
    except OSError as error:
        shutil.rmtree(written, ignore_errors=True)
        raise CommandError(f"{written} cannot be written here: {error}", "change to another folder") from error
    cells = sorted(file.parent.name for file in written.glob("*/cell.yaml"))
    typer.echo(f"{written}: {', '.join(cells)}\n  next: cell up {written / 'two_arms' / 'cell.yaml'}")
