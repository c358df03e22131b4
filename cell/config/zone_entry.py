"""Schema of an exclusive zone."""

from collections.abc import Iterator
from typing import Annotated, ClassVar

from pydantic import Field

from cell.config.document import Document
from cell.config.fields import Name
from cell.config.frame_entry import FrameTree
from cell.config.problem import KeyPath, Problem
from cell.config.settings import InFrame, ZoneSettings
from cell.config.thing_entry import PlacedEntry
from cell.config.units import PositiveLength
from cell.geometry import SpaceOf


class ZoneEntry(PlacedEntry):
    """An exclusive zone: one robot at a time may be in it."""

    shapes: ClassVar[tuple[str, ...]] = ("box", "size", "sphere", "cylinder")
    size: tuple[PositiveLength, PositiveLength, PositiveLength] | None = Field(
        None, description="a box as well: edge lengths [x, y, z], as older files have it"
    )
    robots: Annotated[tuple[Name, ...], Field(min_length=1)] = Field(description="robots that may ask for the zone")
    of: Annotated[SpaceOf, Field(strict=False)] = Field(
        SpaceOf.BODY,
        description="body: a robot is inside with any part of it, or tcp: with the point of its tool alone, without a "
        "tool that of its flange",
    )
    priority: dict[Name, Annotated[int, Field(ge=0, le=1000)]] = Field(
        default={},
        description="by robot: while others wait, it goes before each of them up to so many times; default 0, first "
        "come first served",
    )

    def problems(self, document: Document, path: KeyPath, robots: list[str]) -> Iterator[Problem]:
        """What the schema cannot say; `robots` are those of the cell."""
        yield from self.shape_problems(document, path)
        for index, name in enumerate(self.robots):
            if name not in robots:
                allowed = f"one of {', '.join(robots)}"
                yield document.problem((*path, "robots", index), f"unknown robot {name!r}", allowed)
            elif name in self.robots[:index]:
                yield document.problem((*path, "robots", index), f"{name!r} a second time", "each robot once")
        for name in self.priority:
            if name not in self.robots:
                found = f"a priority of {name}, which may not ask for the zone"
                allowed = f"one of {', '.join(self.robots)}"
                yield document.problem((*path, "priority", name), found, allowed, at_key=True)

    def settings(self, name: str, frames: FrameTree) -> ZoneSettings:
        """The settings; exactly one shape is given."""
        pose = frames.in_world(self.pose.settings(), self.frame)
        shape, size_m = self._measured()
        in_frame = None if self.frame is None else InFrame(self.frame, self.pose.settings())
        return ZoneSettings(name, size_m, pose, self.robots, shape, self.of, dict(self.priority), in_frame)

    def _measured(self) -> tuple[str, tuple[float, ...]]:
        """Its shape and its lengths [m], as `cell.geometry.MEASURED` has them."""
        if self.sphere is not None:
            return "sphere", (self.sphere,)
        if self.cylinder is not None:
            return "cylinder", (self.cylinder.radius, self.cylinder.length)
        return "box", self.box or self.size or ()
