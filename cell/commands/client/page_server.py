"""A page in the browser about a cell, running or recorded: its server, and what it takes from the files here."""

import socket
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

import numpy as np
import typer

from cell.commands.access import require
from cell.commands.errors import CommandError, not_installed
from cell.config.document import read_text
from cell.config.fields import is_everywhere
from cell.config.settings import CellSettings, MeshShape, Shape
from cell.view.bodies import triangles
from cell.view.gate import Gate, Level
from cell.view.meshes import LinkMesh, RobotMeshes
from cell.view.rows import Axes

if TYPE_CHECKING:
    from cell.view.server import GatedServer
    from robot_agent.kinematics.urdf.urdf_visuals import Visual
    from robot_agent.workspace import PlacedRobot

LOCAL = ("127.0.0.1", "localhost", "::1")


@contextmanager
def page_server(host: str, port: int, highest: Level) -> Iterator["GatedServer"]:
    """A server for a page, whose addresses up to a level are printed. Raises `CommandError` when there can be none."""
    try:
        from cell.view.server import GatedServer, PortTaken, Unguarded, listen
    except ImportError as error:
        raise not_installed("the page", "view", error) from error
    require(highest, f"a page for level {highest.name.lower()}")
    gate = Gate(_names(host), highest)
    try:
        listener = listen(host, port)
        server = GatedServer(gate, listener)
    except PortTaken as error:
        raise CommandError(str(error), "end that, or name another port: --port 0 takes a free one") from error
    except (OSError, Unguarded) as error:
        raise CommandError(f"the page cannot be served at {host}: {error}") from error
    try:
        _tell(gate, host, listener.getsockname()[1])
        yield server
    finally:
        server.stop()


def _names(host: str) -> tuple[str, ...]:
    """The names under which the page is told. Raises `CommandError` for an address that is every address."""
    if not host or is_everywhere(host):
        raise CommandError(
            f"--host {host or '(empty)'} found, allowed is one address or name of this computer",
            "name the address of the network card by which it should be reached",
        )
    return LOCAL if host in LOCAL else (host, socket.gethostname())


def _tell(gate: Gate, host: str, port: int) -> None:
    shown = f"[{host}]" if ":" in host else host
    for level, token in gate.tokens.items():
        typer.echo(f"to {level.name.lower()}: http://{shown}:{port}/?token={token}")


def axes_of(settings: CellSettings) -> dict[str, Axes]:
    """The joints of each robot whose file can be read here; the page does without the others."""
    from robot_agent.kinematics import KinematicsError
    from robot_agent.workspace import PlacedRobot

    found = {}
    for name, robot in settings.robots.items():
        try:
            model = PlacedRobot.of(robot).model
        except (KinematicsError, OSError) as error:
            typer.echo(f"the axes of {name} are not shown: {error}", err=True)
            continue
        joints = tuple(model.joint_names)
        found[name] = Axes(joints, tuple(each in model.linear_names for each in joints))
    return found


def meshes_of(settings: CellSettings, readable: Collection[str]) -> dict[str, RobotMeshes]:
    """How each robot looks whose URDF names meshes that can be read here; the page draws the capsules of the others.

    `readable`: robots whose file can be read here, which `axes_of` has found out and told.
    """
    from robot_agent.kinematics import KinematicsError
    from robot_agent.workspace import PlacedRobot

    found = {}
    for name in readable:
        try:
            meshes = _meshes(PlacedRobot.of(settings.robots[name]))
        except (KinematicsError, OSError, _NoMesh) as error:
            typer.echo(f"the meshes of {name} are not shown, but its capsules: {error}", err=True)
            continue
        if meshes is not None:
            found[name] = meshes
    return found


class _NoMesh(Exception):
    """A file that a URDF names is none."""


def _meshes(robot: "PlacedRobot") -> RobotMeshes | None:
    """None where the robot's file names none."""
    from robot_agent.kinematics.urdf.urdf_visuals import urdf_visuals

    model = robot.model
    visuals = () if model.description.urdf is None else urdf_visuals(model.description.urdf)
    if not any(isinstance(visual.shape, MeshShape) for visual in visuals):
        return None
    held = [visual.link for visual in visuals]
    poses = np.array([visual.pose_link_visual for visual in visuals])
    return RobotMeshes(
        tuple(map(_link_mesh, visuals)),
        lambda joints: robot.pose_world_base @ model.links(joints)[held] @ poses,
        model.n,
        tuple(i for i, capsule in enumerate(model.description.capsules) if capsule.link in held),
    )


def _link_mesh(visual: "Visual") -> LinkMesh:
    shape = visual.shape
    if isinstance(shape, MeshShape) and not shape.file.is_file():
        raise _NoMesh(f"found no file {shape.file}, which the URDF names; put it there, or correct its filename")
    try:
        read = triangles(shape)
    except Exception as error:
        # Whatever a reader of foreign files stumbles over: the page has the capsules.
        raise _unreadable(shape, f"{type(error).__name__}: {error}") from error
    if read is None or not len(read[1]):
        raise _unreadable(shape, "no triangles")
    vertices, faces = read
    return LinkMesh(vertices * visual.scale, faces if np.prod(visual.scale) > 0.0 else faces[:, ::-1])


def _unreadable(shape: Shape, why: str) -> _NoMesh:
    file = shape.file if isinstance(shape, MeshShape) else "the URDF"
    return _NoMesh(f"{file} cannot be read as a mesh ({why}); allowed are STL, OBJ, PLY and GLB")


def programs_of(settings: CellSettings) -> dict[str, tuple[str, ...]]:
    """The lines of each robot's program that can be read here."""
    texts = {name: read_text(robot.program) for name, robot in settings.robots.items() if robot.program is not None}
    return {name: tuple(text.splitlines()) for name, text in texts.items() if isinstance(text, str)}
