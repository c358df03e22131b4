"""`cell frame show`, `set` and `teach`: where the frames of the cell are, and how an operator moves one."""

import math
import sys
import time
from pathlib import Path
from typing import Annotated, NamedTuple

import numpy as np
import typer

from cell.commands.client.cell_view import at_rest, names
from cell.commands.client.connection import Connection, connect, report
from cell.commands.client.json_lines import json_line
from cell.commands.emergency.words import operator_name
from cell.commands.errors import CommandError, quoted
from cell.commands.options import CELL_FILE, CellFileOption, ConnectOption, JsonOption, RobotArgument
from cell.config.settings import PoseSettings
from cell.geometry import NoFrame, from_xyz_abc, largest_shift, largest_turn, taught_frame, to_xyz_abc
from cell.messages import Command, FramePose, PlaceFrame, ProgramState, RobotState, TeachFrame

FrameArgument = Annotated[str, typer.Argument(metavar="FRAME", help="Name of the frame in the cell file.")]
_ANSWER_S = 1.0
_TAKEN_S = 2.5
"""A robot has a frame by then even where the first message is lost: the manager repeats it every second."""
_APART_S = 0.15
_STILL_M = 1e-4
"""What stands is measured within this, `_APART_S` apart."""
_ERROR_M = 0.001
"""How well people point with a robot, for telling what points allow."""
_FARTHEST_MM = 1e9
_POINTS = ("a point on its X", "a second point on its X, farther along", "a point on its Y")

Point = tuple[float, float, float]


def show(
    frame: Annotated[
        str | None, typer.Argument(metavar="[FRAME]", help="Only this one, and what it means.", show_default=False)
    ] = None,
    as_json: JsonOption = False,
    file: CellFileOption = Path(CELL_FILE),
    endpoint: ConnectOption = None,
) -> None:
    """Print where the frames of the running cell are in world, by the manager, in mm and deg."""
    with connect(file, endpoint) as operator:
        if frame is not None:
            _check_frame(operator, frame)
        operator.manager_state()
        told = operator.session.last("frame/*", _ANSWER_S)
        frames = sorted((each for each in told if isinstance(each, FramePose)), key=lambda each: each.frame)
        for each in frames:
            if frame in (None, each.frame):
                pose = _pose_text(PoseSettings(each.position_m, each.quaternion_xyzw).matrix())
                line = f"{each.frame}: {pose}, given in {each.parent or 'world'}, version {each.version}"
                typer.echo(json_line("frame", each.frame, each) if as_json else line)
        if not frames and not as_json:
            typer.echo(f"cell {operator.settings.name} has no frames")


def set_(
    frame: FrameArgument,
    pose: Annotated[
        str, typer.Option("--pose", metavar="X,Y,Z,A,B,C", help="In its parent as the cell file says; mm and deg.")
    ],
    file: CellFileOption = Path(CELL_FILE),
    endpoint: ConnectOption = None,
) -> None:
    """Give a frame another pose, in the manager's cell file and in the running cell.

    What robots have planned already keeps the old place; the command says up to which line. Refused for a frame in
    which a zone, a robot's base or a conveyor is given.
    """
    placed = parsed_pose(pose)
    with connect(file, endpoint) as operator:
        _check_movable(operator, frame)
        move_frame(operator, frame, PlaceFrame(frame, placed.position_m, placed.quaternion_xyzw, operator_name()))


