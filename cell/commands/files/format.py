"""`cell format`: programs written in one way."""

import os
import shutil
from pathlib import Path
from typing import Annotated

import typer

from cell.commands.errors import CommandError
from cell.config.document import read_text
from cell.config.problem import Problem
from robot_agent.language.form import formatted


def format_(
    programs: Annotated[list[Path], typer.Argument(metavar="PROGRAM...", help="Program files.", show_default=False)],
    check: Annotated[bool, typer.Option("--check", help="Change nothing; exit with 1 if a file would change.")] = False,
) -> None:
    """Write programs in one way: long forms, statements in upper case; what they mean does not change.

    `F100` becomes `F=100`, `name:` LABEL name, `TRK` TRACK, `//` a `;`. Comments, blank lines and indents stay.
    """
    changed = []
    for program in programs:
        text = read_text(program)
        if isinstance(text, Problem):
            raise CommandError(f"the program cannot be read\n{text}", "name program files")
        if formatted(text) != text:
            changed.append(program)
            if not check:
                _put(program, formatted(text))
    for program in changed:
        typer.echo(f"{program}: {'would change' if check else 'written anew'}")
    if check and changed:
        raise typer.Exit(1)


def _put(file: Path, text: str) -> None:
    """In the place of the file at once: a program is never half written."""
    beside = file.with_name(f".{file.name}.new")
    try:
        beside.write_text(text, encoding="utf-8")
        shutil.copymode(file, beside)
        os.replace(beside, file)
    except OSError as error:
        raise CommandError(f"{file} cannot be written: {error.strerror or error}", "make it writable") from error
    finally:
        beside.unlink(missing_ok=True)
