"""Schema of what one robot keeps to: spaces, where its tool points, ranges of its joints."""

from collections.abc import Iterator
from typing import Annotated, Literal

import numpy as np
from pydantic import AfterValidator, BaseModel, Field

from cell.config.document import Document
from cell.config.fields import Name
from cell.config.frame_entry import FrameTree
from cell.config.problem import KeyPath, Problem
from cell.config.settings import JointRange, OrientationSettings, SpaceKind, SpaceSettings
from cell.config.thing_entry import ShapedEntry
from cell.config.units import STRICT, Number, PositiveAngle, PositiveLength, ToSI
from cell.geometry import SpaceOf

_AXES = ("X", "Y", "Z")


class SpaceEntry(ShapedEntry):
    """A space of one robot: where it stays, where it does not go, or where it is slow."""

    kind: Annotated[SpaceKind, Field(strict=False)] = Field(
        description="safe: it stays inside all safe spaces together; forbidden: it stays out; slow: it is slow in there"
    )
    of: Annotated[SpaceOf, Field(strict=False)] = Field(
        SpaceOf.BODY, description="body: the whole moving body with its tool, or tcp: the point of the tool alone"
    )
    by_program: bool = Field(False, description="SPACE in the robot's program switches it; on when a program begins")
    off_while: Name | None = Field(
        None, description="a forbidden space is off while this named input of the robot is closed (1), on else"
    )
    speed: PositiveLength | None = Field(None, description="of the TCP in a slow space")

    def problems(self, document: Document, path: KeyPath) -> Iterator[Problem]:
        """What the schema cannot say."""
        yield from self.shape_problems(document, path)
        if self.kind is SpaceKind.SAFE and self.box is None and self.hull is None:
            yield document.problem(
                path, "a safe space of this shape", "box or hull: several of them hold a robot together"
            )
        if self.off_while is not None and self.kind is not SpaceKind.FORBIDDEN:
            found = f"an input that switches a {self.kind.value} space"
            yield document.problem(
                (*path, "off_while"), found, "that of a forbidden space: without the input that is on"
            )
        if self.off_while is not None and self.by_program:
            yield document.problem((*path, "off_while"), "an input beside by_program", "one of them")
        if (self.speed is None) is (self.kind is SpaceKind.SLOW):
            found = "a slow space without speed" if self.speed is None else f"a speed in a {self.kind.value} space"
            yield document.problem(path, found, "speed in slow spaces, and only there")

    def settings(self, name: str, document: Document, frames: FrameTree) -> SpaceSettings:
        """The settings; exactly one shape is given."""
        return SpaceSettings(
            name,
            self.kind,
            self.shape(document),
            frames.in_world(self.pose.settings(), self.frame),
            self.margin,
            self.of,
            self.by_program,
            self.off_while,
            self.speed,
        )


def _some_way(direction: tuple[float, float, float]) -> tuple[float, float, float]:
    if not np.linalg.norm(direction) > 1e-6:
        raise ValueError("a direction [x, y, z] that is not zero")
    return direction


def _less_than_all(angle_rad: float) -> float:
    if angle_rad >= np.pi:
        raise ValueError("less than 180 deg: beyond that every direction is allowed")
    return angle_rad


class OrientationEntry(BaseModel):
    """Where the tool may point, whatever its roll: an axis of the TCP's frame within a cone."""

    model_config = STRICT
    axis: Literal["X", "Y", "Z"] = Field("X", description="the axis of the TCP's frame along which the tool points")
    towards: Annotated[tuple[Number, Number, Number], AfterValidator(_some_way)] = Field(
        description="the middle of the cone, a direction in world: [x, y, z]"
    )
    within: Annotated[PositiveAngle, AfterValidator(_less_than_all)] = Field(
        description="the largest angle between them, less than 180 deg"
    )

    def settings(self) -> OrientationSettings:
        """The settings."""
        x, y, z = (np.array(self.towards) / np.linalg.norm(self.towards)).tolist()
        return OrientationSettings(_AXES.index(self.axis), (x, y, z), self.within)


def joint_range(low_high: tuple[float, float], si: ToSI) -> JointRange:
    """A range in the units of the file, both as of a joint that turns and as of one that slides."""
    low, high = low_high
    return JointRange((low * si.angle, high * si.angle), (low / si.per_metre, high / si.per_metre))
