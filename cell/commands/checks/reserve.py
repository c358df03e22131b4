"""Program lines on which little motion is left: paths close to a singular pose, and joints close to their limits."""

from collections.abc import Collection, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from cell.commands.checks.programs import place_of
from cell.config.problem import Problem, Severity
from robot_agent.agent.planning.plans import Planned
from robot_agent.kinematics import Model
from robot_agent.language import Program

NEAR_LIMIT_DEG = 1.0
NEAR_LIMIT_M = 0.001


@dataclass(frozen=True, slots=True)
class _Left:
    """What is left on one move at the least."""

    line: int
    from_singular: float
    singular: str
    from_limit: float
    """Of the joint that is nearest to one, as a share of what counts as near."""
    joint: int


def check_reserve(
    file: Path, program: Program, model: Model, motions: list[Planned], paths: Collection[int]
) -> Iterator[Problem]:
    """Warnings for lines that bring a joint close to a limit, and for `paths` that pass close to a singular pose."""
    lefts: dict[int, list[_Left]] = {}
    for planned in motions:
        for left in _left(model, planned):
            lefts.setdefault(left.line, []).append(left)
    for line, here in sorted(lefts.items()):
        singular, limit = min(here, key=lambda left: left.from_singular), min(here, key=lambda left: left.from_limit)
        if line in paths and singular.from_singular < model.near_singular:
            found = f"only {singular.from_singular:.3f} away from a singular pose ({singular.singular})"
            allowed = f"{model.near_singular:g} or more (1 is the farthest), where no joint has to turn fast"
            yield _warning(file, program, line, found, f"{allowed}; or a joint move")
        if limit.from_limit < 1.0:
            unit, near = ("mm", 1000.0 * NEAR_LIMIT_M) if model.linear[limit.joint] else ("deg", NEAR_LIMIT_DEG)
            within = f"{max(limit.from_limit, 0.0) * near:.2f} {unit}"
            found = f"{model.joint_names[limit.joint]} comes within {within} of its limit"
            yield _warning(file, program, line, found, f"{near:g} {unit} or more, as room for jogs and corrections")


def _left(model: Model, planned: Planned) -> Iterator[_Left]:
    """What is left on each move of a motion."""
    joints = planned.motion.q(planned.taus)
    singularity, moves = model.singularity(joints), planned.motion.move_at(planned.taus)
    limits = model.from_limits(joints) / np.where(model.linear, NEAR_LIMIT_M, np.radians(NEAR_LIMIT_DEG))
    for move in np.unique(moves).tolist():
        mine = np.flatnonzero(moves == move)
        nearest = mine[singularity.nearest[mine].argmin()]
        joint = int(limits[mine].min(axis=0).argmin())
        yield _Left(
            planned.lines[move],
            float(singularity.nearest[nearest]),
            str(singularity.name[nearest]),
            float(limits[mine, joint].min()),
            joint,
        )


def _warning(file: Path, program: Program, line: int, found: str, allowed: str) -> Problem:
    text = f"{program.text_of(line)!r}: {found}"
    return Problem(*place_of(program, file, line), 1, "program", text, allowed, Severity.WARNING)
