"""From a robot file to its description, or to all of its problems."""

from pathlib import Path

from cell.config.document import Naming, read_document
from cell.config.problem import ConfigError, Problem, refuses
from cell.config.reading import Reading
from cell.config.validation import validate
from robot_agent.model.checks import check_robot_file
from robot_agent.model.description import RobotDescription
from robot_agent.model.families import file_type
from robot_agent.model.robot_file import RobotFile

URDF = ".urdf"
_STAND_INS = {
    "name": "unnamed",
    "path": {
        "speed": 1,
        "acceleration": 1,
        "jerk": 1,
        "angular_speed": 1,
        "angular_acceleration": 1,
        "angular_jerk": 1,
    },
    "capsules": ({"link": 0, "start": (0, 0, 0), "end": (0, 0, 0), "radius": 1},),
}


def load_description(path: str | Path) -> RobotDescription:
    """The robot in a robot file, in SI units.

    Raises:
        ConfigError: with every problem, each at its line and column.
    """
    reading = read_robot(Path(path))
    if reading.document is None or reading.content is None or refuses(reading.problems):
        raise ConfigError(tuple(reading.problems))
    return reading.content.description(reading.document.file.parent)


def read_robot(path: Path, named_by: Naming | None = None) -> Reading[RobotFile]:
    """The robot file, read against the schema of its family and checked in itself."""
    if path.suffix == URDF:
        return Reading(None, None, [_bare_urdf(path, named_by)])
    document, problems = read_document(path, named_by)
    if document is None:
        return Reading(None, None, problems)
    schema = file_type(document)
    content, found = validate(document, schema, {**_STAND_INS, "geometry": schema.stand_in_geometry()})
    problems += found
    if content is not None:
        problems += check_robot_file(document, content)
    return Reading(document, content, problems)


def _bare_urdf(path: Path, named_by: Naming | None) -> Problem:
    found = f"{path.name}: a URDF, which has no acceleration, jerk, home position and capsules"
    allowed = "a robot file of family urdf that names it and adds them"
    if named_by is None:
        return Problem(path, 1, 1, "file", found, allowed)
    return named_by.document.problem(named_by.path, found, allowed)
