"""What must hold within a robot file beyond its schema."""

import math
from collections.abc import Iterator

from cell.config.document import Document
from cell.config.problem import KeyPath, Problem
from robot_agent.model.description import Family
from robot_agent.model.robot_file import RobotFile

JOINTS = {Family.SIX_AXIS: ("J1", "J2", "J3", "J4", "J5", "J6")}
"""The joints of each family, from the base on."""


def check_robot_file(document: Document, robot: RobotFile) -> list[Problem]:
    """All contradictions inside the robot file."""
    return [
        *_complete(document, ("joints",), JOINTS[robot.family]),
        *_complete(document, ("home",), tuple(document.keys(("joints",)))),
        *_geometry(document, robot),
        *_limits(document, robot),
        *_home(document, robot),
        *_capsules(document, robot),
    ]


def _complete(document: Document, path: KeyPath, expected: tuple[str, ...]) -> Iterator[Problem]:
    """The mapping at `path` must have exactly the keys `expected`, in this order."""
    keys = document.keys(path)
    if sorted(keys) != sorted(expected):
        yield document.problem(path, ", ".join(keys) or "nothing", f"each of {', '.join(expected)}", at_key=True)
    elif path == ("joints",) and tuple(keys) != expected:
        yield document.problem(path, f"the order {', '.join(keys)}", f"the order {', '.join(expected)}", at_key=True)


def _geometry(document: Document, robot: RobotFile) -> Iterator[Problem]:
    lengths = robot.geometry
    if math.hypot(lengths.a4z, lengths.a4x + lengths.a5x) == 0:
        yield document.problem(("geometry",), "a forearm of length 0", "a4x + a5x or a4z other than 0", at_key=True)


def _limits(document: Document, robot: RobotFile) -> Iterator[Problem]:
    for name, joint in robot.joints.items():
        if joint.position[0] >= joint.position[1]:
            path = ("joints", name, "position")
            yield document.problem(path, range_text(document, path), "a lower limit below the upper one")


def _home(document: Document, robot: RobotFile) -> Iterator[Problem]:
    for name, value in robot.home.items():
        joint = robot.joints.get(name)
        if joint is None or joint.position[0] >= joint.position[1]:
            continue
        if not joint.position[0] <= value <= joint.position[1]:
            limits = range_text(document, ("joints", name, "position"))
            yield document.problem(("home", name), document.found(("home", name)), f"{limits}, the limits of {name}")


def _capsules(document: Document, robot: RobotFile) -> Iterator[Problem]:
    last = len(JOINTS[robot.family])
    for index, capsule in enumerate(robot.capsules):
        if capsule.link > last:
            yield document.problem(("capsules", index, "link"), f"{capsule.link}", f"0 (base) to {last} (flange)")


def range_text(document: Document, path: KeyPath) -> str:
    """A pair of limits as the file says it."""
    return f"{document.found((*path, 0))} to {document.found((*path, 1))}"
