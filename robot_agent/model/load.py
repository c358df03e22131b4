"""From a robot file to its description, or to all of its problems."""

from pathlib import Path

from cell.config.document import Naming
from cell.config.problem import ConfigError, refuses
from cell.config.reading import Reading, read
from robot_agent.model.checks import check_robot_file
from robot_agent.model.description import RobotDescription
from robot_agent.model.robot_file import RobotFile


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
    reading = read(path, RobotFile, named_by)
    if reading.document is not None and reading.content is not None:
        reading.problems += check_robot_file(reading.document, reading.content)
    return reading
