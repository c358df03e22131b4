"""The register of kinematic families: what their robot files say, their joints and links, their kinematics.

`@family` above the class of a family's kinematics is all that the reader of robot files, their checks, `cell schema`
and `load_model` ask for. The classes are in `robot_agent.kinematics`, which any import of `robot_agent` brings in.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, Generic, Literal, TypeVar

from pydantic import BaseModel, Field, create_model

from cell.config.document import Document
from cell.config.problem import Problem
from robot_agent.model.description import RobotDescription
from robot_agent.model.robot_file import RobotFile

G = TypeVar("G", bound=BaseModel)
K = TypeVar("K", bound=Callable[[RobotDescription], Any])
FileCheck = Callable[[Document, Any], Iterator[Problem]]
"""What must hold within a robot file of a family; the file is of the family's schema."""


class ClosedFormFile(RobotFile, Generic[G]):
    """A robot whose chain is in its lengths."""

    geometry: G = Field(description="the family's lengths, each by its name")

    @classmethod
    def stand_in_geometry(cls) -> dict[str, Any]:
        kind = cls.model_fields["geometry"].annotation
        return dict.fromkeys(kind.model_fields, 1) if isinstance(kind, type) and issubclass(kind, BaseModel) else {}

    def lengths(self) -> dict[str, float]:
        return self.geometry.model_dump()


class UnknownFamilyFile(RobotFile):
    """A file whose family is wrong: its geometry cannot be judged."""

    geometry: Any = Field(None, description="depends on the family")


@dataclass(frozen=True, slots=True)
class FamilyShape:
    """Joints J1, J2, ... from the base on, and links from the base to the flange."""

    linear: tuple[bool, ...]
    """Per joint: whether it slides."""
    links: tuple[str, ...]
    lengths: tuple[str, ...]
    """Names of the lengths in `geometry`."""
    fewest: int
    """A robot of the family may lack the joints behind this one."""

    def joint_names(self, count: int | None = None) -> tuple[str, ...]:
        return tuple(f"J{i + 1}" for i in range(len(self.linear) if count is None else count))


@dataclass(frozen=True, slots=True, eq=False)
class Family:
    """What all robots of a family have in common."""

    model: Callable[[RobotDescription], Any]
    """Their kinematics, a `robot_agent.kinematics.Model`."""
    file: type[RobotFile]
    """The schema of their robot files."""
    shape: FamilyShape | None
    """None: each robot has its own, as that of a URDF."""
    check: FileCheck
    no_masses: str | None
    """Why their files have no `masses`; None: they may."""


FAMILIES: dict[str, Family] = {}
"""By the name that a robot file gives as its family."""


def shape_of(name: str) -> FamilyShape:
    """Of a family whose robots all have the same joints and links. Raises `LookupError` for another one."""
    shape = FAMILIES[name].shape
    if shape is None:
        raise LookupError(f"robots of family {name} have a shape each")
    return shape


def family(
    name: str,
    about: str,
    file: type[RobotFile],
    joints: str | None = None,
    links: str = "",
    fewest: int | None = None,
    check: FileCheck = lambda _document, _robot: iter(()),
    no_masses: str | None = None,
) -> Callable[[K], K]:
    """Register a family.

    `file` says what its robot files have beyond `RobotFile`, `about` describes them. `joints`: one letter per joint, R
    turns and P slides, of which a robot has at least `fewest`; `links`: names from the base to the flange.
    """
    title = "".join(part.title() for part in name.split("_")) + "File"
    schema = create_model(title, __base__=file, __doc__=about, family=_family_key(name))
    shape = None
    if joints is not None:
        lengths, linear = tuple(file.stand_in_geometry()), tuple(letter == "P" for letter in joints)
        shape = FamilyShape(linear, tuple(links.split()), lengths, fewest or len(joints))

    def register(kind: K) -> K:
        FAMILIES[name] = Family(kind, schema, shape, check, no_masses)
        return kind

    return register


def file_type(document: Document) -> type[RobotFile]:
    """The schema of a robot file, by the family that it names."""
    named = document.value(("family",))
    if isinstance(named, str) and named in FAMILIES:
        return FAMILIES[named].file
    return create_model("UnknownFamilyFile", __base__=UnknownFamilyFile, family=_family_key(*FAMILIES))


def _family_key(*names: str) -> Any:
    return Literal[names], Field(description=f"kinematic family: {', '.join(names)}")
