"""What a maker's own emergency codes mean: a table per type of drive in the drives file."""

from collections.abc import Iterator, Mapping
from typing import Annotated

from pydantic import BaseModel, Field

from cell.config.document import Document
from cell.config.fields import Name
from cell.config.problem import KeyPath, Problem
from cell.config.units import STRICT

Text = Annotated[str, Field(min_length=1, max_length=200)]
Code = Annotated[
    str, Field(pattern=r"^(0[1-9A-Fa-f]|[1-9A-Fa-f][0-9A-Fa-f])[0-9A-Fa-f]{2}$", description="a code: FF01")
]


class EmergencyEntry(BaseModel):
    """One code."""

    model_config = STRICT
    meaning: Text = Field(description="what the drive says")
    remedy: Text = Field(description="what a person does about it")


EmergencyTables = Annotated[
    dict[Name, dict[Code, EmergencyEntry]],
    Field(description="meanings of emergency codes (hex) by type of drive, over those of CiA 301 and CiA 402"),
]


def codes_of(tables: EmergencyTables, name: str | None) -> Mapping[int, tuple[str, str]]:
    """Meaning and remedy by code of the type `name`."""
    return {} if name is None else {int(code, 16): (text.meaning, text.remedy) for code, text in tables[name].items()}


def check_emergencies(
    document: Document, tables: EmergencyTables, named: Iterator[tuple[KeyPath, str | None]]
) -> Iterator[Problem]:
    """Every axis names a table that is there."""
    for path, name in named:
        if name is not None and name not in tables:
            allowed = f"a table of emergencies: {', '.join(tables)}" if tables else "none: the file has no emergencies"
            yield document.problem((*path, "emergencies"), repr(name), allowed)
