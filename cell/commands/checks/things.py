"""Things of a cell: files of triangles that can be read, and links that there are."""

from collections.abc import Iterator

from cell.commands.checks.readings import Readings
from cell.config.frame_entry import FrameTree
from cell.config.problem import KeyPath, Problem
from cell.geometry import GeometryError
from robot_agent.kinematics import Model
from robot_agent.model import TOOL
from robot_agent.workspace import solid_of, unknown_links


def check_things(readings: Readings, models: dict[str, Model]) -> Iterator[Problem]:
    """Meshes that are none, and names in `may_touch` that are no link of the robot."""
    document, frames = readings.document, FrameTree(readings.cell.frames)
    for name, entry in readings.cell.things.items():
        path: KeyPath = ("things", name)
        for robot, links in entry.may_touch.items():
            if robot not in models:
                continue
            for unknown in unknown_links(models[robot], links):
                index = links.index(unknown)
                allowed = f"one of {', '.join((*models[robot].link_names, TOOL))}"
                found = f"{unknown!r}, no link of {robot}"
                yield document.problem((*path, "may_touch", robot, index), found, allowed)
        if entry.mesh is None or any(entry.problems(document, path, list(models))):
            continue
        try:
            solid_of(entry.settings(name, document, frames))
        except GeometryError as error:
            yield document.problem((*path, "mesh", "file"), str(error), "an STL or OBJ file with triangles")
