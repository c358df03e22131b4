"""A cell file changed while its cell runs: the text of some values and nothing else, whole or not at all."""

import copy
import os
import shutil
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

from ruamel.yaml import YAML
from ruamel.yaml.error import YAMLError
from ruamel.yaml.nodes import MappingNode, Node, ScalarNode, SequenceNode

from cell.config.cell_file import CellFile
from cell.config.load import read_cell
from cell.config.problem import KeyPath, path_text, refuses
from cell.config.settings import CellSettings
from cell.config.units import ToSI
from cell.config.yaml_tree import Value, parse

_BOM = "\ufeff"
_LENGTH_DIGITS, _ANGLE_DIGITS = 7, 8
"""After the point, of metres and radians: a tenth of a micrometre, a hundredth of a microradian."""


class NotWritten(Exception):
    """The cell file stays as it is; the text says why, for people."""


@dataclass(frozen=True, slots=True)
class Changes:
    """What is to stand in a YAML text, as texts by paths."""

    values: Mapping[KeyPath, str]
    """Other values, each a number, a word or a flow list, where one is."""
    added: Mapping[KeyPath, str] = field(default_factory=dict)
    """New keys of mappings that are there; they come first in these."""
    renamed: Mapping[KeyPath, tuple[str, str]] = field(default_factory=dict)
    """Keys in the place of which another one comes, with its value."""


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
        return _put(file, raw[: len(raw) - len(text)] + changed(text, changes(content)))
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
    return _number(value_m * units.per_metre, _LENGTH_DIGITS - (3 if units.per_metre == 1000.0 else 0))


def angle_text(value_rad: float, units: ToSI) -> str:
    """An angle in a file's unit, as people write it."""
    return _number(value_rad / units.angle, _ANGLE_DIGITS - (2 if units.angle != 1.0 else 0))


def _number(value: float, digits: int) -> str:
    """As people write it, without an exponent."""
    text = f"{value:.{digits}f}".rstrip("0").rstrip(".")
    return "0" if text == "-0" else text


def changed(text: str, changes: Changes) -> str:
    """A YAML text with these changes; all else stays, to the byte.

    Raises:
        NotWritten: a path is not there, something with comments or over lines would be replaced, or more than this
            would change.
    """
    root = YAML(typ="safe", pure=True).compose(text)
    spans = [(*_span(root, path), new) for path, new in changes.values.items()]
    for start, end, new in spans:
        if isinstance(_parsed(new), list) and ("#" in text[start:end] or text[start] != "["):
            raise NotWritten(
                "its list of points has comments inside or is not written as [[x, y, z], ...], and another number of "
                "points is to be written: teach as many as it has, or change it by hand"
            )
    for path, (key, new) in changes.renamed.items():
        start, end = _entry(root, path)
        if "#" in text[start:end]:
            raise NotWritten(f"{path_text(path)} has comments inside, which would go with it: change it by hand")
        spans.append((start, end, f"{key}: {new}"))
    line_end = "\r\n" if "\r\n" in text else "\n"
    spans += [_before_first(root, path, new, line_end) for path, new in changes.added.items()]
    result = text
    for start, end, new in sorted(spans, reverse=True):
        result = result[:start] + new + result[end:]
    wanted = copy.deepcopy(_parsed(text))
    for path, (key, new) in changes.renamed.items():
        _set(wanted, (*path[:-1], key), _parsed(new))
        del _at(wanted, path[:-1])[path[-1]]  # type: ignore[attr-defined]
    for path, new in (*changes.values.items(), *changes.added.items()):
        _set(wanted, path, _parsed(new))
    if _parsed(result) != wanted:
        paths = (*changes.values, *changes.renamed, *changes.added)
        raise NotWritten(f"{', '.join(map(path_text, paths))} cannot be changed alone: change it by hand")
    return result


def _node(root: Node, path: KeyPath) -> Node | None:
    node: Node | None = root
    for key in path:
        if isinstance(node, MappingNode) and isinstance(key, str):
            node = next((value for name, value in node.value if name.value == key), None)
        elif isinstance(node, SequenceNode) and isinstance(key, int) and key < len(node.value):
            node = node.value[key]
        else:
            node = None
    return node


def _span(root: Node, path: KeyPath) -> tuple[int, int]:
    """Where in the text the value at a path begins and ends."""
    node = _node(root, path)
    if not isinstance(node, ScalarNode | SequenceNode) or node.start_mark is None or node.end_mark is None:
        raise NotWritten(f"{path_text(path)} is not there")
    return node.start_mark.index, node.end_mark.index


def _entry(root: Node, path: KeyPath) -> tuple[int, int]:
    """Where in the text a key begins and the last of its value ends."""
    inside, last = _node(root, path[:-1]), _node(root, path)
    key = next((k for k, _ in inside.value if k.value == path[-1]), None) if isinstance(inside, MappingNode) else None
    while isinstance(last, MappingNode | SequenceNode) and not last.flow_style and last.value:
        last = last.value[-1] if isinstance(last, SequenceNode) else last.value[-1][1]
    if key is None or last is None:
        raise NotWritten(f"{path_text(path)} is not there")
    return key.start_mark.index, last.end_mark.index


def _before_first(root: Node, path: KeyPath, new: str, line_end: str) -> tuple[int, int, str]:
    """A new entry in front of all others of its mapping."""
    inside = _node(root, path[:-1])
    if not isinstance(inside, MappingNode) or inside.start_mark is None:
        raise NotWritten(f"{path_text(path[:-1])} is not there")
    if not inside.value:
        return inside.start_mark.index + 1, inside.start_mark.index + 1, f"{path[-1]}: {new}"
    first = inside.value[0][0].start_mark
    between = ", " if inside.flow_style else line_end + " " * first.column
    return first.index, first.index, f"{path[-1]}: {new}{between}"


def _parsed(text: str) -> Value:
    return parse(text, {}, lambda *_: None)


def _at(data: Value, path: KeyPath) -> object:
    inside: object = data
    for key in path:
        inside = inside[key]  # type: ignore[index]
    return inside


def _set(data: Value, path: KeyPath, value: Value) -> None:
    _at(data, path[:-1])[path[-1]] = value  # type: ignore[index]


def _put(file: Path, text: str) -> CellSettings:
    """Put a new text in the place of the file at once, if it is a good cell file; it is on disk when this returns."""
    beside = file.with_name(f".{file.name}.new")  # what a writer that was killed left there is written over
    owner = file.stat()
    try:
        with beside.open("wb") as stream:
            stream.write(text.encode())
            stream.flush()
            os.fsync(stream.fileno())
        shutil.copymode(file, beside)
        with suppress(PermissionError):
            os.chown(beside, owner.st_uid, owner.st_gid)
        settings, _ = _read(beside)
        os.replace(beside, file)
    finally:
        beside.unlink(missing_ok=True)
    folder = os.open(file.parent, os.O_RDONLY)
    try:
        os.fsync(folder)
    finally:
        os.close(folder)
    return settings
