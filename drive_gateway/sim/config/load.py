"""From the file beside a drives file to a simulation, or to all of its problems."""

from pathlib import Path

from cell.config.problem import ConfigError, Problem, refuses
from cell.config.reading import Reading, read
from drive_gateway.config.drives_file import DrivesFile
from drive_gateway.config.load import SIMULATION, read_drives
from drive_gateway.sim.config.checks import check_simulation
from drive_gateway.sim.config.simulation import Simulation
from drive_gateway.sim.config.simulation_file import SimulationFile, lag_of

_STAND_INS = {"units": {"length": "m", "angle": "rad"}}


def load_simulation(drives_file: str | Path) -> Simulation:
    """How the drives of a file are simulated, in SI units; with sensible values where no file beside it says so.

    Raises:
        ConfigError: with every problem of both files, each at its line and column.
    """
    path = Path(drives_file)
    drives = read_drives(path)
    problems: list[Problem] = list(drives.problems)
    if drives.content is not None:
        reading = read_simulation(path, drives.content)
        problems += reading.problems
        if not refuses(problems):
            return simulation_of(reading, drives.content)
    raise ConfigError(tuple(problems))


def read_simulation(drives_file: Path, drives: DrivesFile) -> Reading[SimulationFile]:
    """The file beside a drives file, read and checked against it; empty, without a problem, where there is none."""
    path = drives_file.with_suffix(SIMULATION)
    if not path.exists():
        return Reading(None, None)
    reading = read(path, SimulationFile, _STAND_INS)
    if reading.document is not None and reading.content is not None:
        reading.problems += check_simulation(reading.document, reading.content, drives)
    return reading


def simulation_of(reading: Reading[SimulationFile], drives: DrivesFile) -> Simulation:
    """What was read without problems says, or what holds where there is no file."""
    return Simulation(lag_s=lag_of(drives)) if reading.content is None else reading.content.simulation(drives)
