"""What robots, their models and their drives say about each other."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np

from cell.commands.checks.readings import Readings
from cell.config.document import Document
from cell.config.problem import KeyPath, Problem
from cell.config.reading import declared
from drive_gateway.config.axis_entry import AxisEntry
from drive_gateway.config.drives_file import DrivesFile
from drive_gateway.sim.config.simulation import Simulation
from drive_gateway.sim.config.simulation_file import SimulationFile
from robot_agent.model.axis_needs import AxisNeed, axis_needs
from robot_agent.model.description import Motor
from robot_agent.model.robot_file import RobotFile

MARGIN = 1.05
"""How far a drive's limits lie above its joint's, so that rounding never makes a gateway refuse a block."""


def check_drives(readings: Readings) -> Iterator[Problem]:
    """Each robot is driven by its gateway and no other, axis by axis within what its drives can do."""
    for robot, entry in readings.cell.robots.items():
        reading = readings.named.drives.get(entry.gateway)
        if reading is None or reading.document is None or reading.content is None:
            continue
        driven = reading.document.keys(("robots",))
        if robot not in driven:
            found = f"{entry.gateway!r}, which drives {', '.join(driven)}"
            yield readings.document.problem(("robots", robot, "gateway"), found, f"the gateway that drives {robot}")
    for gateway, document, drives in readings.named.usable_drives():
        for robot in drives.robots:
            yield from _owner(readings, gateway, document, robot)
    models = {robot: model for robot, _, model in readings.named.usable_models()}
    for gateway, document, drives in readings.named.usable_drives():
        for robot in readings.robots_of(gateway):
            if robot in drives.robots and robot in models:
                yield from _robot(document, robot, drives.robots[robot].axes, models[robot])
        simulation = readings.named.simulations[gateway]
        if simulation.document is not None and simulation.content is not None:
            yield from _simulation(simulation.document, simulation.content, drives, models)


def at_home(simulation: Simulation, models: Mapping[str, RobotFile]) -> Simulation:
    """With axes of which it says nothing at the home positions of their robots."""
    homes = {(robot, name): need.home for robot, model in models.items() for name, need in axis_needs(model).items()}
    return replace(simulation, starts={**homes, **simulation.starts})


def _owner(readings: Readings, gateway: str, document: Document, robot: str) -> Iterator[Problem]:
    own = readings.robots_of(gateway)
    if robot in own:
        return
    known = robot in readings.document.keys(("robots",))
    entry = readings.cell.robots.get(robot)
    if known and entry is None:
        return
    found = f"robot {robot!r}, which the cell gives to gateway {entry.gateway}" if entry else f"unknown robot {robot!r}"
    allowed = f"robots of gateway {gateway}: {', '.join(own) or 'none'}"
    yield document.problem(("robots", robot), found, allowed, at_key=True)


def _robot(document: Document, robot: str, axes: dict[str, AxisEntry], model: RobotFile) -> Iterator[Problem]:
    path: KeyPath = ("robots", robot, "axes")
    names, joints = document.keys(path), list(model.joints)
    if names != joints:
        found = f"the axes {', '.join(names)}"
        yield document.problem(path, found, f"the joints of {model.name}, in order: {', '.join(joints)}", at_key=True)
    needs = axis_needs(model)
    for name in joints:
        if name in axes and name in needs:
            yield from _axis(document, (*path, name), axes[name], needs[name])
        if name in axes and axes[name].feed_forward == "torque" and not (model.motors or model.masses):
            allowed = (
                f"velocity or none: the file of {model.name} has neither masses nor motors, so nobody knows its torques"
            )
            yield document.problem((*path, name, "feed_forward"), "torque", allowed)
        if name in axes and name in model.motors:
            yield from _motor(document, (*path, name), axes[name], model.motors[name].motor(), model.name)


def _simulation(
    document: Document, file: SimulationFile, drives: DrivesFile, models: Mapping[str, RobotFile]
) -> Iterator[Problem]:
    """Simulated axes stand where their joints can be, and carry masses only of a robot whose file has some."""
    for (robot, name), place in file.places(drives).items():
        need = axis_needs(models[robot]).get(name) if robot in models else None
        if need is not None and not need.position[0] <= place <= need.position[1]:
            low, high = (f"{declared(document, limit, need.linear):g}" for limit in need.position)
            path = ("starts", robot, name)
            yield document.problem(path, document.found(path), f"{low} to {high}, the limits of {name}")
    for robot in drives.robots:
        model = models.get(robot)
        if file.masses == "robot" and model is not None and not model.masses and model.urdf() is None:
            allowed = f"axes: the file of {model.name}, robot {robot}, says nothing of masses"
            yield document.problem(("masses",), "robot", allowed)


def _axis(document: Document, path: KeyPath, axis: AxisEntry, need: AxisNeed) -> Iterator[Problem]:
    name, linear = path[-1], axis.linear
    if linear != need.linear:
        yield document.problem((*path, "type"), axis.type, f"{'linear' if need.linear else 'rotary'}, as joint {name}")
        return
    # A tolerance of the last digits: 1.05 times 110 deg/s is not exactly 115.5 in binary.
    if axis.speed < MARGIN * need.speed * (1 - 1e-9):
        least = declared(document, MARGIN * need.speed, linear)
        allowed = f"{least:g} or more, {MARGIN:g} times the speed of {name}"
        yield document.problem((*path, "speed"), document.found((*path, "speed")), allowed)
    if axis.acceleration < MARGIN * need.ramp * (1 - 1e-9):
        least = declared(document, MARGIN * need.ramp, linear)
        allowed = f"{least:g} or more, {MARGIN:g} times the ramp of {name} (ramp_factor times its acceleration)"
        yield document.problem((*path, "acceleration"), document.found((*path, "acceleration")), allowed)
    low, high = (f"{declared(document, limit, linear):g}" for limit in need.position)
    if axis.limits is not None and not axis.limits[0] <= need.position[0] < need.position[1] <= axis.limits[1]:
        found = " to ".join(f"{declared(document, limit, linear):g}" for limit in axis.limits)
        yield document.problem((*path, "limits"), found, f"a range that holds {low} to {high}, the limits of {name}")
    yield from _counter(document, path, axis, need)


def _motor(document: Document, path: KeyPath, axis: AxisEntry, motor: Motor, model: str) -> Iterator[Problem]:
    """The drive counts through the gear that the robot has, and takes no set points that its motor cannot follow."""
    whose = f"that of the motor of {path[-1]} in the file of {model}"
    if not math.isclose(axis.gear, motor.gear, rel_tol=1e-9):
        yield document.problem((*path, "gear"), document.found((*path, "gear")), f"{motor.gear:g}, {whose}")
    if axis.linear != (motor.feed_m is not None):
        return
    if axis.feed is not None and motor.feed_m is not None and not math.isclose(axis.feed, motor.feed_m, rel_tol=1e-9):
        feed = declared(document, motor.feed_m, linear=True)
        yield document.problem((*path, "feed"), document.found((*path, "feed")), f"{feed:g}, {whose}")
    if axis.rated_torque_nm is not None and not math.isclose(axis.rated_torque_nm, motor.rated_torque_nm, rel_tol=1e-9):
        found = document.found((*path, "rated_torque_nm"))
        yield document.problem((*path, "rated_torque_nm"), found, f"{motor.rated_torque_nm:g}, {whose}")
    if axis.speed > motor.fastest:
        most = declared(document, motor.fastest, axis.linear)
        allowed = f"{most:.4g} or less: its motor makes {motor.maximum_speed_rpm:g} turns per minute"
        yield document.problem((*path, "speed"), document.found((*path, "speed")), allowed)


def _counter(document: Document, path: KeyPath, axis: AxisEntry, need: AxisNeed) -> Iterator[Problem]:
    """The drive's 32-bit position must not wrap within the axis' limits, following error included."""
    lowest, highest = axis.settings(str(path[-1])).int32_range
    low, high = np.array(need.position) + np.array([-1, 1]) * axis.following_window
    if lowest <= low and high <= highest:
        return
    fits = " to ".join(f"{declared(document, bound, axis.linear):g}" for bound in (lowest, highest))
    needed = " to ".join(f"{declared(document, bound, axis.linear):g}" for bound in (low, high))
    found = f"{axis.gear:g} times {axis.counts_per_turn} counts per turn: 32 bits reach from {fits}"
    allowed = f"a counter that reaches from {needed}, the limits of {path[-1]} and its following error"
    yield document.problem((*path, "gear"), found, allowed)