def teach(
    frame: FrameArgument,
    robot: RobotArgument,
    origin: Annotated[bool, typer.Option("--origin", help="Also ask for the origin, as a fourth point.")] = False,
    file: CellFileOption = Path(CELL_FILE),
    endpoint: ConnectOption = None,
) -> None:
    """Place a frame by three points to which you jog a robot, in another terminal: two on its X, one on its Y.

    Its origin is where Y meets X; with --origin a fourth point is it. The points are those of the TCP. Nothing is
    written before you say so.
    """
    with connect(file, endpoint) as operator:
        _check_movable(operator, frame)
        operator.check_robot(robot)
        taken: list[_Taken] = []
        for what in (*_POINTS, "its origin")[: 4 if origin else 3]:
            taken.append(_confirmed(operator, robot, f"{len(taken) + 1}: {what}"))
        if len(tools := {each.tool for each in taken}) > 1:
            carried = " and ".join(sorted(tool or "no tool" for tool in tools))
            raise CommandError(f"points of {carried}: nothing was changed", "take all of them with one tool")
        points = [each.place for each in taken]
        typer.echo(f"{frame} comes to be at {allowed_by(points)}")
        if not typer.confirm("Take it over?"):
            raise CommandError("nothing was changed")
        first, second, third = points[:3]
        last = points[3] if origin else None
        move_frame(operator, frame, TeachFrame(frame, (first, second, third), operator_name(), last))


def _check_frame(operator: Connection, frame: str) -> None:
    frames = operator.settings.frames
    if frame not in frames:
        raise CommandError(f"no frame {frame!r} in {operator.file}; its frames are: {names(frames) or 'none'}")


def _check_movable(operator: Connection, frame: str) -> None:
    """Before anybody teaches anything; the manager judges by its own file once more."""
    _check_frame(operator, frame)
    if fixed := operator.settings.frames[frame].fixed:
        raise CommandError(
            f"frame {frame} does not move while the cell runs: in it is {', in it is '.join(fixed)}",
            f"end the cell, change {frame} in the cell file on each computer, start it again",
        )


def parsed_pose(text: str) -> PoseSettings:
    """`X,Y,Z,A,B,C` in mm and deg. Raises `CommandError`."""
    try:
        values = [float(part) for part in text.split(",")]
    except ValueError:
        values = []
    if len(values) != 6 or not all(math.isfinite(value) and abs(value) <= _FARTHEST_MM for value in values):
        raise CommandError(
            f"--pose {text[:80]!r} found, allowed are six numbers X,Y,Z,A,B,C in mm and deg: --pose 900,0,700,0,0,90"
        )
    return PoseSettings.of(from_xyz_abc(np.array([*np.array(values[:3]) / 1000.0, *np.radians(values[3:])])))


def allowed_by(points: list[Point]) -> str:
    """The frame of three or four points [m], and how well they give it, for people. Raises `CommandError`."""
    measured = np.array(points)
    try:
        pose, turn = taught_frame(measured), largest_turn(measured, _ERROR_M)
    except NoFrame as error:
        raise CommandError(f"these points give no frame: {error}", "nothing was changed; teach it again") from error
    along_mm = 1000.0 * float(np.linalg.norm(measured[1] - measured[0]))
    aside_mm = 1000.0 * float((measured[2] - measured[0]) @ pose[:3, 1])
    allows = "any turn: measure them farther apart"
    if turn < math.pi / 2.0:
        far_mm, off_mm = 2000.0 * math.sin(turn / 2.0), 1000.0 * largest_shift(measured, _ERROR_M)
        allows = (
            f"an origin up to {off_mm:.1f} mm off and a turn of up to {math.degrees(turn):.2f} deg, "
            f"{far_mm:.1f} mm at 1 m from it"
        )
    return (
        f"{_pose_text(pose)}; the points lie {along_mm:.1f} mm along X and {aside_mm:.1f} mm aside: "
        f"errors of {1000.0 * _ERROR_M:g} mm in each of them allow {allows}"
    )


class _Taken(NamedTuple):
    """Where the TCP stands [m, world], and of which tool it is; an empty name for the flange."""

    place: Point
    tool: str


def _confirmed(operator: Connection, robot: str, point: str) -> _Taken:
    """Where a robot stands once the operator says that it is at the point."""
    while True:
        typer.echo(f"Jog {robot} to point {point}; then press Enter (Ctrl-C breaks off)")
        if not sys.stdin.readline():
            raise CommandError("broken off: nothing was changed")
        try:
            taken = standing_at(operator, robot)
        except CommandError as error:
            typer.echo(f"not taken: {error.what}")
            continue
        x, y, z = (1000.0 * value for value in taken.place)
        typer.echo(f"  {x:.2f}, {y:.2f}, {z:.2f} mm{f', the TCP of {taken.tool}' if taken.tool else ''}")
        return taken


