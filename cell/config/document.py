"""A configuration file in memory: its values, and where each of them stands."""

import os
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

from cell.config.problem import KeyPath, Problem, Severity, path_text
from cell.config.yaml_tree import LineColumn, Places, Value, parse


@dataclass(frozen=True, slots=True)
class Document:
    """One YAML file. `data` is what it says, `places` where."""

    file: Path
    data: Value
    places: Mapping[KeyPath, Places]

    def problem(
        self,
        path: KeyPath,
        found: str,
        allowed: str,
        *,
        severity: Severity = Severity.ERROR,
        at_key: bool = False,
    ) -> Problem:
        """A problem at the value of `path` (or at its key); where that is missing, at what should contain it."""
        line, column = self._place(path, at_key)
        return Problem(self.file, line, column, path_text(path), found, allowed, severity)

    def value(self, path: KeyPath) -> Value:
        """The plain value at `path`; None where there is none."""
        node = self.data
        for key in path:
            if isinstance(node, dict) and isinstance(key, str):
                node = node.get(key)
            elif isinstance(node, list) and isinstance(key, int) and key < len(node):
                node = node[key]
            else:
                return None
        return node

    def keys(self, path: KeyPath) -> list[str]:
        """The keys of the mapping at `path`, usable or not; empty where there is no mapping."""
        node = self.value(path)
        return list(node) if isinstance(node, dict) else []

    def found(self, path: KeyPath) -> str:
        """The value at `path` as the file says it, for a problem's text."""
        return value_text(self.value(path))

    def beside(self, name: str) -> Path:
        """The file `name`, relative to this one, as absolute path."""
        return Path(os.path.normpath(self.file.parent / name))

    def _place(self, path: KeyPath, at_key: bool) -> LineColumn:
        for length in range(len(path), -1, -1):
            places = self.places.get(path[:length])
            if places is not None:
                return places.key if at_key or length < len(path) else places.value
        return (1, 1)


@dataclass(frozen=True, slots=True)
class Naming:
    """The value that names another file; where it is missing, the problem is there."""

    document: Document
    path: KeyPath

    def file(self) -> Path | None:
        """The named file as absolute path; None where there is no name."""
        name = self.document.value(self.path)
        return self.document.beside(name) if isinstance(name, str) and name else None


def read_text(file: Path, named_by: Naming | None = None) -> str | Problem:
    """The file's text, UTF-8 without a byte order mark, line ends as newlines; or why it cannot be read."""

    def unreadable(found: str) -> Problem:
        if named_by is not None:
            found = f"{named_by.document.found(named_by.path)}: {found}"
            return named_by.document.problem(named_by.path, found, "a readable file, relative to this one")
        return Problem(file, 1, 1, "file", found, "a readable file")

    try:
        data = file.read_bytes()
    except FileNotFoundError:
        return unreadable("no such file")
    except IsADirectoryError:
        return unreadable("a folder")
    except (OSError, ValueError) as error:
        return unreadable(getattr(error, "strerror", None) or str(error))
    try:
        return data.decode("utf-8").removeprefix("\ufeff").replace("\r\n", "\n")
    except UnicodeDecodeError as error:
        before = data[: error.start]
        line, column = before.count(b"\n") + 1, len(before) - before.rfind(b"\n")
        return Problem(file, line, column, "file", f"the byte {data[error.start]:#04x}", "text in UTF-8")


def read_document(file: Path, named_by: Naming | None = None) -> tuple[Document | None, list[Problem]]:
    """The YAML file as a document, with the problems of its form. None when it cannot be read at all."""
    file = Path(os.path.abspath(file))
    text = read_text(file, named_by)
    if isinstance(text, Problem):
        return None, [text]
    data, places, reports = _parsed(text)
    problems = [Problem(file, *place, path_text(path), found, allowed) for place, path, found, allowed in reports]
    if data is None:
        return None, problems or [Problem(file, 1, 1, "file", "no value", "a mapping of keys to values")]
    return Document(file, data, places), problems


@lru_cache(maxsize=32)
def _parsed(text: str) -> tuple[Value, Mapping[KeyPath, Places], list[tuple[LineColumn, KeyPath, str, str]]]:
    """Value, places and reports of a text. Robots share files, and several checks read each: parsing takes longest."""
    places: dict[KeyPath, Places] = {}
    reports: list[tuple[LineColumn, KeyPath, str, str]] = []
    return parse(text, places, lambda *report: reports.append(report)), places, reports


def value_text(value: Value) -> str:
    """A value as a reader of the file knows it."""
    if value is None:
        return "nothing"
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, dict):
        return "a mapping" if value else "an empty mapping"
    if isinstance(value, list):
        return "a list" if value else "an empty list"
    if isinstance(value, str):
        return repr(value if len(value) <= 60 else f"{value[:60]}...")
    return str(value)
