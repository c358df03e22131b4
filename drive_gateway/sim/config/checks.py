"""What must hold within a simulation file, and between it and its drives file."""

from collections.abc import Iterator, Mapping
from math import pi, sqrt

from cell.config.document import Document
from cell.config.problem import KeyPath, Problem
from cell.config.reading import declared
from drive_gateway.config.axis_entry import AxisEntry
from drive_gateway.config.drives_file import DrivesFile
from drive_gateway.sim.axis.motor_data import MOTORS
from drive_gateway.sim.config.simulation_file import SimulatedAxisEntry, SimulationFile

HIGHEST_RESONANCE_HZ = 700.0
"""Of two masses: faster ones are wrong by more than 1 % in steps of the servo loop."""


def check_simulation(document: Document, file: SimulationFile, drives: DrivesFile) -> list[Problem]:
    """All contradictions of the simulation with itself and with the axes of its drives file."""
    return [
        *_lag(document, file, drives),
        *_known(document, ("starts",), file.starts, drives),
        *_known(document, ("axes",), file.axes, drives),
        *_axes(document, file, drives),
        *_complete(document, file, drives),
        *_voltages(document, file),
    ]


def _lag(document: Document, file: SimulationFile, drives: DrivesFile) -> Iterator[Problem]:
    """At its full speed an axis is behind its set points by the lag: a following error that its drive may have."""
    if file.lag_s is None:
        return
    times = {
        f"{robot}.{name}": axis.following_window / axis.speed
        for robot, entry in drives.robots.items()
        for name, axis in entry.axes.items()
    }
    tightest = min(times, key=times.__getitem__, default="")
    if tightest and file.lag_s >= times[tightest]:
        allowed = f"less than {times[tightest]:.4g}: the following_window of {tightest} over its speed"
        yield document.problem(("lag_s",), f"{file.lag_s:g}", allowed)


def _known(
    document: Document, path: KeyPath, robots: Mapping[str, Mapping[str, object]], drives: DrivesFile
) -> Iterator[Problem]:
    """Robots and axes are those of the drives file."""
    for robot, axes in robots.items():
        if robot not in drives.robots:
            allowed = f"a robot of the drives file: {', '.join(drives.robots)}"
            yield document.problem((*path, robot), repr(robot), allowed, at_key=True)
            continue
        for name in axes:
            if name not in drives.robots[robot].axes:
                allowed = f"an axis of {robot}: {', '.join(drives.robots[robot].axes)}"
                yield document.problem((*path, robot, name), repr(name), allowed, at_key=True)


def _axes(document: Document, file: SimulationFile, drives: DrivesFile) -> Iterator[Problem]:
    for robot, entries in file.axes.items():
        axes = drives.robots[robot].axes if robot in drives.robots else {}
        for name, entry in entries.items():
            path: KeyPath = ("axes", robot, name)
            if name in axes and entry.motor not in MOTORS:
                yield document.problem((*path, "motor"), repr(entry.motor), f"one of {', '.join(MOTORS)}")
            elif name in axes:
                yield from _motor(document, file, path, entry, axes[name])
                yield from _load(document, file, path, entry, axes[name])


def _motor(
    document: Document, file: SimulationFile, path: KeyPath, entry: SimulatedAxisEntry, axis: AxisEntry
) -> Iterator[Problem]:
    """The voltage must be enough for the speed, the steps of the simulation small enough for the stiffness."""
    motor = MOTORS[entry.motor]
    fastest = file.dc_bus.supply_v / (sqrt(3.0) * motor.emf * axis.gear) * axis.way_per_rad()
    if axis.speed > fastest:
        reached, speed = (declared(document, value, axis.linear) for value in (fastest, axis.speed))
        found = f"{motor.name}, which moves the axis with up to {reached:.0f}"
        yield document.problem((*path, "motor"), found, f"a motor that reaches the speed of this axis, {speed:g}")
    if axis.rated_torque_nm not in (None, motor.rated_torque_nm):
        found = f"{motor.name}, rated for {motor.rated_torque_nm:g} Nm"
        allowed = f"a motor with the rated_torque_nm of this axis, {axis.rated_torque_nm:g}"
        yield document.problem((*path, "motor"), found, allowed)
    if entry.stiffness_nm_rad is not None:
        inertia = motor.inertia_kg_m2 * axis.gear**2
        per_s2 = entry.stiffness_nm_rad * (1.0 / inertia + 1.0 / entry.inertia_kg_m2)
        resonance = sqrt(per_s2) / (2.0 * pi)
        if resonance > HIGHEST_RESONANCE_HZ:
            allowed = f"up to {HIGHEST_RESONANCE_HZ:g} Hz, or no stiffness: stiffer than that is one mass"
            yield document.problem((*path, "stiffness_nm_rad"), f"a resonance at {resonance:.0f} Hz", allowed)


def _load(
    document: Document, file: SimulationFile, path: KeyPath, entry: SimulatedAxisEntry, axis: AxisEntry
) -> Iterator[Problem]:
    if axis.linear and entry.stops is not None:
        yield document.problem((*path, "stops"), "stops", "none for a linear axis", at_key=True)
    elif entry.stops is not None and entry.stops[0] >= entry.stops[1]:
        yield document.problem((*path, "stops"), "the higher position first", "the lower one first")
    if entry.gravity is not None and file.masses == "robot":
        allowed = "none with masses: robot, which are those of the robot's file"
        yield document.problem((*path, "gravity"), "a mass on an arm", allowed, at_key=True)
    elif axis.linear and entry.gravity is not None:
        allowed = "constant_nm for a linear axis: its weight times its feed over 2 pi"
        yield document.problem((*path, "gravity"), "a mass on an arm", allowed, at_key=True)


def _complete(document: Document, file: SimulationFile, drives: DrivesFile) -> Iterator[Problem]:
    if file.level != "full":
        return
    for robot, entry in drives.robots.items():
        missing = [name for name in entry.axes if name not in file.axes.get(robot, {})]
        if missing:
            allowed = f"motor and load of every axis; missing in axes: {robot}.{f', {robot}.'.join(missing)}"
            yield document.problem(("level",), "full", allowed)


def _voltages(document: Document, file: SimulationFile) -> Iterator[Problem]:
    bus = file.dc_bus
    if not bus.low_v < bus.supply_v < bus.chopper_v < bus.high_v:
        found = f"{bus.low_v:g}, {bus.supply_v:g}, {bus.chopper_v:g}, {bus.high_v:g}"
        allowed = "low_v, supply_v, chopper_v, high_v each above the one before"
        yield document.problem(("dc_bus",), found, allowed)
