"""From the file beside a drives file to a simulation, or to all of its problems."""

from collections.abc import Iterator
from pathlib import Path

from cell.config.problem import ConfigError, Problem, Severity, refuses
from cell.config.reading import Reading, read
from drive_gateway.config.drives_file import DrivesFile
from drive_gateway.config.load import SIMULATION, read_drives
from drive_gateway.sim.config.checks import check_simulation
from drive_gateway.sim.config.simulation import Simulation
from drive_gateway.sim.config.simulation_file import SimulationFile, lag_of

_WARNING = Severity.WARNING
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
    """The file beside a drives file, read and checked against it; empty where there is none.

    Then files of that kind that belong to no drives file are warned of: one of them may be meant.
    """
    path = drives_file.with_suffix(SIMULATION)
    if not path.exists():
        return Reading(None, None, list(_strays(drives_file)))
    reading = read(path, SimulationFile, _STAND_INS)
    if reading.document is not None and reading.content is not None:
        reading.problems += check_simulation(reading.document, reading.content, drives)
    return reading


def _strays(drives_file: Path) -> Iterator[Problem]:
    try:
        files = sorted(drives_file.parent.iterdir())
    except OSError:
        return  # whoever may not list a folder may still read files of it
    names = {file.stem for file in files if not file.name.endswith(SIMULATION)}
    for file in files:
        if file.name.endswith(SIMULATION) and file.name.removesuffix(SIMULATION) not in names:
            found = f"{file.name}, beside no drives file of that name"
            yield Problem(file, 1, 1, "file", found, f"{drives_file.stem}{SIMULATION} for {drives_file.name}", _WARNING)


def simulation_of(reading: Reading[SimulationFile], drives: DrivesFile) -> Simulation:
    """What was read without problems says, or what holds where there is no file."""
    return Simulation(lag_s=lag_of(drives)) if reading.content is None else reading.content.simulation(drives)
