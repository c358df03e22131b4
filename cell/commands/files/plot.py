"""`cell plot`: what one program does with one robot, as a page of curves."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import numpy as np
import typer

from cell.commands.checks.edges import stop_reasons
from cell.commands.errors import CommandError, not_installed
from cell.commands.files.plot_text import moves, stops, transitions
from cell.config.document import read_text
from cell.config.points_file import PointsOwner, PointsSettings, load_points
from cell.config.problem import ConfigError, Problem
from cell.geometry.arrays import Array
from robot_agent.agent.planning.dry_run import dry_run
from robot_agent.agent.planning.planner import Planner
from robot_agent.agent.planning.plans import Planned
from robot_agent.kinematics import Model, load_model
from robot_agent.language import Names, Points, ProgramError, parse_program
from robot_agent.paths import Passing
from robot_agent.trajectory import move_lengths
from robot_agent.workspace import PlacedRobot

if TYPE_CHECKING:
    from cell.commands.pages.page import ProgramLine

_CYCLE_S = 0.004


def plot(
    program: Annotated[Path, typer.Argument(metavar="PROGRAM", help="The program.", show_default=False)],
    model: Annotated[Path, typer.Option("--model", metavar="FILE", help="The robot file.", show_default=False)],
    output: Annotated[Path, typer.Option("-o", "--output", metavar="FILE", help="The page to write.")] = Path(
        "plot.html"
    ),
    taught: Annotated[
        Path | None, typer.Option("--points", metavar="FILE", help="The points file of the robot.", show_default=False)
    ] = None,
    longest_s: Annotated[float, typer.Option("--longest", help="Cut off endless programs [s].", min=0.1)] = 120.0,
) -> None:
    """Plan a program from the robot's home and draw it: path, speed, and joint speeds against their limits.

    A click on a line of the program marks it in all curves. After them stand how far each move goes, and where moves
    meet: whether the robot stops there, and why.

    Pauses and what TRACK follows are left out, and nothing of a cell is needed: no zones, no gateway. Exits with 1
    where a move cannot be planned; the page then shows the motion up to there.
    """
    robot = load_model(model)
    planner = Planner(PlacedRobot.at(robot), _CYCLE_S)
    text = read_text(program)
    if isinstance(text, Problem):
        raise CommandError(f"the program cannot be read\n{text}", "name a program file")
    described = robot.description
    owner = PointsOwner(robot.joint_names, robot.linear_names, None, tuple(described.tools), robot.branches)
    try:
        told = load_points(taught, owner) if taught is not None else PointsSettings()
        names = Names(
            robot.joint_names,
            linear=robot.linear_names,
            tools=described.tools,
            parts=described.parts,
            points=Points(told.points),
            cam=told.cam,
        )
        parsed = parse_program(text, str(program), names, program.parent)
    except ConfigError as error:
        raise CommandError(str(error), "correct the points file; docs/points_file.md") from error
    except ProgramError as error:
        raise CommandError(f"the program is refused\n{error}", "correct it; docs/language.md") from error
    motions, failed = dry_run(planner, parsed, longest_s)
    motions = [planned for planned in motions if planned.motion.duration_s > 0.0]
    if motions:
        _write(output, program.name, text, robot, motions, stop_reasons(parsed))
        duration_s = sum(each.motion.duration_s for each in motions)
        typer.echo(f"{output}: {duration_s:.2f} s in {len(motions)} motions, {stops(motions)} stops inside them")
    if failed is not None:
        raise CommandError(f"{program}: {failed.text}", "correct that line; what comes before it is drawn")
    if not motions:
        raise CommandError(f"{program} moves nothing", "name a program with a move")


def _write(
    output: Path, name: str, text: str, model: Model, motions: list[Planned], reasons: Mapping[tuple[int, int], str]
) -> None:
    """Write the page; where what draws it is not installed, print its numbers and say so."""
    starts = np.append(0.0, np.cumsum([planned.motion.duration_s for planned in motions]))
    grids = [planned.motion.grid for planned in motions]
    t = np.concatenate([start + grid for start, grid in zip(starts, grids, strict=False)])
    pairs = list(zip(motions, grids, strict=True))
    share = 100.0 * np.concatenate([planned.motion.qd(grid) for planned, grid in pairs]) / model.limits.velocity
    speed = 1000.0 * np.concatenate([planned.motion.tcp_speed(grid) for planned, grid in pairs])
    summary = _summary(motions, float(starts[-1]), speed, share)
    lists = {"Moves": moves(motions), "Where moves meet": transitions(motions, reasons)}
    try:
        from cell.commands.pages.page import Chart, Way, page, write_page
    except ImportError as error:
        for line in (*summary, *(f"{title}: {line}" for title, lines in lists.items() for line in lines)):
            typer.echo(line)
        raise not_installed("the page of cell plot", "view", error) from error
    place = 1000.0 * np.concatenate([planned.motion.pose(grid)[:, :3, 3] for planned, grid in pairs])
    ends = tuple(starts.tolist())
    joints = [(joint, t, share[:, k]) for k, joint in enumerate(model.joint_names)]
    charts: list[Way | Chart] = [
        Way("Path of the TCP", t, place),
        Chart("Speed of the TCP", "s", "mm/s", [("TCP", t, speed)], ends, over_time=True),
        Chart("Joint speeds in percent of their limits", "s", "%", joints, ends, (-100.0, 100.0), over_time=True),
    ]
    write_page(output, page(name, summary, [each.figure() for each in charts], lists, _program(text, motions)))


def _summary(motions: list[Planned], duration_s: float, speed: Array, share: Array) -> list[str]:
    blends = [
        each.deviation_m
        for planned in motions
        for each in planned.motion.transitions
        if each.passing is Passing.BLENDED
    ]
    covered = sum(move_lengths(planned.motion).sum(axis=0) for planned in motions) * [1000.0, *np.degrees([1.0, 1.0])]
    filtered = [planned.motion.filter_deviation_m for planned in motions]
    return [
        f"{duration_s:.3f} s in {len(motions)} motions, pauses left out; vertical lines are where a motion ends",
        f"largest TCP speed {speed.max():.1f} mm/s, largest joint speed {np.abs(share).max():.1f} % of its limit",
        "way of the TCP {:.1f} mm, its rotation {:.1f} deg, way of the joints {:.1f} deg".format(*covered),
        f"largest deviation where moves are blended {1e6 * max(blends, default=0.0):.0f} um",
        f"largest deviation by the filter on the axes {1e6 * max(filtered):.0f} um",
    ]


def _program(text: str, motions: list[Planned]) -> list["ProgramLine"]:
    """The lines of the program's own file, each with the times at which it moves."""
    from cell.commands.pages.page import ProgramLine

    times: dict[int, list[tuple[float, float]]] = {}
    start = 0.0
    for planned in motions:
        ends = planned.motion.ends.tolist()
        for line, begin, end in zip(planned.lines, [0.0, *ends], ends, strict=False):
            times.setdefault(line, []).append((round(start + begin, 4), round(start + end, 4)))
        start += planned.motion.duration_s
    return [ProgramLine(line, tuple(times.get(number, ()))) for number, line in enumerate(text.splitlines(), 1)]
