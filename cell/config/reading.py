"""What reading a configuration file gives: its document, its value, its problems."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Generic, TypeVar

from pydantic import BaseModel

from cell.config.document import Document, Naming, read_document
from cell.config.problem import Problem
from cell.config.units import ToSI
from cell.config.validation import validate

F = TypeVar("F", bound=BaseModel)


@dataclass(slots=True)
class Reading(Generic[F]):
    """One file, read and validated. With problems, `content` is only good for finding more of them."""

    document: Document | None
    content: F | None
    problems: list[Problem] = field(default_factory=list)


def read(file: Path, schema: type[F], stand_ins: Mapping[str, Any], named_by: Naming | None = None) -> Reading[F]:
    """Read the YAML file against its schema.

    `stand_ins`: see `cell.config.validation`; `named_by`: the value that named the file, for one that is missing.
    """
    document, problems = read_document(file, named_by)
    if document is None:
        return Reading(None, None, problems)
    content, found = validate(document, schema, stand_ins)
    return Reading(document, content, problems + found)


def declared(document: Document, value: float, linear: bool = False) -> float:
    """An angle or length [rad or m], or a speed or acceleration, in the unit that the file declares, for a text."""
    units = ToSI.of(document.value(("units",)))
    return value * units.per_metre if linear else value / units.angle
