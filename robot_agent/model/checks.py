"""What must hold within a robot file beyond its schema."""

from collections.abc import Iterator

from cell.config.document import Document
from cell.config.problem import KeyPath, Problem
from robot_agent.model.description import NO_TOOL, TOOL
from robot_agent.model.families import FAMILIES
from robot_agent.model.mass_checks import check_masses
from robot_agent.model.motor_checks import check_motors
from robot_agent.model.robot_file import RobotFile

_TELLS_NO_TOOL = (NO_TOOL.upper(), "T0")


def check_robot_file(document: Document, robot: RobotFile) -> list[Problem]:
    """All contradictions inside the robot file."""
    return [
        *_joints(document, robot),
        *_complete(document, ("home",), tuple(document.keys(("joints",)))),
        *FAMILIES[robot.family].check(document, robot),
        *_coupling(document, robot),
        *_limits(document, robot),
        *_home(document, robot),
        *_capsules(document, robot),
        *_self_collision(document, robot),
        *_motors(document, robot),
        *check_masses(document, robot),
        *_tool(document, robot),
        *_parts(document, robot),
    ]


def expected_joints(document: Document, robot: RobotFile) -> tuple[str, ...]:
    """The names that the joints of this robot should have, whatever the file says."""
    count, shape = len(document.keys(("joints",))), FAMILIES[robot.family].shape
    if shape is None:
        return tuple(f"J{i + 1}" for i in range(count))
    return shape.joint_names(count if shape.fewest <= count <= len(shape.linear) else None)


def _joints(document: Document, robot: RobotFile) -> Iterator[Problem]:
    expected = expected_joints(document, robot)
    yield from _complete(document, ("joints",), expected)
    shape = FAMILIES[robot.family].shape
    if shape is None:
        return
    for name, linear in zip(expected, shape.linear, strict=False):
        joint = robot.joints.get(name)
        if joint is not None and joint.linear != linear:
            path = ("joints", name, "type")
            allowed = f"{'linear' if linear else 'rotary'}, as in every robot of family {robot.family}"
            yield document.problem(path, joint.type, allowed)


def _complete(document: Document, path: KeyPath, expected: tuple[str, ...]) -> Iterator[Problem]:
    """The mapping at `path` must have exactly the keys `expected`, in this order."""
    keys = document.keys(path)
    if sorted(keys) != sorted(expected):
        yield document.problem(path, ", ".join(keys) or "nothing", f"each of {', '.join(expected)}", at_key=True)
    elif path == ("joints",) and tuple(keys) != expected:
        yield document.problem(path, f"the order {', '.join(keys)}", f"the order {', '.join(expected)}", at_key=True)


def _coupling(document: Document, robot: RobotFile) -> Iterator[Problem]:
    names = document.keys(("joints",))
    for joint, sources in robot.coupling.items():
        before = names[: names.index(joint)] if joint in names else []
        for source in sources:
            if source not in before:
                found = f"joint {joint}, coupled to axis {source}"
                allowed = f"one of the axes before it: {', '.join(before) or 'none'}"
                yield document.problem(("coupling", joint, source), found, allowed, at_key=True)


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
    shape = FAMILIES[robot.family].shape
    if shape is None:
        return
    last = len(shape.links) - 1
    for index, capsule in enumerate(robot.capsules):
        if capsule.link > last:
            yield document.problem(("capsules", index, "link"), f"{capsule.link}", f"0 (base) to {last} (flange)")


def _self_collision(document: Document, robot: RobotFile) -> Iterator[Problem]:
    shape = FAMILIES[robot.family].shape
    if shape is None:
        return
    allowed = (*shape.links, TOOL, *robot.parts)
    for index, pair in enumerate(robot.self_collision.may_touch):
        for place, name in enumerate(pair):
            if str(name) not in allowed:
                path = ("self_collision", "may_touch", index, place)
                yield document.problem(path, document.found(path), f"one of {', '.join(allowed)}")


def _motors(document: Document, robot: RobotFile) -> Iterator[Problem]:
    if "motors" in document.keys(()):
        yield from _complete(document, ("motors",), tuple(document.keys(("joints",))))
        yield from check_motors(document, robot)


def _tool(document: Document, robot: RobotFile) -> Iterator[Problem]:
    for name in robot.tools:
        if name.upper() in _TELLS_NO_TOOL:
            allowed = f"a name that T can tell from no tool: not {', '.join(_TELLS_NO_TOOL)}"
            yield document.problem(("tools", name), f"a tool with the name {name}", allowed, at_key=True)
    if robot.tool is not None and robot.tool not in document.keys(("tools",)):
        known = ", ".join(robot.tools) or "none"
        yield document.problem(("tool",), document.found(("tool",)), f"a tool of this file: {known}")


def _parts(document: Document, robot: RobotFile) -> Iterator[Problem]:
    shape = FAMILIES[robot.family].shape
    taken = (NO_TOOL, TOOL, *(() if shape is None else shape.links))
    for name in robot.parts:
        if name.lower() in taken:
            allowed = f"a name that means nothing else: not {', '.join(taken)}"
            yield document.problem(("parts", name), f"a part with the name {name}", allowed, at_key=True)


def range_text(document: Document, path: KeyPath) -> str:
    """A pair of limits as the file says it."""
    return f"{document.found((*path, 0))} to {document.found((*path, 1))}"
