"""`cell schema`: JSON Schemas of the files and of the messages, for editors and for other languages."""

import json
from collections.abc import Callable
from enum import Enum
from typing import Annotated

import typer

from cell.commands.errors import CommandError
from cell.commands.files.reference import Schema, reference
from cell.config.cell_file import CellFile
from cell.config.points_file import PointsFile
from cell.net.codec import message_schemas
from drive_gateway.config.drives_file import DrivesFile
from drive_gateway.sim.config.simulation_file import SimulationFile
from robot_agent.model.families import FAMILIES


class Subject(Enum):
    """What has a schema."""

    CELL = "cell"
    ROBOT = "robot"
    DRIVES = "drives"
    SIMULATION = "simulation"
    POINTS = "points"
    MESSAGES = "messages"


_SCHEMAS: dict[Subject, Callable[[], Schema]] = {
    Subject.CELL: CellFile.model_json_schema,
    Subject.ROBOT: lambda: {"oneOf": [family.file.model_json_schema() for family in FAMILIES.values()]},
    Subject.DRIVES: DrivesFile.model_json_schema,
    Subject.SIMULATION: SimulationFile.model_json_schema,
    Subject.POINTS: PointsFile.model_json_schema,
    Subject.MESSAGES: message_schemas,
}


KEYS = {
    Subject.CELL: "Keys of a cell file",
    Subject.DRIVES: "Keys of a drives file",
    Subject.SIMULATION: "Keys of a simulation file",
    Subject.POINTS: "Keys of a points file",
}


def keys_of(subject: Subject) -> str:
    """The reference of a file's keys, as in `docs/cell_file.md`."""
    return reference(_SCHEMAS[subject](), KEYS[subject])


def schema(
    subject: Annotated[
        Subject | None,
        typer.Argument(
            help="The cell, robot, drives or points file, the file of a simulation, or the messages.",
            show_default="all",
        ),
    ] = None,
    keys: Annotated[bool, typer.Option("--keys", help="The keys of a file as tables in Markdown, to read.")] = False,
) -> None:
    """Print JSON Schemas: of one kind of file, of the messages, or of everything.

    The messages are an object with one schema per state message and per call; the two binary
    streams have none, and of a presence it is that of its head.
    """
    if keys:
        if subject not in KEYS:
            raise CommandError(
                f"cell schema --keys: found {subject.value if subject else 'no subject'}",
                f"allowed: {', '.join(each.value for each in KEYS)}",
            )
        typer.echo(keys_of(subject), nl=False)
        return
    printed = _SCHEMAS[subject]() if subject is not None else {kind.value: make() for kind, make in _SCHEMAS.items()}
    typer.echo(json.dumps(printed, indent=2, ensure_ascii=False))
