"""A frame's new place written into its cell file: only its numbers change, comments and order stay."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from ruamel.yaml.error import YAMLError

from cell.config.cell_file import CellFile
from cell.config.load import read_cell
from cell.config.problem import KeyPath, refuses
from cell.config.settings import CellSettings, FrameSettings, Points, PoseSettings
from cell.config.units import ToSI
from cell.config.yaml_edit import NotWritten, number_text, put, replaced
from cell.geometry import NoFrame, compose, inverse, taught_frame, to_xyz_abc

_KEYS = ("X", "Y", "Z", "A", "B", "C")
_BOM = "\ufeff"
_LENGTH_DIGITS, _ANGLE_DIGITS = 7, 8
"""After the point, of metres and radians: a tenth of a micrometre, a hundredth of a microradian."""


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
    file = file.resolve()
    before, content = _read(file)
    if differing := sorted(name for name in {**before.frames, **running} if not _same(name, before.frames, running)):
        raise NotWritten(
            f"{file} gives {', '.join(differing)} otherwise than the cell runs with: somebody has changed it since the "
            "manager was started; start the manager again, or take the change back"
        )
    try:
        raw = file.read_bytes().decode()
        text = raw.removeprefix(_BOM)
        values = _values(content, frame, place, before.frames)
        changed = replaced(text, values)
        settings, _ = put(file, raw[: len(raw) - len(text)] + changed, _read)
        return settings.frames
    except (OSError, UnicodeDecodeError, YAMLError) as error:
        raise NotWritten(f"{file} cannot be written: {getattr(error, 'strerror', None) or error}") from error


def _read(file: Path) -> tuple[CellSettings, CellFile]:
    reading = read_cell(file)
    if reading.document is None or reading.content is None or refuses(reading.problems):
        raise NotWritten(f"the cell file is refused: {'; '.join(map(str, reading.problems))}")
    return reading.content.settings(reading.document, digest=""), reading.content


def _same(name: str, one: Mapping[str, FrameSettings], other: Mapping[str, FrameSettings]) -> bool:
    return one.get(name) == other.get(name)


def _values(
    content: CellFile, frame: str, place: PoseSettings | Points, placed: Mapping[str, FrameSettings]
) -> dict[KeyPath, str]:
    """The numbers of the file that change, by their paths, in its units."""
    entry, units = content.frames[frame], ToSI.of(content.units.model_dump())
    if entry.points is None:
        pose = place.matrix() if isinstance(place, PoseSettings) else _in_parent(place, entry.parent, placed)
        lengths, angles = np.split(to_xyz_abc(pose), 2)
        texts = [_length(value, units) for value in lengths] + [_angle(value, units) for value in angles]
        return {("frames", frame, "pose", key): text for key, text in zip(_KEYS, texts, strict=True)}
    if isinstance(place, PoseSettings):
        raise NotWritten(
            f"frame {frame} is given by points: teach it again with `cell frame teach {frame} ROBOT`; to give it a "
            "pose, replace its points in the cell file while the cell does not run"
        )
    _taught(place)
    points = [[_length(value, units) for value in point] for point in place]
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


def _length(value_m: float, units: ToSI) -> str:
    return number_text(value_m * units.per_metre, _LENGTH_DIGITS - (3 if units.per_metre == 1000.0 else 0))


def _angle(value_rad: float, units: ToSI) -> str:
    return number_text(value_rad / units.angle, _ANGLE_DIGITS - (2 if units.angle != 1.0 else 0))
