"""From the cell file to settings, or to all of its problems."""

import dataclasses
import hashlib
from pathlib import Path

from cell.config.cell_checks import check_cell_file
from cell.config.cell_file import CellFile
from cell.config.digest import digest_of
from cell.config.document import Document, Naming, read_document, read_text
from cell.config.problem import ConfigError, KeyPath, Problem, path_text, refuses
from cell.config.reading import Reading, read
from cell.config.settings import CellSettings
from cell.config.yaml_tree import Value

_CHAIN = ".urdf"
"""The one kind of named file that is no YAML: a robot file names it, and its text counts as it is."""
_STAND_INS = {"cell": "unnamed", "manager": {"endpoint": "tcp/unknown:1"}}


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


def load_cell_alone(path: str | Path) -> CellSettings:
    """The settings of a cell that runs already, for who gives it orders: without the named files and without a digest.

    A mistake in a robot's file, made while the cell runs, must keep no halt and no emergency stop away from it.

    Raises:
        ConfigError: with every problem of the cell file itself.
    """
    reading = read_cell(Path(path))
    if reading.document is None or reading.content is None or refuses(reading.problems):
        raise ConfigError(tuple(reading.problems))
    return reading.content.settings(reading.document, digest="")


def read_cell(path: Path) -> Reading[CellFile]:
    """The cell file, read and checked in itself."""
    reading = read(path, CellFile, _STAND_INS)
    if reading.document is not None and reading.content is not None:
        reading.problems += check_cell_file(reading.document, reading.content)
    return reading


def cell_settings(reading: Reading[CellFile]) -> tuple[CellSettings | None, list[Problem]]:
    """The settings, with the digest over all named files, and all problems; None with an error."""
    document, cell, problems = reading.document, reading.content, list(reading.problems)
    if document is None:
        return None, problems
    files, found = _named_files(document)
    problems += found
    if cell is None or refuses(problems):
        return None, problems
    settings = cell.settings(document, digest="")
    return dataclasses.replace(settings, digest=digest_of(settings, files)), problems


def _named_files(document: Document) -> tuple[dict[str, Value], list[Problem]]:
    """The content of every named file that counts in the digest, by its place in the cell file; what cannot be read."""
    robots, gateways = document.keys(("robots",)), document.keys(("gateways",))
    paths = [("robots", name, "model") for name in robots] + [("gateways", name, "drives") for name in gateways]
    files: dict[str, Value] = {}
    problems: list[Problem] = []
    for path in paths:
        naming = Naming(document, path)
        if (file := naming.file()) is None or file.suffix == _CHAIN:
            continue
        named, found = read_document(file, naming)
        problems += found
        files[path_text(path)] = named.data if named is not None else None
        if named is not None and (chain := Naming(named, ("geometry", "file")).file()) is not None:
            text = read_text(chain, Naming(named, ("geometry", "file")))
            files[f"{path_text(path)}.geometry.file"] = None if isinstance(text, Problem) else text
    for name in robots:
        naming = Naming(document, ("robots", name, "program"))
        if (file := naming.file()) is None:
            continue
        if isinstance(text := read_text(file, naming), Problem):
            problems.append(text)
        taught = Naming(document, ("robots", name, "points"))
        if (file := taught.file()) is not None and isinstance(text := read_text(file, taught), Problem):
            problems.append(text)
    shaped: list[KeyPath] = [("things", name) for name in document.keys(("things",))]
    shaped += [
        ("robots", name, "spaces", each) for name in robots for each in document.keys(("robots", name, "spaces"))
    ]
    for place in shaped:
        naming = Naming(document, (*place, "mesh", "file"))
        if (file := naming.file()) is None:
            continue
        try:
            files[path_text(naming.path)] = hashlib.sha256(file.read_bytes()).hexdigest()
        except OSError as error:
            unreadable = f"{str(file)!r}, which cannot be read: {error.strerror or error}"
            problems.append(document.problem(naming.path, unreadable, "an STL or OBJ file"))
    return files, list(dict.fromkeys(problems))
