"""Every file of a cell, read once; what the checks across files look at."""

from collections.abc import Iterator
from dataclasses import dataclass

from cell.config.cell_file import CellFile, RobotEntry
from cell.config.document import Document, Naming
from cell.config.problem import Problem
from cell.config.reading import Reading
from drive_gateway.config.drives_file import DrivesFile
from drive_gateway.config.load import read_drives
from robot_agent.model.load import read_robot
from robot_agent.model.robot_file import RobotFile


@dataclass(frozen=True, slots=True)
class Readings:
    """The cell file and what could be read of the files that it names, by robot and by gateway."""

    document: Document
    cell: CellFile
    models: dict[str, Reading[RobotFile]]
    drives: dict[str, Reading[DrivesFile]]

    def robots_of(self, gateway: str) -> list[str]:
        """The robots that the cell file gives to this gateway."""
        return [name for name, robot in self.cell.robots.items() if robot.gateway == gateway]

    def usable_models(self) -> Iterator[tuple[str, Document, RobotFile]]:
        """Robots whose model could be read."""
        for robot, reading in self.models.items():
            if reading.document is not None and reading.content is not None:
                yield robot, reading.document, reading.content

    def usable_drives(self) -> Iterator[tuple[str, Document, DrivesFile]]:
        """Gateways whose drives could be read."""
        for gateway, reading in self.drives.items():
            if reading.document is not None and reading.content is not None:
                yield gateway, reading.document, reading.content

    def problems(self) -> list[Problem]:
        """What was found in the named files, each by itself."""
        found = [reading.problems for reading in self.models.values()]
        found += [reading.problems for reading in self.drives.values()]
        return [problem for problems in found for problem in problems]


def read_named_files(document: Document, cell: CellFile) -> Readings:
    """Read the robot file of every robot and the drives file of every gateway."""
    models = {name: _model(document, name, robot) for name, robot in cell.robots.items()}
    drives: dict[str, Reading[DrivesFile]] = {}
    for name, gateway in cell.gateways.items():
        naming = Naming.of(document, "gateways", name, "drives")
        drives[name] = read_drives(naming.file(gateway.drives), naming)
    return Readings(document, cell, models, drives)


def _model(document: Document, name: str, robot: RobotEntry) -> Reading[RobotFile]:
    naming = Naming.of(document, "robots", name, "model")
    return read_robot(naming.file(robot.model), naming)
