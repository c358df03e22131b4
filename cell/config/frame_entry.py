"""Schema of a frame, and the tree of all frames of a cell: what stands together is taught once and placed in one."""

from collections.abc import Iterator, Mapping
from typing import Annotated

import numpy as np
from pydantic import BaseModel, Field

from cell.config.document import Document
from cell.config.fields import Name, Point, Pose
from cell.config.problem import KeyPath, Problem
from cell.config.settings import FrameSettings, PoseSettings
from cell.config.units import STRICT
from cell.geometry import NoFrame, compose, taught_frame
from cell.geometry.arrays import Array

WORLD = "world"


class FrameEntry(BaseModel):
    """A frame in which robots, zones, things, spaces and conveyors may be given."""

    model_config = STRICT
    pose: Pose | None = Field(None, description="pose in the parent: X, Y, Z, A, B, C; or points")
    parent: Name | None = Field(None, description="the frame in which the pose is given; default world")
    points: Annotated[tuple[Point, ...], Field(min_length=3, max_length=4)] | None = Field(
        None,
        description="or three points measured in world, [x, y, z] each: two on X, in its direction, and one on Y; the "
        "origin is the foot of that on X, or a fourth point",
    )

    def in_parent(self) -> Array:
        """Pose `(4, 4)` in its parent. Raises `NoFrame` for points without one, ValueError without either."""
        if self.points is not None:
            return taught_frame(np.array(self.points))
        if self.pose is None:
            raise ValueError("a frame with neither pose nor points")
        return self.pose.settings().matrix()


class FrameTree:
    """The frames of a cell file, each placed in world; those that cannot be are left out."""

    def __init__(self, frames: Mapping[str, FrameEntry]) -> None:
        self._frames = frames
        self._placed: dict[str, Array] = {}
        for name in frames:
            self._place(name, ())

    def _place(self, name: str, below: tuple[str, ...]) -> Array | None:
        """Pose in world; None beneath a cycle, an unknown parent or points that are no frame."""
        if name in self._placed:
            return self._placed[name]
        frame = self._frames.get(name)
        if frame is None or name in below:
            return None
        try:
            pose: Array | None = frame.in_parent()
        except ValueError:
            return None
        if frame.parent is not None and pose is not None:
            parent = self._place(frame.parent, (*below, name))
            pose = None if parent is None else compose(parent, pose)
        if pose is not None:
            self._placed[name] = pose
        return pose

    def settings(self, fixed: Mapping[str, str | None]) -> dict[str, FrameSettings]:
        """All that are placed, in the order of the file; `fixed`: what must not move, and its frame."""
        stand: dict[str, list[str]] = {name: [] for name in self._placed}
        for what, frame in fixed.items():
            for above in self._above(frame):
                stand[above].append(what)
        return {
            name: FrameSettings(name, frame.parent, PoseSettings.of(self._placed[name]), tuple(stand[name]))
            for name, frame in self._frames.items()
            if name in self._placed
        }

    def _above(self, frame: str | None) -> Iterator[str]:
        """A frame that is placed, and all that it lies in."""
        while frame in self._placed:
            yield frame
            frame = self._frames[frame].parent

    def in_world(self, given: PoseSettings, frame: str | None) -> PoseSettings:
        """What is given in a frame; in one that is not placed, which is a problem of its own, as if in world."""
        pose = self._placed.get(frame or WORLD)
        return given if pose is None else PoseSettings.of(compose(pose, given.matrix()))


def frame_problems(document: Document, frames: Mapping[str, FrameEntry]) -> Iterator[Problem]:
    """What the schema cannot say of frames."""
    told: set[str] = set()
    for name, frame in frames.items():
        path: KeyPath = ("frames", name)
        if name == WORLD:
            yield document.problem(path, f"the name {WORLD!r}", "another name: that frame is always there", at_key=True)
        given = {"pose", "points"}.intersection(document.keys(path))
        if len(given) != 1:
            found = "pose and points" if given else "neither pose nor points"
            yield document.problem(path, found, "exactly one of them")
        elif frame.points is not None:
            if frame.parent is not None:
                yield document.problem((*path, "parent"), "a parent", "none: points are measured in world")
            try:
                frame.in_parent()
            except NoFrame as error:
                yield document.problem((*path, "points"), error.defect, "points apart from each other, one aside")
        yield from unknown_frame(document, (*path, "parent"), frame.parent)
        cycle = _cycle(name, frames)
        if cycle and told.isdisjoint(cycle):
            told.update(cycle)
            found = f"a cycle: {' in '.join((*cycle, name))}"
            yield document.problem((*path, "parent"), found, "a frame that does not lie in this one, or none: world")


def unknown_frame(document: Document, path: KeyPath, frame: str | None) -> Iterator[Problem]:
    """A problem at `path`, where a frame is named that the file does not have."""
    known = [name for name in document.keys(("frames",)) if path[:2] != ("frames", name)]
    if frame == WORLD:
        yield document.problem(path, f"the frame {frame!r}", "nothing at all: what names no frame is in world")
    elif frame is not None and frame not in document.keys(("frames",)):
        allowed = f"one of {', '.join(known)}, or none: world" if known else "a frame of this file; there is no other"
        yield document.problem(path, f"unknown frame {frame!r}", allowed)


def _cycle(name: str, frames: Mapping[str, FrameEntry]) -> tuple[str, ...]:
    """The frames from this one up to itself; empty where the way up ends."""
    way, above = [name], frames[name].parent
    while above is not None and above in frames and above not in way:
        way.append(above)
        above = frames[above].parent
    return tuple(way) if above == name else ()
