"""`cell schema`: JSON Schemas of the files and of the messages, for editors and for other languages."""

import json
from collections.abc import Callable
from enum import Enum
from typing import Annotated, Any

import typer

from cell.config.cell_file import CellFile
from cell.net.codec import message_schemas
from drive_gateway.config.drives_file import DrivesFile
from robot_agent.model.family_files import FILES

Schema = dict[str, Any]


class Subject(Enum):
    """What has a schema."""

    CELL = "cell"
    ROBOT = "robot"
    DRIVES = "drives"
    MESSAGES = "messages"


_SCHEMAS: dict[Subject, Callable[[], Schema]] = {
    Subject.CELL: CellFile.model_json_schema,
    Subject.ROBOT: lambda: {"oneOf": [schema.model_json_schema() for schema in FILES.values()]},
    Subject.DRIVES: DrivesFile.model_json_schema,
    Subject.MESSAGES: message_schemas,
}


def schema(
    subject: Annotated[
        Subject | None,
        typer.Argument(help="The cell file, the robot file, the drives file, or the messages.", show_default="all"),
    ] = None,
) -> None:
    """Print JSON Schemas: of one kind of file, of the messages, or of everything.

    The messages are an object with one schema per state message and per call; the two binary streams have none.
    """
    printed = _SCHEMAS[subject]() if subject is not None else {kind.value: make() for kind, make in _SCHEMAS.items()}
    typer.echo(json.dumps(printed, indent=2, ensure_ascii=False))
