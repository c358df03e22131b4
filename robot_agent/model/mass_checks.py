"""What must hold for the masses of a robot file."""

from collections.abc import Iterator

import numpy as np

from cell.config.document import Document
from cell.config.problem import KeyPath, Problem
from robot_agent.model.families import FAMILIES
from robot_agent.model.mass_file import Inertia, inertia_matrix
from robot_agent.model.robot_file import RobotFile

_ROUNDED = 1e-6
"""Share of the largest moment by which a rounded inertia may miss what a body can have."""


def check_masses(document: Document, robot: RobotFile) -> Iterator[Problem]:
    """Masses on links that are none, or twice on one; inertias that no body has; families that take no masses."""
    family = FAMILIES[robot.family]
    if robot.masses and family.no_masses is not None:
        yield document.problem(("masses",), f"masses in family {robot.family}", family.no_masses)
        return
    seen: set[int] = set()
    for index, entry in enumerate(robot.masses):
        path: KeyPath = ("masses", index)
        if family.shape is not None and entry.link >= len(family.shape.links):
            allowed = f"1 to {len(family.shape.links) - 1} (flange)"
            yield document.problem((*path, "link"), f"{entry.link}", allowed)
        if entry.link in seen:
            yield document.problem((*path, "link"), f"{entry.link} for the second time", "each link once")
        seen.add(entry.link)
        yield from _inertia(document, path, entry.inertia_kg_m2)
    for name, tool in robot.tools.items():
        yield from _inertia(document, ("tools", name), tool.inertia_kg_m2)
    for name, part in robot.parts.items():
        yield from _inertia(document, ("parts", name), part.inertia_kg_m2)


def _inertia(document: Document, path: KeyPath, entry: Inertia) -> Iterator[Problem]:
    """The moments about the main axes are not negative, and none is larger than the other two together."""
    moments = np.linalg.eigvalsh(inertia_matrix(entry))
    slack = _ROUNDED * abs(moments).max()
    if moments[0] < -slack or moments[2] > moments[0] + moments[1] + slack:
        found = f"main moments {', '.join(f'{moment:.4g}' for moment in moments)}"
        allowed = "none below 0, none above the sum of the others: no body is made so"
        yield document.problem((*path, "inertia_kg_m2"), found, allowed)
