"""Every file that a cell file names, read once; what the checks across files look at."""

from collections.abc import Iterator
from dataclasses import dataclass

from cell.config.cell_file import CellFile
from cell.config.document import Document, Naming
from cell.config.problem import Problem
from cell.config.reading import Reading
from drive_gateway.config.drives_file import DrivesFile
from drive_gateway.config.load import read_drives
from drive_gateway.sim.config.load import read_simulation
from drive_gateway.sim.config.simulation_file import SimulationFile
from robot_agent.model.load import read_robot
from robot_agent.model.robot_file import RobotFile


@dataclass(frozen=True, slots=True)
class NamedFiles:
    """What could be read of the robot files, by robot, and of the drives and simulation files, by gateway."""

    models: dict[str, Reading[RobotFile]]
    drives: dict[str, Reading[DrivesFile]]
    simulations: dict[str, Reading[SimulationFile]]
    """Of gateways whose drives can be looked at; empty where no file says how they are simulated."""

    def usable_models(self) -> Iterator[tuple[str, Document, RobotFile]]:
        """Robots whose model can be looked at."""
        for robot, reading in self.models.items():
            if reading.document is not None and reading.content is not None:
                yield robot, reading.document, reading.content

    def usable_drives(self) -> Iterator[tuple[str, Document, DrivesFile]]:
        """Gateways whose drives can be looked at."""
        for gateway, reading in self.drives.items():
            if reading.document is not None and reading.content is not None:
                yield gateway, reading.document, reading.content

    def problems(self) -> list[Problem]:
        """What was found in the files of robots and real drives, each by itself."""
        found = [reading.problems for reading in self.models.values()]
        found += [reading.problems for reading in self.drives.values()]
        return [problem for problems in found for problem in problems]


@dataclass(frozen=True, slots=True)
class Readings:
    """The cell file and the files that it names."""

    document: Document
    cell: CellFile
    named: NamedFiles

    def robots_of(self, gateway: str) -> list[str]:
        """The robots that the cell file gives to this gateway."""
        return [name for name, robot in self.cell.robots.items() if robot.gateway == gateway]


def read_named_files(document: Document) -> NamedFiles:
    """Read the robot file of every robot, and the drives file of every gateway with the simulation file beside it."""
    models: dict[str, Reading[RobotFile]] = {}
    for robot in document.keys(("robots",)):
        naming = Naming(document, ("robots", robot, "model"))
        if (file := naming.file()) is not None:
            models[robot] = read_robot(file, naming)
    drives: dict[str, Reading[DrivesFile]] = {}
    for gateway in document.keys(("gateways",)):
        naming = Naming(document, ("gateways", gateway, "drives"))
        if (file := naming.file()) is not None:
            drives[gateway] = read_drives(file, naming)
    simulations = {
        gateway: read_simulation(reading.document.file, reading.content)
        for gateway, reading in drives.items()
        if reading.document is not None and reading.content is not None
    }
    return NamedFiles(models, drives, simulations)
