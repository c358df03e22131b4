"""From the cell file to settings, or to all of its problems."""

from pathlib import Path

from cell.config.cell_checks import check_cell_file
from cell.config.cell_file import CellFile
from cell.config.digest import digest_of
from cell.config.document import Document, Naming, read_document, read_text
from cell.config.problem import ConfigError, Problem, refuses
from cell.config.reading import Reading, read
from cell.config.settings import CellSettings
from cell.config.yaml_tree import Value


def load_cell(path: str | Path) -> CellSettings:
    """The settings of a cell: SI units, absolute paths, every default filled in.

    The files that it names must be there and readable; what they say is checked by who uses them, and all together by
    `cell check`.

    Raises:
        ConfigError: with every problem, each at its line and column.
    """
    reading = read_cell(Path(path))
    settings, problems = cell_settings(reading)
    if settings is None:
        raise ConfigError(tuple(problems))
    return settings


def read_cell(path: Path) -> Reading[CellFile]:
    """The cell file, read and checked in itself."""
    reading = read(path, CellFile)
    if reading.document is not None and reading.content is not None:
        reading.problems += check_cell_file(reading.document, reading.content)
    return reading


def cell_settings(reading: Reading[CellFile]) -> tuple[CellSettings | None, list[Problem]]:
    """The settings, with the digest over all named files, and all problems; None with an error."""
    document, cell, problems = reading.document, reading.content, list(reading.problems)
    if document is None or cell is None:
        return None, problems
    files, found = _named_files(document, cell)
    problems += found
    if refuses(problems):
        return None, problems
    here = Naming(document, ())
    settings = cell.settings(here, digest="")
    return cell.settings(here, digest_of(settings, files)), problems


def _named_files(document: Document, cell: CellFile) -> tuple[dict[str, Value], list[Problem]]:
    """The content of every named file by its place in the cell file, and what cannot be read of them."""
    yaml_files = {f"robots.{name}.model": ("robots", name, "model") for name in cell.robots}
    yaml_files |= {f"gateways.{name}.drives": ("gateways", name, "drives") for name in cell.gateways}
    files: dict[str, Value] = {}
    problems: list[Problem] = []
    for key, path in yaml_files.items():
        naming = Naming(document, path)
        named, found = read_document(naming.file(str(document.value(path))), naming)
        problems += found
        files[key] = named.data if named is not None else None
    for name, robot in cell.robots.items():
        naming = Naming.of(document, "robots", name, "program")
        text = read_text(naming.file(robot.program), naming)
        if isinstance(text, Problem):
            problems.append(text)
        else:
            files[f"robots.{name}.program"] = text
    return files, list(dict.fromkeys(problems))
