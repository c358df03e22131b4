"""The robot file of each family: what all have in common, and the family's own geometry."""

from pathlib import Path
from typing import Any, Generic, TypeVar

from pydantic import BaseModel, Field

from cell.config.document import Document
from robot_agent.model.description import Family, UrdfSource
from robot_agent.model.geometry import (
    CobotGeometry,
    DeltaGeometry,
    GantryGeometry,
    PalletizerGeometry,
    ScaraGeometry,
    SixAxisGeometry,
    UrdfGeometry,
)
from robot_agent.model.robot_file import RobotFile

G = TypeVar("G", bound=BaseModel)


class ClosedFormFile(RobotFile, Generic[G]):
    """A robot whose chain is in its lengths."""

    geometry: G = Field(description="the family's lengths, each by its name")

    @classmethod
    def stand_in_geometry(cls) -> dict[str, Any]:
        kind = cls.model_fields["geometry"].annotation
        return dict.fromkeys(kind.model_fields, 1) if isinstance(kind, type) and issubclass(kind, BaseModel) else {}

    def lengths(self) -> dict[str, float]:
        return self.geometry.model_dump()


class SixAxisFile(ClosedFormFile[SixAxisGeometry]):
    """A six-axis arm with a spherical wrist."""


class CobotFile(ClosedFormFile[CobotGeometry]):
    """A six-axis cobot with three parallel axes."""


class ScaraFile(ClosedFormFile[ScaraGeometry]):
    """A SCARA."""


class PalletizerFile(ClosedFormFile[PalletizerGeometry]):
    """A palletizer with four axes and a hand that stays level."""


class DeltaFile(ClosedFormFile[DeltaGeometry]):
    """A delta robot with three or four axes."""


class GantryFile(ClosedFormFile[GantryGeometry]):
    """A gantry with three slides and a wrist."""


class UrdfFile(RobotFile):
    """Any other open chain: its joints from a URDF, everything that URDF lacks from here."""

    geometry: UrdfGeometry = Field(description="where the chain is: {file: NAME.urdf, flange: LINK}")

    @classmethod
    def stand_in_geometry(cls) -> dict[str, Any]:
        return {"file": "unnamed.urdf"}

    def urdf(self) -> UrdfSource:
        return UrdfSource(Path(self.geometry.file), self.geometry.flange)


class UnknownFamilyFile(RobotFile):
    """A file whose family is wrong: its geometry cannot be judged."""

    geometry: Any = Field(None, description="depends on the family")


FILES: dict[Family, type[RobotFile]] = {
    Family.SIX_AXIS: SixAxisFile,
    Family.COBOT: CobotFile,
    Family.SCARA: ScaraFile,
    Family.PALLETIZER: PalletizerFile,
    Family.DELTA: DeltaFile,
    Family.GANTRY: GantryFile,
    Family.URDF: UrdfFile,
}


def file_type(document: Document) -> type[RobotFile]:
    """The schema of a robot file, by the family that it names."""
    family = document.value(("family",))
    known = {kind.value: schema for kind, schema in FILES.items()}
    return known.get(family, UnknownFamilyFile) if isinstance(family, str) else UnknownFamilyFile
