"""What is changed of a zone while its cell runs, in the settings and in the text of the cell file."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from cell.config.cell_edit import change_file, length_text, same_as_running
from cell.config.cell_file import CellFile
from cell.config.frame_edit import pose_values
from cell.config.problem import KeyPath
from cell.config.settings import CellSettings, FrameSettings, InFrame, PoseSettings, ZoneSettings
from cell.config.units import ToSI
from cell.config.yaml_edit import Changes
from cell.geometry import compose
from cell.messages import SetZone


def changed_zone(zone: ZoneSettings, change: SetZone, frames: Mapping[str, FrameSettings]) -> ZoneSettings:
    """A zone as it is after a change. `frames`: where all frames are."""
    if change.place is not None:
        given = PoseSettings(change.place.position_m, change.place.quaternion_xyzw)
        if zone.in_frame is None:
            zone = replace(zone, pose=given)
        else:
            world = PoseSettings.of(compose(frames[zone.in_frame.frame].pose.matrix(), given.matrix()))
            zone = replace(zone, pose=world, in_frame=InFrame(zone.in_frame.frame, given))
    if change.shape is not None:
        zone = replace(zone, shape=change.shape, size_m=change.size_m)
    return replace(zone, of=change.of or zone.of, priority=zone.priority | change.priority)


def write_zone(file: Path, change: SetZone, running: Mapping[str, ZoneSettings]) -> dict[str, ZoneSettings]:
    """Write a change of a zone into its cell file, whole or not at all; returns all zones as the file gives them now.

    `running`: all zones of the cell that runs; the file must give the same before.

    Raises:
        cell.config.cell_edit.NotWritten: the file says something else than `running`, or would be refused; it cannot be
            read, changed or written.
    """

    def as_running(before: CellSettings) -> None:
        same_as_running(file, before.zones, running)

    return change_file(file, as_running, lambda content: _changes(content, change)).zones


def _changes(content: CellFile, change: SetZone) -> Changes:
    entry, units = content.zones[change.zone], ToSI.of(content.units.model_dump())
    path: KeyPath = ("zones", change.zone)
    values: dict[KeyPath, str] = {}
    added: dict[KeyPath, str] = {}
    renamed: dict[KeyPath, tuple[str, str]] = {}
    if change.place is not None:
        pose = PoseSettings(change.place.position_m, change.place.quaternion_xyzw).matrix()
        values |= pose_values((*path, "pose"), pose, units)
    if change.shape is not None:
        lengths = [length_text(length, units) for length in change.size_m]
        present = next(shape for shape in entry.shapes if getattr(entry, shape) is not None)
        same = {"size": "box"}.get(present, present) == change.shape
        values |= _lengths((*path, present), change.shape, lengths) if same else {}
        renamed |= {} if same else {(*path, present): (change.shape, _one_line(change.shape, lengths))}
    if change.of is not None:
        (values if "of" in entry.model_fields_set else added)[*path, "of"] = change.of.value
    if change.priority and not entry.priority:
        ranks = f"{{{', '.join(f'{robot}: {n}' for robot, n in change.priority.items())}}}"
        if "priority" in entry.model_fields_set:
            renamed[*path, "priority"] = "priority", ranks
        else:
            added[*path, "priority"] = ranks
    else:
        for robot, n in change.priority.items():
            (values if robot in entry.priority else added)[*path, "priority", robot] = str(n)
    return Changes(values, added, renamed)


def _lengths(path: KeyPath, shape: str, lengths: list[str]) -> dict[KeyPath, str]:
    """The lengths of a shape that stays, each at its place."""
    if shape == "sphere":
        return {path: lengths[0]}
    keys: tuple[str | int, ...] = ("radius", "length") if shape == "cylinder" else (0, 1, 2)
    return {(*path, key): length for key, length in zip(keys, lengths, strict=True)}


def _one_line(shape: str, lengths: list[str]) -> str:
    """The lengths of a shape that comes new."""
    if shape == "cylinder":
        return f"{{radius: {lengths[0]}, length: {lengths[1]}}}"
    return lengths[0] if shape == "sphere" else f"[{', '.join(lengths)}]"
