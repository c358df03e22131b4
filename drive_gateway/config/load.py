"""From a drives file to gateway settings, or to all of its problems."""

from dataclasses import replace
from pathlib import Path

from cell.config.document import Naming
from cell.config.problem import ConfigError, Problem, refuses
from cell.config.reading import Reading, read
from drive_gateway.config.checks import check_drives_file
from drive_gateway.config.drives_file import DrivesFile
from drive_gateway.config.settings import GatewaySettings

SIMULATION = ".sim.yaml"
"""Instead of a drives file's own ending: the file beside it that says how its drives are simulated."""
_OF_SIMULATION = {
    "simulated_lag_s": "as lag_s",
    "simulated_start": "as starts: {ROBOT: {AXIS: ...}}",
    "simulation": "its keys without this one around them",
}
"""Keys that drives files had, and as what they are there."""


def load_drives(path: str | Path, name: str) -> GatewaySettings:
    """The bus and the drives of the gateway `name`, in SI units.

    Raises:
        ConfigError: with every problem, each at its line and column.
    """
    reading = read_drives(Path(path))
    if reading.content is None or refuses(reading.problems):
        raise ConfigError(tuple(reading.problems))
    return reading.content.settings(name, Path(path).absolute().parent)


def read_drives(path: Path, named_by: Naming | None = None) -> Reading[DrivesFile]:
    """The drives file, read and checked in itself."""
    reading = read(path, DrivesFile, {}, named_by)
    reading.problems = [_sent_on(problem) for problem in reading.problems]
    if reading.document is not None and reading.content is not None:
        reading.problems += check_drives_file(reading.document, reading.content)
    return reading


def _sent_on(problem: Problem) -> Problem:
    """An unknown key that is one of the simulation belongs into the file beside this one."""
    key = problem.path.rpartition(".")[2]
    if key not in _OF_SIMULATION or problem.found != f"unknown key {key!r}":
        return problem
    beside = problem.file.with_suffix(SIMULATION).name
    allowed = f"keys of real drives; this one goes into {beside} beside this file, {_OF_SIMULATION[key]}"
    return replace(problem, allowed=f"{allowed} (docs/simulated_drives.md)")
