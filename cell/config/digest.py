"""One short text that says whether two hosts have the same configuration."""

import dataclasses
import hashlib
import json
from collections.abc import Mapping
from enum import Enum

from cell.config.settings import CellSettings, ThingSettings
from cell.config.yaml_tree import Value

_DIGITS = 16


def digest_of(settings: CellSettings, files: Mapping[str, Value]) -> str:
    """16 hex digits of SHA-256 over what the cell file says in SI units and over the files that it names.

    `files`: the value of each named YAML file by its place in the cell file (`robots.left.model`), without programs and
    points: they are read by their own agent alone, and anew while the cell runs. Comments, layout, the order of keys
    and where the files lie do not count. The same lengths in
    another unit count as the same in the cell file, and as a difference in the others. What everybody takes from the
    manager does not count: where a frame is, so what counts of a thing in a frame is its pose in there; and of a zone
    all but its robots.
    """
    zones = {name: sorted(zone.robots) for name, zone in settings.zones.items()}
    meaning = {"settings": _plain(_agreed(settings)), "zones": zones, "files": _plain(dict(files))}
    text = json.dumps(meaning, sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()[:_DIGITS]


def _agreed(settings: CellSettings) -> CellSettings:
    """All that the processes of a cell cannot tell each other while it runs."""
    robots = {
        name: dataclasses.replace(robot, things=tuple(_in_its_frame(thing) for thing in robot.things))
        for name, robot in settings.robots.items()
    }
    return dataclasses.replace(settings, digest="", frames={}, zones={}, robots=robots)


def _in_its_frame(thing: ThingSettings) -> ThingSettings:
    return thing if thing.in_frame is None else dataclasses.replace(thing, pose=thing.in_frame.pose)


def _plain(value: object) -> object:
    """Only what JSON has; whole numbers as float, paths left out (the content of the files counts instead)."""
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return {item.name: _plain(getattr(value, item.name)) for item in dataclasses.fields(value)}
    if isinstance(value, dict):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    if isinstance(value, Enum):
        return value.value
    if isinstance(value, bool | str):
        return value
    return float(value) if isinstance(value, int | float) else None
