"""What must hold within the part of a drives file that says how its drives are simulated."""

from collections.abc import Iterator
from math import pi, sqrt

from cell.config.document import Document
from cell.config.problem import KeyPath, Problem
from cell.config.reading import declared
from drive_gateway.config.drives_file import DrivesFile
from drive_gateway.config.simulation_entry import SimulatedAxisEntry
from drive_gateway.sim.axis.motor_data import MOTORS

HIGHEST_RESONANCE_HZ = 700.0
"""Of two masses: faster ones are wrong by more than 1 % in steps of the servo loop."""


def check_simulation(document: Document, drives: DrivesFile) -> list[Problem]:
    """All contradictions of the simulation with itself and with the axes of the file."""
    return [*_known(document, drives), *_complete(document, drives), *_voltages(document, drives)]


def _known(document: Document, drives: DrivesFile) -> Iterator[Problem]:
    for robot, entries in drives.simulation.axes.items():
        path: KeyPath = ("simulation", "axes", robot)
        if robot not in drives.robots:
            yield document.problem(path, repr(robot), f"a robot of this file: {', '.join(drives.robots)}")
            continue
        for name, entry in entries.items():
            if name not in drives.robots[robot].axes:
                allowed = f"an axis of {robot}: {', '.join(drives.robots[robot].axes)}"
                yield document.problem((*path, name), repr(name), allowed)
            elif entry.motor not in MOTORS:
                yield document.problem((*path, name, "motor"), repr(entry.motor), f"one of {', '.join(MOTORS)}")
            else:
                yield from _motor(document, drives, (*path, name), entry)


def _motor(document: Document, drives: DrivesFile, path: KeyPath, entry: SimulatedAxisEntry) -> Iterator[Problem]:
    """The voltage must be enough for the speed, the steps of the simulation small enough for the stiffness."""
    axis = drives.robots[str(path[-2])].axes[str(path[-1])]
    motor = MOTORS[entry.motor]
    fastest = drives.simulation.dc_bus.supply_v / (sqrt(3.0) * motor.emf * axis.gear) * axis.way_per_rad()
    if axis.speed > fastest:
        found = f"{motor.name}, which moves the axis with up to {declared(document, fastest, axis.linear):.0f}"
        speed = document.found(("robots", path[-2], "axes", path[-1], "speed"))
        yield document.problem((*path, "motor"), found, f"a motor that reaches the speed of this axis, {speed}")
    if axis.rated_torque_nm not in (None, motor.rated_torque_nm):
        found = f"{motor.name}, rated for {motor.rated_torque_nm:g} Nm"
        yield document.problem(
            (*path, "motor"), found, f"a motor with the rated_torque_nm of this axis, {axis.rated_torque_nm:g}"
        )
    if axis.linear and entry.stops is not None:
        yield document.problem((*path, "stops"), "stops", "none for a linear axis", at_key=True)
    elif entry.stops is not None and entry.stops[0] >= entry.stops[1]:
        yield document.problem((*path, "stops"), "the higher position first", "the lower one first")
    if entry.gravity is not None and drives.simulation.masses == "robot":
        allowed = "none with masses: robot, which are those of the robot's file"
        yield document.problem((*path, "gravity"), "a mass on an arm", allowed, at_key=True)
    elif axis.linear and entry.gravity is not None:
        allowed = "constant_nm for a linear axis: its weight times its feed over 2 pi"
        yield document.problem((*path, "gravity"), "a mass on an arm", allowed, at_key=True)
    if entry.stiffness_nm_rad is not None:
        inertia = motor.inertia_kg_m2 * axis.gear**2
        per_s2 = entry.stiffness_nm_rad * (1.0 / inertia + 1.0 / entry.inertia_kg_m2)
        resonance = sqrt(per_s2) / (2.0 * pi)
        if resonance > HIGHEST_RESONANCE_HZ:
            allowed = f"up to {HIGHEST_RESONANCE_HZ:g} Hz, or no stiffness: stiffer than that is one mass"
            yield document.problem((*path, "stiffness_nm_rad"), f"a resonance at {resonance:.0f} Hz", allowed)


def _complete(document: Document, drives: DrivesFile) -> Iterator[Problem]:
    if drives.simulation.level != "full":
        return
    for robot, entry in drives.robots.items():
        missing = [name for name in entry.axes if name not in drives.simulation.axes.get(robot, {})]
        if missing:
            allowed = f"motor and load of every axis; missing in simulation.axes: {robot}.{f', {robot}.'.join(missing)}"
            yield document.problem(("simulation", "level"), "full", allowed)


def _voltages(document: Document, drives: DrivesFile) -> Iterator[Problem]:
    bus = drives.simulation.dc_bus
    if not bus.low_v < bus.supply_v < bus.chopper_v < bus.high_v:
        found = f"{bus.low_v:g}, {bus.supply_v:g}, {bus.chopper_v:g}, {bus.high_v:g}"
        allowed = "low_v, supply_v, chopper_v, high_v each above the one before"
        yield document.problem(("simulation", "dc_bus"), found, allowed)
