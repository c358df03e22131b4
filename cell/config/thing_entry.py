"""Schema of what has a shape and a place, and of things that robots keep away from: a table, a wall, a fixture."""

from collections.abc import Iterator
from typing import Annotated, ClassVar, Literal

from pydantic import BaseModel, BeforeValidator, Field

from cell.config.document import Document
from cell.config.fields import FileName, Name, Point, Pose
from cell.config.frame_entry import FrameTree
from cell.config.problem import KeyPath, Problem
from cell.config.settings import (
    BoxShape,
    CylinderShape,
    HalfSpaceShape,
    HullShape,
    InFrame,
    MeshShape,
    Shape,
    SphereShape,
    ThingSettings,
)
from cell.config.units import STRICT, NotNegativeLength, PositiveLength
from cell.geometry.convex import MOST_POINTS

MARGIN_M = 0.005
_UNITS_M = {"m": 1.0, "mm": 0.001, "inch": 0.0254}


Link = Annotated[str, BeforeValidator(lambda name: str(name) if type(name) is int else name)]
"""Links have numbers for names where they have no better one."""


class CylinderEntry(BaseModel):
    """A round column about Z of its pose."""

    model_config = STRICT
    radius: PositiveLength = Field(description="of the column")
    length: PositiveLength = Field(description="along Z, half of it to either side of the pose")


class MeshEntry(BaseModel):
    """A surface of triangles."""

    model_config = STRICT
    file: FileName = Field(description="an STL or OBJ file, relative to this one")
    unit: Literal["mm", "m", "inch"] = Field(description="mm, m or inch: what a 1 in the file means")


class PlacedEntry(BaseModel):
    """What has exactly one shape, at a place; here the shapes that a few lengths give, which zones have too."""

    model_config = STRICT
    shapes: ClassVar[tuple[str, ...]] = ("box", "sphere", "cylinder")
    """The keys of which exactly one is given."""
    pose: Pose = Field(description="pose of its middle: X, Y, Z, A, B, C")
    frame: Name | None = Field(None, description="the frame in which it is given, by name; default world")
    box: tuple[PositiveLength, PositiveLength, PositiveLength] | None = Field(
        None, description="a box: edge lengths [x, y, z]; or another shape"
    )
    sphere: PositiveLength | None = Field(None, description="a ball: its radius")
    cylinder: CylinderEntry | None = Field(None, description="a round column about Z: {radius, length}")

    def shape_problems(self, document: Document, path: KeyPath) -> Iterator[Problem]:
        """More shapes than one, or none."""
        shapes = [shape for shape in self.shapes if document.value((*path, shape)) is not None]
        if len(shapes) != 1:
            found = " and ".join(shapes) or "no shape"
            yield document.problem(path, found, f"exactly one of {', '.join(self.shapes)}", at_key=not shapes)


class ShapedEntry(PlacedEntry):
    """What has any shape, at a place, and is kept away from."""

    shapes = ("box", "hull", "sphere", "cylinder", "half_space", "mesh")
    pose: Pose = Field(description="pose of its middle, of a half space a point of its face: X, Y, Z, A, B, C")
    hull: Annotated[tuple[Point, ...], Field(min_length=4, max_length=MOST_POINTS)] | None = Field(
        None,
        description=f"all between 4 to {MOST_POINTS} corners [x, y, z] in the axes of the pose, and what they span",
    )
    half_space: Literal[True] | None = Field(
        None, description="true: all below the plane Z = 0 of the pose, a floor or a wall; Z points to the free side"
    )
    mesh: MeshEntry | None = Field(
        None, description="triangles of a file: {file, unit}; a surface where they do not close"
    )
    margin: NotNegativeLength = Field(MARGIN_M, description="nearer than this no robot comes; default 5 mm")

    def shape(self, document: Document) -> Shape:
        """The shape; exactly one is given."""
        if self.box is not None:
            return BoxShape(self.box)
        if self.hull is not None:
            return HullShape(self.hull)
        if self.sphere is not None:
            return SphereShape(self.sphere)
        if self.cylinder is not None:
            return CylinderShape(self.cylinder.radius, self.cylinder.length)
        if self.mesh is not None:
            return MeshShape(document.beside(self.mesh.file), _UNITS_M[self.mesh.unit])
        return HalfSpaceShape()


class ThingEntry(ShapedEntry):
    """Something that stands in the cell; robots keep `margin` away from it."""

    may_touch: dict[Name, tuple[Link, ...]] = Field(
        default={}, description="by robot, the links that are not kept away: names as in `cell model`, tool, or a part"
    )

    def problems(self, document: Document, path: KeyPath, robots: list[str]) -> Iterator[Problem]:
        """What the schema cannot say."""
        yield from self.shape_problems(document, path)
        for robot in self.may_touch:
            if robot not in robots:
                allowed = f"one of {', '.join(robots)}"
                yield document.problem((*path, "may_touch", robot), f"unknown robot {robot!r}", allowed, at_key=True)

    def settings(self, name: str, document: Document, frames: FrameTree) -> ThingSettings:
        """The settings; exactly one shape is given."""
        given = self.pose.settings()
        return ThingSettings(
            name,
            self.shape(document),
            frames.in_world(given, self.frame),
            self.margin,
            dict(self.may_touch),
            None if self.frame is None else InFrame(self.frame, given),
        )
