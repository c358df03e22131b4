"""YAML text to plain values, with the position of every key and every value.

Only what JSON can say is taken: mappings with text keys, lists, text, numbers, true/false, null. Aliases, tags and
several documents are refused, so that a file means what a reader sees.
"""

import math
import re
from collections.abc import Callable
from dataclasses import dataclass

from ruamel.yaml import YAML
from ruamel.yaml.error import MarkedYAMLError, StreamMark, YAMLError
from ruamel.yaml.nodes import MappingNode, Node, ScalarNode, SequenceNode
from ruamel.yaml.reader import ReaderError

from cell.config.problem import KeyPath

Value = None | bool | int | float | str | list["Value"] | dict[str, "Value"]
LineColumn = tuple[int, int]
"""Line and column, from 1."""
Report = Callable[[LineColumn, KeyPath, str, str], None]
"""Takes place, path, found, allowed."""

_CORE = "tag:yaml.org,2002:"
_TEXT_TAGS = {f"{_CORE}{kind}" for kind in ("str", "timestamp", "value", "merge")}
_DIRECTIVE = re.compile(r"\ufeff?(?:[ \t]*(?:#[^\n]*)?\n)*(?P<line>%[^\n]*)")
_TAG = re.compile(r"(?:&\S+(?:\s|#[^\n]*\n)+)?(![^\s,\[\]{}]*)")
_SPECIAL = {".inf": math.inf, "+.inf": math.inf, "-.inf": -math.inf, ".nan": math.nan}


@dataclass(frozen=True, slots=True)
class Places:
    """Where a value stands and, for a value of a mapping, its key; list items have only themselves."""

    key: LineColumn
    value: LineColumn


def parse(text: str, places: dict[KeyPath, Places], report: Report) -> Value:
    """The value in `text`; fills `places` and reports what cannot be taken. None as well when nothing could be read."""
    if (directive := _DIRECTIVE.match(text)) is not None:
        before = text[: directive.start("line")]
        found = f"the directive {_one_line(directive['line'])}"
        report((before.count("\n") + 1, 1), (), found, "none: this is YAML 1.2, where yes and on are text")
        return None
    try:
        root = YAML(typ="safe", pure=True).compose(text)
    except MarkedYAMLError as error:
        what = " ".join(part for part in (error.context, error.problem) if part)
        report(_place(error.problem_mark), (), _one_line(what), "YAML")
        return None
    except ReaderError as error:
        before = text[: error.position]
        place = (before.count("\n") + 1, len(before) - before.rfind("\n"))
        report(place, (), f"the character {text[error.position : error.position + 1]!r}", "printable text")
        return None
    except RecursionError:
        report((1, 1), (), "brackets nested too deeply", "a few levels")
        return None
    except YAMLError as error:
        report((1, 1), (), _one_line(str(error)), "YAML")
        return None
    if root is None:
        report((1, 1), (), "an empty file", "a mapping of keys to values")
        return None
    return _Tree(text, places, report).value(root, (), None)


class _Tree:
    def __init__(self, text: str, places: dict[KeyPath, Places], report: Report) -> None:
        self._text = text
        self._places = places
        self._report = report
        self._seen: set[int] = set()

    def value(self, node: Node, path: KeyPath, key: LineColumn | None) -> Value:
        place = _place(node.start_mark)
        self._places[path] = Places(key or place, place)
        if id(node) in self._seen:
            self._report(key or place, path, "an alias (*)", "the value written out")
            return None
        self._seen.add(id(node))
        if isinstance(node, MappingNode):
            return self._mapping(node, path)
        if isinstance(node, SequenceNode):
            self._check_tag(node, path)
            return [self.value(item, (*path, index), None) for index, item in enumerate(node.value)]
        return self._scalar(node, str(node.value), path)

    def _mapping(self, node: MappingNode, path: KeyPath) -> Value:
        self._check_tag(node, path)
        mapping: dict[str, Value] = {}
        for key_node, value_node in node.value:
            place = _place(key_node.start_mark)
            if not isinstance(key_node, ScalarNode):
                self._report(place, path, "a key that is no text", "text")
                continue
            key = key_node.value
            if self._check_tag(key_node, (*path, key)):
                continue
            if key in mapping:
                first = self._places[(*path, key)].key
                self._report(place, (*path, key), f"the key a second time (first in line {first[0]})", "each key once")
                continue
            mapping[key] = self.value(value_node, (*path, key), place)
        return mapping

    def _scalar(self, node: Node, text: str, path: KeyPath) -> Value:
        if self._check_tag(node, path):
            return None
        tag = str(node.tag)
        if tag in _TEXT_TAGS:
            return text
        try:
            if tag == f"{_CORE}null":
                return None
            if tag == f"{_CORE}bool":
                return text.lower() == "true"
            if tag == f"{_CORE}int":
                return _whole(text)
            if tag == f"{_CORE}float":
                return _SPECIAL[text.lower()] if text.lower() in _SPECIAL else float(text)
        except ValueError:
            pass
        found = f"{tag.removeprefix(_CORE)} {text[:40]!r}"
        self._report(_place(node.start_mark), path, found, "text, a number, true or false")
        return None

    def _check_tag(self, node: Node, path: KeyPath) -> bool:
        """Report a tag that the file writes, and say whether it does: tags and anchors come before a value's text."""
        written = _TAG.match(self._text, node.start_mark.index) if node.start_mark is not None else None
        if written is not None:
            self._report(_place(node.start_mark), path, f"the tag {written[1]}", "no tag")
        return written is not None


def _place(mark: StreamMark | None) -> LineColumn:
    return (mark.line + 1, mark.column + 1) if mark is not None else (1, 1)


def _whole(text: str) -> int:
    """Raises ValueError for what does not fit into 64 bits as well; nothing in a cell is that large."""
    number = int(text, 0) if text.lstrip("+-")[:2] in ("0x", "0o") else int(text)
    if number.bit_length() > 63:
        raise ValueError(text)
    return number


def _one_line(text: str) -> str:
    return " ".join(text.split())
