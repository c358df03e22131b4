"""The cell file that a command names: found, and read as far as the command needs it."""

import sys
from pathlib import Path

from cell.commands.client.cell_view import names
from cell.commands.errors import CommandError
from cell.config import ConfigError, load_cell, load_cell_alone
from cell.config.settings import CellSettings


def existing(file: Path) -> Path:
    """`file` as an absolute path. Raises `CommandError` when there is no such file."""
    if not file.is_file():
        raise CommandError(
            f"{file}: no such cell file",
            "name it, or for operators' commands set ZENCELL_FILE, for example to cell_configs/two_arms/cell.yaml",
        )
    return file.absolute()


def running_cell(file: Path) -> CellSettings:
    """The settings of a cell that runs, for orders to it; only the cell file itself is looked at.

    Raises `CommandError` when there is no such file, `ConfigError` with all of its problems.
    """
    return load_cell_alone(existing(file))


def checked_cell(file: Path) -> CellSettings:
    """The settings of a cell that is about to run: whatever `cell check` refuses is refused, its warnings are shown.

    Raises `CommandError` when there is no such file, `ConfigError` with all of its problems.
    """
    from cell.commands.checks import check_cell

    bundle, problems = check_cell(existing(file))
    if bundle is None:
        raise ConfigError(tuple(problems))
    for problem in problems:
        print(problem, file=sys.stderr)
    return bundle.cell


def process_cell(file: Path, parent_pipe: int | None) -> CellSettings:
    """The settings for one process of a cell; a process that `cell up` starts need not check the cell once more."""
    return checked_cell(file) if parent_pipe is None else load_cell(existing(file))


def check_robot(settings: CellSettings, file: Path, robot: str) -> None:
    """Raise `CommandError` when the cell of `file` has no such robot."""
    if robot not in settings.robots:
        raise CommandError(f"no robot {robot!r} in {file}; its robots are: {names(settings.robots)}")
