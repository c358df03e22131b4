"""Drives of makers whose documents are known: a drives file says `like: NAME` instead of looking the same up again.

Each is a file in `known_drives`. Every fact in it has its source; none was tried with this program.
"""

from collections.abc import Iterator
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Annotated, Literal

from pydantic import BaseModel, Field

from cell.config.problem import ConfigError
from cell.config.reading import read
from cell.config.units import STRICT
from drive_gateway.canopen.eds import TYPES, Eds, ObjectEntry
from drive_gateway.canopen.optional_objects import OPTIONAL_OBJECTS
from drive_gateway.config.object_address import ObjectAddress, address_of

_FOLDER = Path(str(files("drive_gateway.config").joinpath("known_drives")))
KNOWN_DRIVES = tuple(sorted(path.stem for path in _FOLDER.glob("*.yaml")))
"""Names that `like` takes."""
UNITS = ("velocity_unit", "acceleration_unit")
Text = Annotated[str, Field(min_length=1)]


class KeyFact(BaseModel):
    """What a key of an axis is for such a drive."""

    model_config = STRICT
    value: str | int
    source: Text


class ObjectFact(BaseModel):
    """An object of the maker's own."""

    model_config = STRICT
    name: Text
    type: Literal[
        "INTEGER8", "INTEGER16", "INTEGER32", "INTEGER64", "UNSIGNED8", "UNSIGNED16", "UNSIGNED32", "UNSIGNED64"
    ]
    source: Text


class NoteFact(BaseModel):
    """What a person should know and no key says."""

    model_config = STRICT
    text: Text
    source: Text


class KnownDrive(BaseModel):
    """One kind of drive."""

    model_config = STRICT
    drive: Text
    keys: dict[Literal["velocity_unit", "acceleration_unit", "mode", "interpolation"], KeyFact]
    lacks: dict[Annotated[str, Field(pattern=r"^[0-9A-F]{4}$")], Text]
    """Index of an object that it has not, and the source."""
    objects: dict[ObjectAddress, ObjectFact]
    notes: tuple[NoteFact, ...]

    @property
    def missing(self) -> dict[int, str]:
        """`lacks` by number."""
        return {int(index, 16): source for index, source in self.lacks.items()}

    def axis_keys(self) -> dict[str, object]:
        """What an axis says of itself by being like this drive."""
        waived = tuple(f"{index:04X}" for index in self.missing if index in OPTIONAL_OBJECTS)
        return {key: fact.value for key, fact in self.keys.items()} | ({"waive": waived} if waived else {})

    def entries(self) -> tuple[ObjectEntry, ...]:
        """Its maker's objects, with their types."""
        return tuple(
            ObjectEntry(*address_of(address), fact.name, *TYPES[fact.type], False, False, True, True)
            for address, fact in self.objects.items()
        )

    def facts(self) -> Iterator[str]:
        """All that is known, each with its source, for people."""
        for key, fact in self.keys.items():
            yield f"{key}: {fact.value}  [{fact.source}]"
        for index, source in self.lacks.items():
            yield f"no {index}h  [{source}]"
        for address, item in self.objects.items():
            yield f"{address} {item.name}, {item.type}  [{item.source}]"
        for note in self.notes:
            yield f"{note.text}  [{note.source}]"


@cache
def known_drive(name: str) -> KnownDrive:
    """The drive of that name, one of `KNOWN_DRIVES`."""
    reading = read(_FOLDER / f"{name}.yaml", KnownDrive, {})
    if reading.content is None or reading.problems:
        raise ConfigError(tuple(reading.problems))
    return reading.content


def eds_of(file: str, axes: int, like: str | None) -> Eds:
    """The file; without one plain CiA 402 with so many axes, and the objects of the known drive that they are like.

    Raises:
        EdsError: the file is missing or no EDS.
    """
    return Eds(file, axes, known_drive(like).entries() if like is not None and not file else ())


def check_name(name: str) -> str:
    """Raises `ValueError` with the names that there are."""
    if name not in KNOWN_DRIVES:
        raise ValueError(f"one of {', '.join(KNOWN_DRIVES)}")
    return name


def with_known_keys(axis: object) -> object:
    """The raw entry of an axis with what it is like; what the file itself says goes before."""
    if not isinstance(axis, dict) or axis.get("like") not in KNOWN_DRIVES:
        return axis
    return known_drive(axis["like"]).axis_keys() | axis