def standing_at(operator: Connection, robot: str) -> _Taken:
    """Where the robot's TCP stands.

    Raises `CommandError`: it moves, or nobody knows where it is or what it carries.
    """
    seen: list[_Taken] = []
    for _ in range(2):
        state = _next_state(operator, robot)
        if state.tcp_position_m is None:
            raise CommandError(f"{robot} does not know where it is: `cell drives` says why")
        if not at_rest(state):
            raise CommandError(f"{robot} moves")
        if state.tool is None:
            raise CommandError(f"nobody has said what {robot} carries: `cell tool {robot} NAME|none`")
        seen.append(_Taken(state.tcp_position_m, state.tool))
        time.sleep(_APART_S / 2.0)
    if math.dist(seen[0].place, seen[1].place) > _STILL_M or seen[0].tool != seen[1].tool:
        raise CommandError(f"{robot} moves")
    return seen[1]


def _next_state(operator: Connection, robot: str) -> RobotState:
    """A state that the robot sends after this is asked for."""
    operator.check_robot(robot)
    before = operator.view.look().robots.get(robot)
    old = None if before is None else (before.boot, before.sequence)

    def is_newer(state: RobotState | None) -> bool:
        return state is not None and (state.boot, state.sequence) != old

    state = operator.view.wait_for(lambda seen: is_newer(seen.robots.get(robot)), _ANSWER_S).robots.get(robot)
    if state is None or not is_newer(state):
        raise CommandError(f"robot {robot} does not answer")
    return state


def move_frame(operator: Connection, frame: str, command: Command) -> None:
    """Have the manager move it, and say from where on each robot's moves see it."""
    reply = operator.ask_manager(command)
    report("manager", reply)
    version, settings = int(reply.data), operator.settings
    moved = {name for name in settings.frames if frame in _above(operator, name)}
    told = operator.view.look().robots  # by these its program and its points lie in frames too
    users = {
        robot: moved.intersection(
            [thing.in_frame.frame for thing in each.things if thing.in_frame is not None],
        ).union(moved.intersection(told[robot].frames) if robot in told else ())
        for robot, each in settings.robots.items()
    }

    def taken(robot: str, state: RobotState | None) -> bool:
        return state is not None and all(state.frames.get(name, 0) >= version for name in users[robot])

    concerned = [robot for robot, frames in users.items() if frames]
    seen = operator.view.wait_for(lambda seen: all(taken(r, seen.robots.get(r)) for r in concerned), _TAKEN_S).robots
    for robot in concerned:
        state = seen.get(robot)
        if state is None or not taken(robot, state):
            look = f"cell status -f {quoted(operator.file)}"
            typer.echo(f"{robot}: has not said that it knows; once it is heard it plans with it ({look})")
        elif state.program.state in (ProgramState.RUNNING, ProgramState.INTERRUPTED) and state.program.planned_to:
            typer.echo(
                f"{robot}: motions that are planned already keep the old place, until it is through line "
                f"{state.program.planned_to} of {state.program.planned_in} next; "
                "what comes after is planned with the new one"
            )
        else:
            typer.echo(f"{robot}: its next motions are planned with it")


def _above(operator: Connection, frame: str | None) -> list[str]:
    """A frame and all that it lies in."""
    above = []
    while frame is not None:
        above.append(frame)
        frame = operator.settings.frames[frame].parent
    return above


def _pose_text(pose: np.ndarray) -> str:
    """A pose `(4, 4)` in mm and deg, for people."""
    values = to_xyz_abc(pose)
    lengths = [f"{key} {round(1000.0 * value, 2) + 0.0:.2f}" for key, value in zip("XYZ", values[:3], strict=True)]
    angles = [f"{key} {round(math.degrees(value), 4) + 0.0:.4f}" for key, value in zip("ABC", values[3:], strict=True)]
    return f"{' '.join(lengths)} mm, {' '.join(angles)} deg"
