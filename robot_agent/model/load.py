"""From a robot file to its description, or to all of its problems."""

from pathlib import Path

from cell.config.document import Naming
from cell.config.problem import ConfigError, refuses
from cell.config.reading import Reading, read
from robot_agent.model.checks import check_robot_file
from robot_agent.model.description import RobotDescription
from robot_agent.model.robot_file import RobotFile

_STAND_INS = {
    "name": "unnamed",
    "geometry": {"a1z": 0, "a2x": 0, "a2z": 0, "a3z": 1, "a4x": 1, "a4z": 0, "a5x": 0, "a6x": 0},
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
    if reading.content is None or refuses(reading.problems):
        raise ConfigError(tuple(reading.problems))
    return reading.content.description()


def read_robot(path: Path, named_by: Naming | None = None) -> Reading[RobotFile]:
    """The robot file, read and checked in itself."""
    reading = read(path, RobotFile, _STAND_INS, named_by)
    if reading.document is not None and reading.content is not None:
        reading.problems += check_robot_file(reading.document, reading.content)
    return reading
