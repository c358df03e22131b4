"""A taught point written into its robot's points file: comments and order stay."""

import math
from collections.abc import Mapping
from pathlib import Path

from ruamel.yaml.error import YAMLError

from cell.config.points_file import (
    COORDINATES,
    JointPoint,
    Point,
    PointsOwner,
    PointsSettings,
    read_points,
    settings_of,
)
from cell.config.problem import refuses
from cell.config.yaml_edit import NotWritten, number_text, put, with_entry, word

_BOM = "\ufeff"
_LENGTH_DIGITS, _ANGLE_DIGITS = 4, 6
"""After the point, of millimetres and degrees: a tenth of a micrometre, less than a tenth of a microradian."""
_NEW = "# Points of this robot, in mm and deg; docs/points_file.md says what they may say\n"


def write_point(file: Path, name: str, point: Point, owner: PointsOwner) -> PointsSettings:
    """Write a point into its file, whole or not at all; returns all that the file says then.

    The file comes to be with its first point. What somebody has changed in it meanwhile counts from then on, too.

    Raises:
        NotWritten: the file has problems, it cannot be read, changed or written.
    """
    file = file.resolve()
    try:
        raw = _NEW
        if file.exists():
            _read(file, owner)
            raw = file.read_bytes().decode()
        text = raw.removeprefix(_BOM)
        changed = with_entry(text, ("points", name), _words(point, owner))
        return put(file, raw[: len(raw) - len(text)] + changed, lambda beside: _read(beside, owner))
    except (OSError, UnicodeDecodeError, YAMLError) as error:
        raise NotWritten(f"{file} cannot be written: {getattr(error, 'strerror', None) or error}") from error


def _read(file: Path, owner: PointsOwner) -> PointsSettings:
    reading = read_points(file, owner)
    if reading.content is None or refuses(reading.problems):
        problems = "; ".join(map(str, reading.problems))
        raise NotWritten(f"the points file is refused as it is now: {problems}; correct it, then teach again")
    return settings_of(reading.content, owner)


def _words(point: Point, owner: PointsOwner) -> Mapping[str, str]:
    """What the file says of a point, by key."""
    if isinstance(point, JointPoint):
        return {
            joint: _length(value) if joint in owner.linear else _angle(value)
            for joint, value in zip(owner.joints, point.joints, strict=True)
        }
    values = [*map(_length, point.position_m), *map(_angle, point.orientation_abc)]
    named = {"frame": point.frame, "tool": point.tool, "branch": point.branch}
    words = {key: word(value) for key, value in named.items() if value is not None}
    return dict(zip(COORDINATES, values, strict=True)) | words


def _length(value_m: float) -> str:
    return number_text(1000.0 * value_m, _LENGTH_DIGITS)


def _angle(value_rad: float) -> str:
    return number_text(math.degrees(value_rad), _ANGLE_DIGITS)
