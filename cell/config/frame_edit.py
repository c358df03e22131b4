"""A frame's new place written into its cell file: only its numbers change, comments and order stay."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from cell.config.cell_edit import Changes, NotWritten, angle_text, change_file, length_text, same_as_running
from cell.config.cell_file import CellFile
from cell.config.problem import KeyPath
from cell.config.settings import CellSettings, FrameSettings, Points, PoseSettings
from cell.config.units import ToSI
from cell.geometry import NoFrame, compose, inverse, taught_frame, to_xyz_abc

_KEYS = ("X", "Y", "Z", "A", "B", "C")


def write_frame(
    file: Path, frame: str, place: PoseSettings | Points, running: Mapping[str, FrameSettings]
) -> dict[str, FrameSettings]:
    """Write where a frame is into its cell file, whole or not at all; returns all frames as the file gives them now.

    Args:
        place: its pose in its parent, or three or four points measured in world [m] (`taught_frame`).
        running: all frames of the cell that runs; the file must give the same before.

    Raises:
        NotWritten: the file says something else than `running`; it cannot be read, changed or written.
    """

    def as_running(before: CellSettings) -> None:
        same_as_running(file, before.frames, running)

    return change_file(file, as_running, lambda content: Changes(_values(content, frame, place, running))).frames


def pose_values(path: KeyPath, pose: np.ndarray, units: ToSI) -> dict[KeyPath, str]:
    """The numbers of a pose `(4, 4)` that stands at a path."""
    lengths, angles = np.split(to_xyz_abc(pose), 2)
    texts = [length_text(value, units) for value in lengths] + [angle_text(value, units) for value in angles]
    return {(*path, key): text for key, text in zip(_KEYS, texts, strict=True)}


def _values(
    content: CellFile, frame: str, place: PoseSettings | Points, placed: Mapping[str, FrameSettings]
) -> dict[KeyPath, str]:
    """The numbers of the file that change, by their paths, in its units."""
    entry, units = content.frames[frame], ToSI.of(content.units.model_dump())
    if entry.points is None:
        pose = place.matrix() if isinstance(place, PoseSettings) else _in_parent(place, entry.parent, placed)
        return pose_values(("frames", frame, "pose"), pose, units)
    if isinstance(place, PoseSettings):
        raise NotWritten(
            f"frame {frame} is given by points: teach it again with `cell frame teach {frame} ROBOT`; to give it a "
            "pose, replace its points in the cell file while the cell does not run"
        )
    _taught(place)
    points = [[length_text(value, units) for value in point] for point in place]
    if len(points) != len(entry.points):
        rows = ", ".join(f"[{', '.join(point)}]" for point in points)
        return {("frames", frame, "points"): f"[{rows}]"}
    return {
        ("frames", frame, "points", row, column): text
        for row, point in enumerate(points)
        for column, text in enumerate(point)
    }


def _in_parent(points: Points, parent: str | None, placed: Mapping[str, FrameSettings]) -> np.ndarray:
    pose = _taught(points)
    return pose if parent is None else compose(inverse(placed[parent].pose.matrix()), pose)


def _taught(points: Points) -> np.ndarray:
    try:
        return taught_frame(np.array(points))
    except NoFrame as error:
        raise NotWritten(f"these points give no frame: {error}") from error
