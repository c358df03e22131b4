"""A YAML file changed in place: other values, one more entry; all else stays, to the byte."""

import copy
import json
import os
import shutil
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import TypeVar

from ruamel.yaml import YAML
from ruamel.yaml.nodes import MappingNode, Node, ScalarNode, SequenceNode

from cell.config.problem import KeyPath, path_text
from cell.config.yaml_tree import Value, parse

T = TypeVar("T")

_INDENT = "  "


class NotWritten(Exception):
    """The file stays as it is; the text says why, for people."""


@dataclass(frozen=True, slots=True)
class Changes:
    """What is to stand in a YAML text, as texts by paths."""

    values: Mapping[KeyPath, str]
    """Other values, each a number, a word or a flow list, where one is."""
    added: Mapping[KeyPath, str] = field(default_factory=dict)
    """New keys of mappings that are there; they come first in these."""
    renamed: Mapping[KeyPath, tuple[str, str]] = field(default_factory=dict)
    """Keys in the place of which another one comes, or the same, with its value."""


def changed(text: str, changes: Changes) -> str:
    """A YAML text with these changes; all else stays, to the byte.

    Raises:
        NotWritten: a path is not there, something with comments or over lines would be replaced, or more than this
            would change.
    """
    root = YAML(typ="safe", pure=True).compose(text)
    spans = [(*_span(root, path), new) for path, new in changes.values.items()]
    for start, end, new in spans:
        if isinstance(parsed(new), list) and ("#" in text[start:end] or text[start] != "["):
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
    wanted = copy.deepcopy(parsed(text))
    for path, (key, new) in changes.renamed.items():
        del _at(wanted, path[:-1])[path[-1]]  # type: ignore[attr-defined]
        _set(wanted, (*path[:-1], key), parsed(new))
    for path, new in (*changes.values.items(), *changes.added.items()):
        _set(wanted, path, parsed(new))
    if parsed(result) != wanted:
        paths = (*changes.values, *changes.renamed, *changes.added)
        raise NotWritten(f"{', '.join(map(path_text, paths))} cannot be changed alone: change it by hand")
    return result


def with_entry(text: str, path: tuple[str, str], entry: Mapping[str, str]) -> str:
    """A YAML text in whose mapping `path[0]` the key `path[1]` has these words by key; all else stays, to the byte.

    The mapping is made where it is not there, the entry is its last one where that is new. The words are YAML.

    Raises:
        NotWritten: an entry with comments inside has other keys, or more than the entry would change.
    """
    mapping, name = path
    root = YAML(typ="safe", pure=True).compose(text)
    wanted = copy.deepcopy(parsed(text))
    if not isinstance(wanted, dict):
        wanted = {}
    new = {key: parsed(word) for key, word in entry.items()}
    inside = wanted.setdefault(mapping, {})
    if isinstance(inside, dict) and isinstance(inside.get(name), dict) and list(inside[name]) == list(new):  # type: ignore[arg-type]
        return changed(text, Changes({(mapping, name, key): word for key, word in entry.items()}))
    if not isinstance(inside, dict):
        raise NotWritten(f"{mapping} is no mapping of names to values")
    inside[name] = new
    flow = f"{{{', '.join(f'{key}: {word}' for key, word in entry.items())}}}"
    result = _inserted(text, root, mapping, name, flow)
    if parsed(result) != wanted:
        raise NotWritten(f"{mapping}.{name} cannot be written alone: change it by hand")
    return result


def parsed(text: str) -> Value:
    """What a YAML text says."""
    return parse(text, {}, lambda *_: None)


def word(value: str) -> str:
    """A text as YAML, in quotes where it would be something else without."""
    return value if parsed(value) == value else json.dumps(value)


def number_text(value: float, digits: int) -> str:
    """As people write it, without an exponent."""
    text = f"{value:.{digits}f}".rstrip("0").rstrip(".")
    return "0" if text == "-0" else text


def put(file: Path, text: str, accepted: Callable[[Path], T]) -> T:
    """Put a new text in the place of the file at once, if it is `accepted`; it is on disk when this returns.

    `accepted` reads a copy beside the file and returns what is returned, or raises. Raises OSError as well.
    """
    beside = file.with_name(f".{file.name}.new")  # what a writer that was killed left there is written over
    try:
        with beside.open("wb") as stream:
            stream.write(text.encode())
            stream.flush()
            os.fsync(stream.fileno())
        if file.exists():
            owner = file.stat()
            shutil.copymode(file, beside)
            with suppress(PermissionError):
                os.chown(beside, owner.st_uid, owner.st_gid)
        taken = accepted(beside)
        os.replace(beside, file)
    finally:
        beside.unlink(missing_ok=True)
    folder = os.open(file.parent, os.O_RDONLY)
    try:
        os.fsync(folder)
    finally:
        os.close(folder)
    return taken


def _inserted(text: str, root: Node | None, mapping: str, name: str, flow: str) -> str:
    """The text with one entry more, or another one, written as a flow mapping."""
    newline = "\r\n" if "\r\n" in text else "\n"
    body = _child(root, mapping)
    if not isinstance(body, MappingNode):
        ended = "" if not text or text.endswith("\n") else newline
        return f"{text}{ended}{mapping}:{newline}{_INDENT}{word(name)}: {flow}{newline}"
    if (old := _child(body, name)) is not None:
        start, end = old.start_mark.index, _end(old)
        if "#" in text[start:end]:
            raise NotWritten(f"{mapping}.{name} has comments inside, and other keys are to be written: do that by hand")
        return text[:start] + flow + text[end:]
    if not body.value:
        start = body.start_mark.index
        return f"{text[:start]}{{{word(name)}: {flow}}}{text[body.end_mark.index :]}"
    first, last = body.value[0][0], _end(body.value[-1][1])
    if body.flow_style:
        return f"{text[:last]}, {word(name)}: {flow}{text[last:]}"
    end = text.find("\n", last)
    indent = " " * first.start_mark.column
    if end < 0:
        return f"{text}{newline}{indent}{word(name)}: {flow}{newline}"
    return f"{text[: end + 1]}{indent}{word(name)}: {flow}{newline}{text[end + 1 :]}"


def _child(node: Node | None, key: str) -> Node | None:
    if not isinstance(node, MappingNode):
        return None
    return next((value for name, value in node.value if name.value == key), None)


def _end(node: Node) -> int:
    """Where the text of a value ends; a block mapping would end with the comments behind it."""
    if isinstance(node, MappingNode) and not node.flow_style and node.value:
        return _end(node.value[-1][1])
    if isinstance(node, SequenceNode) and not node.flow_style and node.value:
        return _end(node.value[-1])
    return int(node.end_mark.index)


def _node(root: Node, path: KeyPath) -> Node | None:
    node: Node | None = root
    for key in path:
        if isinstance(node, MappingNode) and isinstance(key, str):
            node = _child(node, key)
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
    inside, value = _node(root, path[:-1]), _node(root, path)
    key = next((k for k, _ in inside.value if k.value == path[-1]), None) if isinstance(inside, MappingNode) else None
    if key is None or value is None:
        raise NotWritten(f"{path_text(path)} is not there")
    return key.start_mark.index, _end(value)


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


def _at(data: Value, path: KeyPath) -> object:
    inside: object = data
    for key in path:
        inside = inside[key]  # type: ignore[index]
    return inside


def _set(data: Value, path: KeyPath, value: Value) -> None:
    _at(data, path[:-1])[path[-1]] = value  # type: ignore[index]
