"""What must hold between the motors of a robot file and its joints."""

from collections.abc import Iterator

from cell.config.document import Document
from cell.config.problem import KeyPath, Problem
from cell.config.reading import declared
from robot_agent.model.axis_needs import AxisNeed, axis_needs
from robot_agent.model.description import Motor
from robot_agent.model.motor_file import MotorEntry
from robot_agent.model.robot_file import RobotFile


def check_motors(document: Document, robot: RobotFile) -> Iterator[Problem]:
    """Motors that contradict themselves, or that cannot move their axes as the joints' limits say."""
    needs = axis_needs(robot)
    for axis, entry in robot.motors.items():
        path: KeyPath = ("motors", axis)
        yield from _itself(document, path, entry)
        if axis not in needs:
            continue
        if (entry.feed is not None) != needs[axis].linear:
            found = "a feed" if entry.feed is not None else "no feed"
            allowed = "a feed for a linear axis, none for a rotary one"
            yield document.problem((*path, "feed") if entry.feed is not None else path, found, allowed, at_key=True)
        else:
            yield from _axis(document, path, entry.motor(), needs[axis])


def _itself(document: Document, path: KeyPath, entry: MotorEntry) -> Iterator[Problem]:
    if entry.peak_torque_nm < entry.rated_torque_nm:
        allowed = f"{entry.rated_torque_nm:g} or more, the rated torque"
        yield document.problem((*path, "peak_torque_nm"), f"{entry.peak_torque_nm:g}", allowed)
    if entry.maximum_speed_rpm < entry.rated_speed_rpm:
        allowed = f"{entry.rated_speed_rpm:g} or more, the rated speed"
        yield document.problem((*path, "maximum_speed_rpm"), f"{entry.maximum_speed_rpm:g}", allowed)


def _axis(document: Document, path: KeyPath, motor: Motor, need: AxisNeed) -> Iterator[Problem]:
    axis, length, angle = str(path[-1]), document.value(("units", "length")), document.value(("units", "angle"))
    unit = length if need.linear else angle
    rpm = motor.rpm(need.speed)
    if motor.maximum_speed_rpm < rpm:
        speed = f"{declared(document, need.speed, need.linear):g} {unit}/s"
        allowed = f"{rpm:.0f} or more, for axis {axis} at {speed} through gear {motor.gear:g}"
        yield document.problem((*path, "maximum_speed_rpm"), f"{motor.maximum_speed_rpm:g}", allowed)
    torque = motor.rotor_torque_nm(need.ramp)
    if motor.peak_torque_nm < torque:
        ramp = f"{declared(document, need.ramp, need.linear):g} {unit}/s2"
        allowed = f"{torque:.3g} or more, for its rotor alone in a ramp of axis {axis} with {ramp}"
        yield document.problem((*path, "peak_torque_nm"), f"{motor.peak_torque_nm:g}", allowed)
