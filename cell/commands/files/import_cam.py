"""`cell import`: a CAM file as a program of the robot language."""

from pathlib import Path
from typing import Annotated

import typer

from cell.commands.errors import CommandError
from cell.config.document import read_text
from cell.config.points_file import CamSettings, PointsFile, cam_settings
from cell.config.problem import Problem, refuses
from cell.config.reading import read
from robot_agent.language import Names, ProgramError, parse_program
from robot_agent.language.gcode import SUFFIXES, is_cam, statements_of


def import_(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="The CAM file, G-code.", show_default=False)],
    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", metavar="FILE", help="The program to write.", show_default="FILE.prog"),
    ] = None,
    taught: Annotated[
        Path | None, typer.Option("--points", metavar="FILE", help="The points file of the robot.", show_default=False)
    ] = None,
    replace: Annotated[bool, typer.Option("--replace", help="Write over a program that is there.")] = False,
) -> None:
    """Write a CAM file as a robot program: what `CALL FILE` runs, each line of the file as a comment after its moves.

    Under `cam` the points file says what M3, T and S do, and how fast G0 is; docs/gcode.md has the codes. All mistakes
    are told with their lines, and nothing is written then.
    """
    if not is_cam(file.name):
        raise CommandError(f"{file} found, allowed a file {', '.join(SUFFIXES)}", "name the CAM file so")
    text = read_text(file)
    if isinstance(text, Problem):
        raise CommandError(f"the CAM file cannot be read\n{text}", "name a CAM file")
    cam = CamSettings() if taught is None else _cam(taught)
    try:
        program = parse_program(text, str(file), Names((), cam=cam), file.parent)
    except ProgramError as error:
        raise CommandError(f"the CAM file is refused\n{error}", "correct it; docs/gcode.md") from error
    written = file.with_suffix(".prog") if output is None else output
    if written.exists() and not replace:
        raise CommandError(f"{written} is there already", "--replace writes over it, -o names another program")
    try:
        written.write_text(_program(text, file.name, cam), encoding="utf-8")
    except OSError as error:
        raise CommandError(
            f"{written} cannot be written: {error.strerror or error}", "-o names another place"
        ) from error
    typer.echo(f"{written}: {len(program.statements)} statements")


def _cam(file: Path) -> CamSettings:
    """What a points file says of CAM files; its points may name what nobody knows here."""
    reading = read(file, PointsFile, {})
    if reading.content is None or refuses(reading.problems):
        problems = "\n".join(map(str, reading.problems))
        raise CommandError(problems, "correct the points file; docs/points_file.md")
    return cam_settings(reading.content.cam)


def _program(text: str, name: str, cam: CamSettings) -> str:
    """The program; a line of the file stands after the first of its statements, or alone where it has none."""
    blocks = text.splitlines()
    lines, done = [f"; {name}, written by cell import"], 0
    for line, _, statement in statements_of(text, cam, lambda _line, _mistake: None):
        lines += [_comment(block) for block in blocks[done : line - 1]]
        lines.append(statement if done >= line else f"{statement} ; {blocks[line - 1].strip()}")
        done = max(done, line)
    return "\n".join([*lines, *map(_comment, blocks[done:])]) + "\n"


def _comment(block: str) -> str:
    return f"; {block.strip()}" if block.strip() else ""
