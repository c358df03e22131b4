"""Things of a cell: files of triangles that can be read, links that there are, and robots at home beside them."""

from collections.abc import Iterator

from cell.commands.checks.bodies import placed
from cell.commands.checks.readings import Readings
from cell.config.document import Document
from cell.config.frame_entry import FrameTree
from cell.config.problem import KeyPath, Problem, Severity
from cell.config.thing_entry import ShapedEntry
from cell.geometry import GeometryError, Mesh
from robot_agent.kinematics import Model
from robot_agent.model import TOOL
from robot_agent.workspace import Things, solid_of, unknown_links


def check_things(readings: Readings, models: dict[str, Model]) -> Iterator[Problem]:
    """Meshes that are none, and names in `may_touch` that are no link of the robot."""
    document = readings.document
    for name, entry in readings.cell.things.items():
        path: KeyPath = ("things", name)
        for robot, links in entry.may_touch.items():
            if robot not in models:
                continue
            for unknown in unknown_links(models[robot], links):
                index = links.index(unknown)
                allowed = f"one of {', '.join((*models[robot].link_names, TOOL, *models[robot].description.parts))}"
                found = f"{unknown!r}, no link of {robot}"
                yield document.problem((*path, "may_touch", robot, index), found, allowed)
        yield from check_shape(document, path, entry)


def check_homes(readings: Readings, models: dict[str, Model]) -> Iterator[Problem]:
    """Where programs begin a robot keeps away from things; for a cell in which nothing is wrong otherwise."""
    frames, document = FrameTree(readings.cell.frames), readings.document
    things = tuple(entry.settings(name, document, frames) for name, entry in readings.cell.things.items())
    for robot, at_home in placed(readings, models).items():
        model = at_home.model
        for touch in Things(model, things, robot).touches_at(at_home.pose_world_base, model.home):
            allowed = f"a place from which {robot} at home keeps away, another home, or its links under may_touch"
            yield document.problem(("things", touch.thing), f"at home {robot}'s {touch}", allowed, at_key=True)


def check_shape(document: Document, path: KeyPath, entry: ShapedEntry) -> Iterator[Problem]:
    """A mesh that is none, or a hull of points that span nothing; a warning for a mesh without an inside."""
    if any(entry.shape_problems(document, path)):
        return
    if entry.mesh is not None and not document.beside(entry.mesh.file).is_file():
        return  # told where it is named
    where: KeyPath = (*path, "hull") if entry.mesh is None else (*path, "mesh", "file")
    allowed = "points that span a body" if entry.mesh is None else "an STL or OBJ file with triangles"
    try:
        solid = solid_of(entry.shape(document), entry.pose.settings())
    except GeometryError as error:
        yield document.problem(where, str(error), allowed)
        return
    if isinstance(solid, Mesh) and not solid.is_closed:
        found = "triangles that do not close: only their surface is kept away from, a body wholly inside is not noticed"
        yield document.problem(
            where, found, "a closed mesh; this one if bodies only come from outside", severity=Severity.WARNING
        )
