"""What makes a description no robot of its family."""

from collections.abc import Iterable, Iterator

import numpy as np

from robot_agent.kinematics.errors import BadModel
from robot_agent.model.description import TOOL, Apart, CapsuleBody, RobotDescription
from robot_agent.model.families import shape_of


def family_problems(description: RobotDescription) -> Iterator[str]:
    """Lengths and joints against those of the family."""
    shape, given = shape_of(description.family), description.geometry
    yield from (f"length {name} is missing" for name in shape.lengths if name not in given)
    yield from (
        f"length {name} is unknown, allowed {', '.join(shape.lengths)}" for name in given if name not in shape.lengths
    )
    count, most = len(description.joint_names), len(shape.linear)
    if not shape.fewest <= count <= most:
        allowed = f"{shape.fewest} to {most}" if shape.fewest < most else f"{most}"
        yield f"found {count} joints, allowed {allowed}"
    elif (description.linear or (False,) * count) != shape.linear[:count]:
        yield "the joints that slide are not those of the family"


def checked_lengths(description: RobotDescription, positive: tuple[str, ...] = ()) -> dict[str, float]:
    """The lengths [m] of a robot of a family with a closed form; those named `positive` are longer than zero.

    Raises:
        BadModel: lengths or joints are not those of the family.
    """
    problems = tuple(family_problems(description))
    problems += tuple(
        f"length {name} must be longer than zero" for name in positive if description.geometry.get(name, 1.0) <= 0
    )
    if problems:
        raise BadModel(description.name, problems)
    return description.geometry


def body_problems(body: tuple[CapsuleBody, ...], links: int) -> Iterator[str]:
    """Capsules against links."""
    if not body:
        yield "found no capsules, allowed at least one: a robot without a body would be nowhere"
    for i, capsule in enumerate(body):
        if capsule.link not in range(links):
            yield f"capsule {i} is on link {capsule.link}, allowed 0 to {links - 1}"


def apart_problems(apart: Apart, links: tuple[str, ...], parts: Iterable[str]) -> Iterator[str]:
    """Names of links and parts that may touch against those that there are."""
    allowed = (*links, TOOL, *parts)
    unknown = dict.fromkeys(name for pair in apart.may_touch for name in pair if name not in allowed)
    yield from (f"found link {name!r} in self_collision, allowed {', '.join(allowed)}" for name in unknown)


def coupling_problems(description: RobotDescription) -> Iterator[str]:
    """The coupling against the number of joints, and against what a gear can do."""
    coupling, count = description.coupling, len(description.joint_names)
    if coupling is None:
        return
    if coupling.shape != (count, count):
        yield f"the coupling has the shape {coupling.shape}, allowed {(count, count)}"
    elif np.triu(coupling, 1).any() or not np.diag(coupling).all():
        yield "the coupling is not lower triangular without a zero on its diagonal: axes only move joints behind them"
