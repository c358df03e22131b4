"""A cell file changed while its cell runs: the text of some values and nothing else, whole or not at all."""

from collections.abc import Callable, Mapping
from pathlib import Path

from ruamel.yaml.error import YAMLError

from cell.config.cell_file import CellFile
from cell.config.load import read_cell
from cell.config.problem import refuses
from cell.config.settings import CellSettings
from cell.config.units import ToSI
from cell.config.yaml_edit import Changes, NotWritten, changed, number_text, put

_BOM = "\ufeff"
_LENGTH_DIGITS, _ANGLE_DIGITS = 7, 8
"""After the point, of metres and radians: a tenth of a micrometre, a hundredth of a microradian."""


def change_file(
    file: Path, running: Callable[[CellSettings], None], changes: Callable[[CellFile], Changes]
) -> CellSettings:
    """Change a cell file; returns what it says now, without a digest.

    Args:
        running: raises `NotWritten` where the file says something else than the cell runs with.
        changes: what is to change, by what the file says.

    Raises:
        NotWritten: by one of these; or the file cannot be read, changed or written.
    """
    file = file.resolve()
    before, content = _read(file)
    running(before)
    try:
        raw = file.read_bytes().decode()
        text = raw.removeprefix(_BOM)
        settings, _ = put(file, raw[: len(raw) - len(text)] + changed(text, changes(content)), _read)
        return settings
    except (OSError, UnicodeDecodeError, YAMLError) as error:
        raise NotWritten(f"{file} cannot be written: {getattr(error, 'strerror', None) or error}") from error


def same_as_running(file: Path, before: Mapping[str, object], running: Mapping[str, object]) -> None:
    """Raise `NotWritten` where a file gives something else under some names than the cell runs with."""
    if differing := sorted(name for name in {**before, **running} if before.get(name) != running.get(name)):
        raise NotWritten(
            f"{file} gives {', '.join(differing)} otherwise than the cell runs with: somebody has changed it since the "
            "manager was started; start the manager again, or take the change back"
        )


def _read(file: Path) -> tuple[CellSettings, CellFile]:
    reading = read_cell(file)
    if reading.document is None or reading.content is None or refuses(reading.problems):
        raise NotWritten(f"the cell file is refused: {'; '.join(map(str, reading.problems))}")
    return reading.content.settings(reading.document, digest=""), reading.content


def length_text(value_m: float, units: ToSI) -> str:
    """A length in a file's unit, as people write it."""
    return number_text(value_m * units.per_metre, _LENGTH_DIGITS - (3 if units.per_metre == 1000.0 else 0))


def angle_text(value_rad: float, units: ToSI) -> str:
    """An angle in a file's unit, as people write it."""
    return number_text(value_rad / units.angle, _ANGLE_DIGITS - (2 if units.angle != 1.0 else 0))
