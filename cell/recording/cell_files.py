"""The files of a cell as they lie in its recording: the cell file and all that it names."""

import os
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from cell.config.document import read_document
from cell.config.settings import CellSettings
from cell.config.yaml_tree import Value

_YAML = (".yaml", ".yml")
_NAMED_IN = {
    ".prog": re.compile(r"^\s*(?:\d+\s+)?CALL\s+(\S+)", re.MULTILINE | re.IGNORECASE),
    ".urdf": re.compile(r'filename="([^"]+)"'),
}
"""By kind of file, where it names another one."""
MOST_BYTES = 64 * 2**20
"""Of one file; a larger one is left out."""


@dataclass(frozen=True, slots=True)
class RecordedCell:
    """The cell of a recording."""

    settings: CellSettings
    joints: Mapping[str, tuple[str, ...]]
    """By robot, the names of its joints as its robot file has them; a robot may be missing."""
    files: Mapping[str, bytes]
    """By their paths below one folder, with `/`: the cell file and all that it names and that could be read."""
    cell_file: str
    """Which of `files` that is."""
    missing: Mapping[str, str]
    """File that could not be read: why."""


def recorded_cell(settings: CellSettings, joints: Mapping[str, tuple[str, ...]]) -> RecordedCell:
    """Read the files of a cell. One that cannot be read keeps nothing from being recorded."""
    first = Path(os.path.abspath(settings.file))
    found: dict[Path, bytes | str] = {}
    waiting = [first]
    while waiting:
        path = waiting.pop()
        if path not in found:
            found[path] = _read(path)
            waiting += _named_by(path, found[path])
    read = {path: data for path, data in found.items() if isinstance(data, bytes)}
    root = os.path.commonpath([path.parent for path in (first, *read)])
    files = {path.relative_to(root).as_posix(): data for path, data in sorted(read.items())}
    missing = {str(path): why for path, why in found.items() if isinstance(why, str)}
    return RecordedCell(settings, joints, files, first.relative_to(root).as_posix(), missing)


def _read(path: Path) -> bytes | str:
    """What is in a file, or why it cannot be read."""
    try:
        if path.stat().st_size > MOST_BYTES:
            return f"more than {MOST_BYTES // 2**20} MiB"
        return path.read_bytes()
    except OSError as error:
        return error.strerror or str(error)


def _named_by(path: Path, data: bytes | str) -> list[Path]:
    """The files that one names: a YAML file by any of its values, a program by CALL, a URDF by its meshes."""
    names: list[str] = []
    if isinstance(data, str):
        return []
    if path.suffix in _YAML:
        document, _ = read_document(path)
        names = [] if document is None else list(_texts(document.data))
    elif (pattern := _NAMED_IN.get(path.suffix)) is not None:
        names = pattern.findall(data.decode(errors="replace"))
    return [named for name in names if _is_file(named := Path(os.path.normpath(path.parent / name)))]


def _is_file(path: Path) -> bool:
    try:
        return path.is_file()
    except (OSError, ValueError):
        return False


def _texts(value: Value) -> Iterator[str]:
    if isinstance(value, str) and value:
        yield value
    elif isinstance(value, dict | list):
        for each in value.values() if isinstance(value, dict) else value:
            yield from _texts(each)
