"""Spaces, cones and joint ranges of each robot: what its model and its drives must have, and where its home must be."""

from collections.abc import Iterator

from cell.commands.checks.readings import Readings
from cell.commands.checks.things import check_shape
from cell.config.cell_file import RobotEntry
from cell.config.frame_entry import FrameTree
from cell.config.problem import KeyPath, Problem
from cell.config.space_entry import joint_range
from cell.config.units import ToSI
from robot_agent.kinematics import Model
from robot_agent.workspace import PlacedRobot, Spaces

_ROUNDING = 1e-9


def check_spaces(readings: Readings, models: dict[str, Model]) -> Iterator[Problem]:
    """Shapes that are none, inputs that nobody tells, ranges wider than the model's, homes that break a rule."""
    for robot, entry in readings.cell.robots.items():
        path: KeyPath = ("robots", robot)
        found = list(_inputs(readings, path, entry))
        for name, space in entry.spaces.items():
            found += check_shape(readings.document, (*path, "spaces", name), space)
            found += space.problems(readings.document, (*path, "spaces", name))
        if robot in models:
            found += _ranges(readings, path, entry, models[robot])
            if not found:
                found += _home(readings, path, entry, models[robot])
        yield from found


def _inputs(readings: Readings, path: KeyPath, entry: RobotEntry) -> Iterator[Problem]:
    """An input that switches a space is one of the robot's in its drives file."""
    robot = str(path[1])
    known = next(
        (
            drives.robots[robot].inputs
            for gateway, _, drives in readings.named.usable_drives()
            if gateway == entry.gateway and robot in drives.robots
        ),
        None,
    )
    for name, space in entry.spaces.items():
        if known is not None and space.off_while is not None and space.off_while not in known:
            allowed = (
                f"one of {', '.join(known)}" if known else f"an input of {robot} in its drives file; there is none"
            )
            where = (*path, "spaces", name, "off_while")
            yield readings.document.problem(where, f"unknown input {space.off_while!r}", allowed)


def _ranges(readings: Readings, path: KeyPath, entry: RobotEntry, model: Model) -> Iterator[Problem]:
    """Ranges narrower than the model's, of joints that there are."""
    units = readings.cell.units
    si = ToSI.of(units.model_dump())
    for joint, pair in entry.joints.items():
        where = (*path, "joints", joint)
        if joint not in model.joint_names:
            allowed = f"one of {', '.join(model.joint_names)}"
            yield readings.document.problem(where, f"unknown joint {joint!r}", allowed, at_key=True)
            continue
        index = model.joint_names.index(joint)
        both, slides = joint_range(pair, si), bool(model.linear[index])
        low, high = both.slide_m if slides else both.turn_rad
        least, most = model.limits.position[index]
        if low < least - _ROUNDING or high > most + _ROUNDING:
            unit, factor = (units.length, si.per_metre) if slides else (units.angle, 1.0 / si.angle)
            allowed = f"a range within that of the robot file, {least * factor:g} to {most * factor:g} {unit}"
            yield readings.document.problem(where, f"[{pair[0]:g}, {pair[1]:g}]", allowed)
        elif not low - _ROUNDING <= model.home[index] <= high + _ROUNDING:
            yield readings.document.problem(
                where, f"[{pair[0]:g}, {pair[1]:g}], home is outside", "a range with home in it"
            )


def _home(readings: Readings, path: KeyPath, entry: RobotEntry, model: Model) -> Iterator[Problem]:
    """Where programs begin the robot keeps to its spaces."""
    frames = FrameTree(readings.cell.frames)
    settings = tuple(space.settings(name, readings.document, frames) for name, space in entry.spaces.items())
    orientation = None if entry.orientation is None else entry.orientation.settings()
    spaces = Spaces(model, settings, orientation)
    base = PlacedRobot.at(model, frames.in_world(entry.base.settings(), entry.frame)).pose_world_base
    if spaces and (breach := spaces.breach_at(base, model.home)):
        key = "spaces" if entry.spaces else "orientation"
        allowed = "spaces that hold the robot at home, or another home"
        yield readings.document.problem((*path, key), f"at home {breach}", allowed, at_key=True)
