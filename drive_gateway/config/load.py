"""From a drives file to gateway settings, or to all of its problems."""

from pathlib import Path

from cell.config.document import Naming
from cell.config.problem import ConfigError, refuses
from cell.config.reading import Reading, read
from drive_gateway.config.checks import check_drives_file
from drive_gateway.config.drives_file import DrivesFile
from drive_gateway.config.settings import GatewaySettings


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
    if reading.document is not None and reading.content is not None:
        reading.problems += check_drives_file(reading.document, reading.content)
    return reading
