"""`cell model`: a robot in numbers, as its file describes it."""

from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from rich.box import SIMPLE
from rich.console import Console
from rich.table import Table

from cell.commands.errors import CommandError, quoted
from cell.geometry import to_xyz_abc
from robot_agent.kinematics import BareUrdf, KinematicsError, Model, NotInUrdf, SerialModel, load_model
from robot_agent.model import Motor
from robot_agent.workspace import Itself


def model(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="A robot file, or a bare URDF.", show_default=False)],
) -> None:
    """Print a robot: its axes and their limits, motors, reach, home pose, branches and tools.

    Lengths are mm, angles deg. Of a bare URDF only its kinematics is known; the rest shows as "-".
    """
    try:
        robot = load_model(file)
    except KinematicsError as error:
        raise CommandError(str(error), f"correct {file}, then: cell model {quoted(file)}") from error
    console = Console()
    console.print(_axes(robot))
    if robot.description.motors:
        console.print(_motors(robot.description.motors))
    for name, text in _facts(robot):
        console.print(f"  [bold]{name:<12}[/bold] {text}", soft_wrap=True, highlight=False)


def _axes(robot: Model) -> Table:
    title = f"{robot.description.name}, family {robot.description.family}"
    headings = ("joint", "type", "from", "to", "speed /s", "acceleration /s2", "jerk /s3", "home", "coupled to")
    table = Table(*headings, title=title, title_justify="left", box=SIMPLE)
    scale = np.where(robot.linear, 1000.0, 180.0 / np.pi)
    columns = [robot.limits.position[:, 0], robot.limits.position[:, 1], robot.limits.velocity]
    columns += [_known(robot, what) for what in ("acceleration", "jerk", "home")]
    for i, name in enumerate(robot.joint_names):
        unit = "mm" if robot.linear[i] else "deg"
        numbers = [_number(column[i] * scale[i]) for column in columns]
        numbers[3] += _downwards(robot, i, scale[i])
        table.add_row(name, f"{'linear' if robot.linear[i] else 'rotary'} {unit}", *numbers, _coupled(robot, i))
    return table


def _downwards(robot: Model, joint: int, scale: float) -> str:
    """The acceleration towards lower values, where it is another one."""
    limits = robot.limits
    if limits.acceleration_down is None or limits.acceleration_down[joint] == limits.acceleration[joint]:
        return ""
    return f", down {_number(limits.acceleration_down[joint] * scale)}"


def _motors(motors: dict[str, Motor]) -> Table:
    title = "motors: rated/maximum speed, rated/peak torque, peak current (rms); what that gives the axis at most"
    table = Table(title=title, title_justify="left", box=SIMPLE, padding=(0, 1, 0, 0))
    for heading in ("axis", "motor", "gear", "1/min", "Nm", "A", "pole pairs", "kg cm2", "axis speed", "axis torque"):
        table.add_column(heading, overflow="fold")
    for axis, motor in motors.items():
        gear, speed, torque = f"{motor.gear:g}", f"{np.degrees(motor.fastest):.0f} deg/s", "Nm"
        if motor.feed_m is not None:
            gear += f", {1000 * motor.feed_m:g} mm"
            speed, torque = f"{1000 * motor.fastest:.0f} mm/s", "N"
        table.add_row(
            axis,
            motor.type,
            gear,
            f"{motor.rated_speed_rpm:g}/{motor.maximum_speed_rpm:g}",
            f"{motor.rated_torque_nm:g}/{motor.peak_torque_nm:g}",
            f"{motor.peak_current_a:.1f}",
            f"{motor.pole_pairs}",
            f"{10_000 * motor.inertia_kg_m2:g}",
            speed,
            f"{motor.peak_torque_nm * motor.ratio:.0f} {torque}",
        )
    return table


def _known(robot: Model, what: str) -> np.ndarray:
    """A value per joint; NaN where the robot's file does not say it."""
    try:
        return np.asarray(robot.home if what == "home" else getattr(robot.limits, what))
    except NotInUrdf:
        return np.full(robot.n, np.nan)


def _coupled(robot: Model, joint: int) -> str:
    ratios = robot.coupling.joints_per_axis[joint]
    return ", ".join(f"{ratios[i]:+g} {robot.joint_names[i]}" for i in range(joint) if ratios[i] != 0)


def _facts(robot: Model) -> list[tuple[str, str]]:
    farther = "nothing of it is ever" if robot.body else "its TCP is never"
    facts = [("reach", f"{1000 * robot.reach_m:.0f} mm: {farther} farther from the base")]
    home = _known(robot, "home")
    if not np.isnan(home).any():
        tcp = to_xyz_abc(robot.forward(home)) * [1000, 1000, 1000, *[180 / np.pi] * 3]
        near = robot.singularity(home)
        facts.append(("home", " ".join(f"{name} {value:.1f}" for name, value in zip("XYZABC", tcp, strict=True))))
        facts.append(("", f"{float(near.nearest):.2f} away from singular ({near.name}); 0 is singular, 1 the farthest"))
        facts.append(("body", f"{len(robot.body)} capsules on the links {', '.join(robot.link_names)}"))
    complete = "all solutions, in closed form" if robot.closed_form else "numeric: up to so many, nearest first"
    facts.append(("branches", f"{', '.join(robot.branches)} ({complete})"))
    sources: dict[str, list[str]] = {}
    for axis, motor in robot.description.motors.items():
        sources.setdefault(motor.source, []).append(axis)
    facts += _apart(robot)
    facts += [("motors", f"{', '.join(axes)}: {source}") for source, axes in sources.items()]
    if masses := _masses(robot):
        facts.append(("masses", masses))
    for name, tool in robot.description.tools.items():
        tcp = to_xyz_abc(tool.pose_flange_tcp) * [1000, 1000, 1000, *[180 / np.pi] * 3]
        pose = " ".join(f"{letter} {value:.1f}" for letter, value in zip("XYZABC", tcp, strict=True))
        mounted = ", mounted" if name in robot.description.mounted.tools else ""
        facts.append(("tool", f"{name}: TCP {pose}, {tool.mass_kg:g} kg{mounted}"))
    facts += [("part", f"{part.name}: {part.mass_kg:g} kg") for part in robot.description.parts.values()]
    return facts


def _apart(robot: Model) -> list[tuple[str, str]]:
    """Which of its links keep away from which, by the outer one."""
    if isinstance(robot, BareUrdf):
        return []
    itself = Itself(robot)
    from_: dict[str, list[str]] = {}
    for inner, outer in itself.parts():
        from_.setdefault(outer, []).append(inner)
    told = "; ".join(f"{outer} from {', '.join(inner)}" for outer, inner in from_.items()) or "nothing"
    return [("apart", f"{told} (margin {_number(1000.0 * itself.margin_m)} mm)")]


def _masses(robot: Model) -> str:
    """What its links weigh together, and who says so."""
    masses = robot.masses if isinstance(robot, SerialModel) else ()
    if not masses:
        return ""
    sources = "; ".join(dict.fromkeys(mass.source for mass in masses))
    total_kg = sum(mass.mass_kg for mass in masses)
    return f"{total_kg:g} kg on links {', '.join(robot.link_names[mass.link] for mass in masses)}: {sources}"


def _number(value: float) -> str:
    return "-" if np.isnan(value) else f"{round(value, 2):.10g}"
