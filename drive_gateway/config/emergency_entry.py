"""What a maker's own emergency codes mean, and which are warnings: a table per type of drive in the drives file."""

from collections.abc import Iterator, Mapping
from typing import Annotated, Literal

from pydantic import BaseModel, Field

from cell.config.document import Document
from cell.config.fields import Name
from cell.config.problem import KeyPath, Problem
from cell.config.units import STRICT
from drive_gateway.canopen.emcy import Meaning, meaning_of

Text = Annotated[str, Field(min_length=1, max_length=200)]
Code = Annotated[
    str, Field(pattern=r"^(0[1-9A-Fa-f]|[1-9A-Fa-f][0-9A-Fa-f])[0-9A-Fa-f]{2}$", description="a code: FF01")
]


class EmergencyEntry(BaseModel):
    """One code. What is left out is as CiA 301 and CiA 402 have it."""

    model_config = STRICT
    meaning: Text | None = Field(default=None, description="what the drive says")
    remedy: Text | None = Field(default=None, description="what a person does about it")
    severity: Literal["warning", "fault"] | None = Field(
        default=None,
        description="a fault stops the robot, a warning is told as long as the drive goes on; left out: 8120h is a "
        "warning, all others are faults",
    )

    def of(self, code: int) -> Meaning:
        common = meaning_of(code)
        stops = common.stops if self.severity is None else self.severity == "fault"
        return Meaning(self.meaning or common.text, self.remedy or common.remedy, stops)


EmergencyTables = Annotated[
    dict[Name, dict[Code, EmergencyEntry]],
    Field(description="emergency codes (hex) by type of drive: meaning and severity, over those of CiA 301 and 402"),
]


def codes_of(tables: EmergencyTables, name: str | None) -> Mapping[int, Meaning]:
    """What the codes of the type `name` mean."""
    codes = {} if name is None else tables[name]
    return {int(code, 16): entry.of(int(code, 16)) for code, entry in codes.items()}


def check_emergencies(
    document: Document, tables: EmergencyTables, named: Iterator[tuple[KeyPath, str | None]]
) -> Iterator[Problem]:
    """Every axis names a table that is there."""
    for path, name in named:
        if name is not None and name not in tables:
            allowed = f"a table of emergencies: {', '.join(tables)}" if tables else "none: the file has no emergencies"
            yield document.problem((*path, "emergencies"), repr(name), allowed)
