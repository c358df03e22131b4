"""The room in three dimensions, drawn by `viser` from the shapes of `bodies`."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import trimesh
import viser
from numpy.typing import NDArray

from cell.config.settings import BoxShape, CellSettings, SpaceKind
from cell.geometry import quaternion
from cell.geometry.arrays import Array
from cell.messages import FramePose, RobotState, ZoneState
from cell.view.bodies import (
    NOTHING,
    Ahead,
    Capsules,
    RobotBody,
    Solid,
    Zone,
    ahead,
    measured_joints,
    robot_body,
    smallest_gap,
    spaces,
    things,
    triangles,
    zones,
)
from cell.view.meshes import RobotMeshes
from cell.view.newest import Newest
from cell.view.now import Line

Colour = tuple[int, int, int]
Drawable = NDArray[np.float32]
ROBOT_COLOURS: tuple[Colour, ...] = (
    (59, 130, 246),
    (249, 146, 42),
    (46, 164, 79),
    (155, 89, 216),
    (0, 158, 166),
    (214, 90, 160),
    (132, 112, 60),
    (100, 116, 139),
)
ALARM: Colour = (220, 38, 38)
ZONE_COLOURS: dict[ZoneState, Colour] = {
    ZoneState.FREE: (34, 160, 90),
    ZoneState.GRANTED: (59, 130, 246),
    ZoneState.OCCUPIED: (234, 160, 20),
    ZoneState.ORPHANED: ALARM,
}
SPACE_COLOURS: dict[SpaceKind, Colour] = {
    SpaceKind.SAFE: (34, 160, 90),
    SpaceKind.FORBIDDEN: ALARM,
    SpaceKind.SLOW: (234, 160, 20),
}
_THING: Colour = (148, 150, 155)
_GAP: Colour = (190, 24, 93)
_HIDDEN = 1e-6
"""As large as what is not shown: its number stays, so nothing is built anew."""
_SHORTEST = 1e-9
"""A capsule that is a ball points upwards."""
_UPRIGHT = np.array([[1.0, 0.0, 0.0, 0.0]], np.float32)
_CORNERS = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
_EDGES = [(i, k) for i in range(8) for k in range(i + 1, 8) if bin(i ^ k).count("1") == 1]


class CapsuleCloud:
    """Many capsules as two nodes: all cylinders, all balls at their ends."""

    def __init__(self, scene: viser.SceneApi, name: str, colour: Colour, opacity: float | None) -> None:
        self._scene = scene
        self._name = name
        self._colour = colour
        self._opacity = opacity
        self._room = 0
        self._columns: Any = None
        self._balls: Any = None
        self._shown: object = None

    def show(self, capsules: Capsules, colour: Colour) -> None:
        """Let these be there, and no others; what is there already is not sent again."""
        if len(capsules) == 0 and self._columns is None:
            return
        shown = capsules.points.tobytes(), capsules.radii.tobytes(), colour
        if shown == self._shown:
            return
        self._shown = shown
        if self._columns is None or len(capsules) > self._room:
            self._build(max(8, 1 << (len(capsules) - 1).bit_length()), colour)
        columns, balls = self._columns, self._balls
        middle, wxyz, size, ends, radii = instances(capsules, self._room)
        columns.batched_positions, columns.batched_wxyzs, columns.batched_scales = middle, wxyz, size
        balls.batched_positions, balls.batched_scales = ends, radii
        if colour != self._colour:
            self._colour = colour
            columns.batched_colors = balls.batched_colors = np.array(colour, np.uint8)

    def _build(self, room: int, colour: Colour) -> None:
        self._room, self._colour = room, colour
        column = trimesh.creation.cylinder(radius=1.0, height=1.0, sections=20)
        ball = trimesh.creation.icosphere(subdivisions=2, radius=1.0)
        self._columns, self._balls = self._batch("columns", column, room), self._batch("balls", ball, 2 * room)

    def _batch(self, part: str, mesh: Any, count: int) -> Any:
        return self._scene.add_batched_meshes_simple(
            f"{self._name}/{part}",
            mesh.vertices,
            mesh.faces,
            np.tile([1.0, 0.0, 0.0, 0.0], (count, 1)),
            np.zeros((count, 3)),
            batched_scales=np.full((count, 3), _HIDDEN),
            batched_colors=np.array(self._colour, np.uint8),
            opacity=self._opacity,
            lod="off",
            cast_shadow=self._opacity is None,
            receive_shadow=False,
        )


def instances(capsules: Capsules, room: int) -> tuple[Drawable, Drawable, Drawable, Drawable, Drawable]:
    """Places, turns and sizes of `room` cylinders, places and sizes of twice as many balls; those too many hidden."""
    count = len(capsules)
    ends = capsules.points.reshape(-1, 3)
    way = ends[1::2] - ends[::2]
    way *= np.where(way[:, 2:] < 0.0, -1.0, 1.0)  # a cylinder looks the same from either end
    way[:, 2] = np.maximum(way[:, 2], _SHORTEST)
    lengths = np.sqrt(np.einsum("ij,ij->i", way, way))
    upright = lengths + way[:, 2]
    half = np.sqrt(2.0 * lengths * upright)
    middle, turns, size = np.zeros((room, 3), np.float32), _UPRIGHT.repeat(room, axis=0), _hidden(room)
    middle[:count] = 0.5 * (ends[1::2] + ends[::2])
    turns[:count, 0], turns[:count, 1], turns[:count, 2] = upright / half, -way[:, 1] / half, way[:, 0] / half
    size[:count, :2], size[:count, 2] = capsules.radii[:, None], np.maximum(lengths, _HIDDEN)
    places, sizes = np.zeros((2 * room, 3), np.float32), _hidden(2 * room)
    places[: 2 * count], sizes[: 2 * count] = ends, capsules.radii.repeat(2)[:, None]
    return middle, turns, size, places, sizes


def _hidden(room: int) -> Drawable:
    return np.full((room, 3), _HIDDEN, np.float32)


class MeshBody:
    """The links of a robot as meshes, a node each."""

    def __init__(self, scene: viser.SceneApi, name: str, colour: Colour, meshes: RobotMeshes) -> None:
        self._meshes = meshes
        self._colour = colour
        self._joints = b""
        self._links = [
            scene.add_mesh_simple(f"{name}/{i}", link.vertices, link.faces, color=colour, visible=False)
            for i, link in enumerate(meshes.links)
        ]

    def show(self, joints: Array | None, colour: Colour) -> bool:
        """Let the links stand as these joints have them; answers whether they do. Without joints they are hidden."""
        if joints is None or len(joints) != self._meshes.joints:
            self._hide()
            return False
        if colour != self._colour:
            self._colour = colour
            for link in self._links:
                link.color = colour
        if joints.tobytes() != self._joints:
            self._joints = joints.tobytes()
            for link, pose in zip(self._links, self._meshes.place(joints), strict=True):
                link.position = tuple(pose[:3, 3])
                link.wxyz = tuple(np.roll(quaternion.from_matrix(pose[:3, :3]), 1))
                link.visible = True
        return True

    def _hide(self) -> None:
        if self._joints:
            for link in self._links:
                link.visible = False
        self._joints = b""


@dataclass(slots=True)
class _Drawn:
    """What is drawn of one robot."""

    colour: Colour
    now: CapsuleCloud
    rest: CapsuleCloud
    reserved: CapsuleCloud
    label: Any
    meshes: MeshBody | None
    replaced: tuple[int, ...]
    """Capsules of its body that are not drawn where its meshes are."""
    text: str = ""
    base: Array = field(default_factory=lambda: np.zeros(3))


class Stage:
    """The scene of a page; `often` is called for each picture, `seldom` a few times a second."""

    def __init__(
        self, server: viser.ViserServer, settings: CellSettings, meshes: Mapping[str, RobotMeshes] | None = None
    ) -> None:
        self._scene = server.scene
        self._meshes = meshes or {}
        self._settings = settings
        self._robots = {
            name: self._robot(name, ROBOT_COLOURS[i % len(ROBOT_COLOURS)]) for i, name in enumerate(settings.robots)
        }
        self._built: dict[str, object] = {}
        """Name of a node: from what it was built, so that it is built anew when that changes alone."""
        self._gap: Any = None
        self._scene.configure_default_lights(cast_shadow=False)
        self._scene.add_grid("/floor", 12.0, 12.0, cell_size=0.5, section_size=1.0)
        for space, kind in spaces(settings):
            self._add_solid(f"/spaces/{space.name}", space, SPACE_COLOURS[kind], 0.06)
            label = f"{kind.value} for {space.name.replace('/', ': ')}"
            self._scene.add_label(f"/spaces/{space.name}/label", label, position=tuple(space.pose[:3, 3]))
        self._look_at_all(server)

    def _robot(self, name: str, colour: Colour) -> _Drawn:
        cloud = CapsuleCloud
        at = f"/robots/{name}"
        base = np.array(self._settings.robots[name].base.position_m)
        meshes = self._meshes.get(name)
        label = self._scene.add_label(f"{at}/label", name, position=tuple(base), anchor="top-center")
        return _Drawn(
            colour,
            cloud(self._scene, f"{at}/body", colour, None),
            cloud(self._scene, f"{at}/at_rest", colour, 0.3),
            cloud(self._scene, f"{at}/reserved", colour, 0.08),
            label,
            None if meshes is None else MeshBody(self._scene, f"{at}/meshes", colour, meshes),
            () if meshes is None else meshes.replaced,
            base=base,
        )

    def _look_at_all(self, server: viser.ViserServer) -> None:
        bases = np.array([drawn.base for drawn in self._robots.values()])
        middle = np.append(bases.mean(axis=0)[:2], bases[:, 2].mean() + 0.6)
        away = float(np.linalg.norm(bases - bases.mean(axis=0), axis=-1).max()) + 2.0
        server.initial_camera.look_at = tuple(middle)
        server.initial_camera.position = tuple(middle + away * np.array([0.25, -1.35, 0.8]))

    def often(self, seen: Newest) -> None:
        """Bodies, and the smallest distance between two of them."""
        bodies = [body for name in self._robots if (body := robot_body(name, seen)) is not None]
        for body in bodies:
            drawn = self._robots[body.robot]
            colour = ALARM if body.alarmed else drawn.colour
            as_meshes = drawn.meshes is not None and drawn.meshes.show(measured_joints(body, seen), colour)
            drawn.now.show(body.now.without(drawn.replaced) if as_meshes else body.now, colour)
            drawn.rest.show(body.rest, drawn.colour)
        self._show_gap(bodies)

    def seldom(self, seen: Newest, lines: list[Line]) -> None:
        """Zones, things, frames, what is reserved and planned, and who waits for whom."""
        for name, drawn in self._robots.items():
            body = robot_body(name, seen)
            if body is not None:
                self._show_space(body, ahead(name, seen), drawn)
        for zone in zones(seen):
            self._show_zone(zone)
        for thing in things(self._settings, seen):
            self._show_solid(f"/things/{thing.name}", thing, _THING, None)
        for frame, pose in seen.of(FramePose).items():
            self._show_frame(f"/frames/{frame}", frame, pose.position_m, pose.quaternion_xyzw)
        for name, state in seen.of(RobotState).items():
            if state.tcp_position_m is not None and state.tcp_quaternion_xyzw is not None:
                self._show_frame(f"/robots/{name}/tcp", "", state.tcp_position_m, state.tcp_quaternion_xyzw)
        self._show_waits(lines)

    def _show_space(self, body: RobotBody, ahead: Ahead, drawn: _Drawn) -> None:
        drawn.reserved.show(ahead.reserved, drawn.colour)
        self._show_path(f"/robots/{body.robot}/ahead", ahead.way, drawn.colour)
        if body.reach is None:
            self._remove(f"/robots/{body.robot}/reach")
            return
        drawn.now.show(NOTHING, drawn.colour)
        middle, radius = body.reach
        if self._changed(f"/robots/{body.robot}/reach", body.reach):
            self._scene.add_icosphere(
                f"/robots/{body.robot}/reach", radius, color=ALARM, position=middle, opacity=0.15, cast_shadow=False
            )

    def _show_path(self, name: str, points: Array, colour: Colour) -> None:
        if len(points) < 2:
            self._remove(name)
        elif self._changed(name, points.tobytes()):
            segments = np.stack([points[:-1], points[1:]], axis=1)
            self._scene.add_line_segments(name, segments, colors=colour, thickness=2.5, thickness_units="screen")

    def _show_gap(self, bodies: list[RobotBody]) -> None:
        gap = smallest_gap(bodies)
        if gap is None:
            return
        if self._gap is None:
            line = self._scene.add_line_segments(
                "/gap/line", gap.points[None], colors=_GAP, thickness=2.0, thickness_units="screen"
            )
            self._gap = line, self._scene.add_label("/gap/length", "", anchor="bottom-center")
        line, label = self._gap
        line.points = gap.points[None].astype(np.float32)
        label.position = tuple(gap.points.mean(axis=0))
        text = f"{1000.0 * gap.distance_m:.0f} mm"
        if label.text != text:
            label.text = text

    def _show_zone(self, zone: Zone) -> None:
        name = f"/zones/{zone.solid.name}"
        colour = ZONE_COLOURS[zone.state]
        key = zone.solid.shape, zone.solid.pose.tobytes(), zone.label
        if not self._changed(name, key):
            return
        self._add_solid(f"{name}/room", zone.solid, colour, 0.10)
        top = zone.solid.pose[:3, 3].copy()
        if isinstance(zone.solid.shape, BoxShape):
            corners = _CORNERS * zone.solid.shape.size_m @ zone.solid.pose[:3, :3].T + zone.solid.pose[:3, 3]
            edges = np.array([[corners[i], corners[k]] for i, k in _EDGES])
            self._scene.add_line_segments(
                f"{name}/edges", edges, colors=colour, thickness=1.5, thickness_units="screen"
            )
            top[2] = corners[:, 2].max()
        self._scene.add_label(f"{name}/label", f"zone {zone.label}", position=tuple(top), anchor="bottom-center")

    def _show_solid(self, name: str, solid: Solid, colour: Colour, opacity: float | None) -> None:
        if self._changed(name, (solid.shape, solid.pose.tobytes())):
            self._add_solid(name, solid, colour, opacity)

    def _add_solid(self, name: str, solid: Solid, colour: Colour, opacity: float | None) -> None:
        mesh = triangles(solid.shape)
        if mesh is None:
            return
        self._scene.add_mesh_simple(
            name,
            *mesh,
            color=colour,
            opacity=opacity,
            wxyz=tuple(np.roll(quaternion.from_matrix(solid.pose[:3, :3]), 1)),
            position=tuple(solid.pose[:3, 3]),
            side="double" if opacity is not None else "front",
            cast_shadow=opacity is None,
        )

    def _show_frame(self, name: str, label: str, position: tuple[float, ...], xyzw: tuple[float, ...]) -> None:
        if not self._changed(name, (position, xyzw)):
            return
        x, y, z = position
        self._scene.add_frame(
            name, wxyz=(xyzw[3], xyzw[0], xyzw[1], xyzw[2]), position=(x, y, z), axes_length=0.15, axes_radius=0.006
        )
        if label:
            self._scene.add_label(f"{name}/label", label, anchor="top-left")

    def _show_waits(self, lines: list[Line]) -> None:
        """An arrow over the floor from each robot that waits to the one that it waits for."""
        for line in lines:
            drawn = self._robots[line.robot]
            text = f"{line.robot}: {line.mode}" + (f", waits for {line.waits_for}" if line.waits_for else "")
            if drawn.text != text:
                drawn.text = drawn.label.text = text
            name = f"/waits/{line.robot}"
            other = self._robots.get(line.waits_for)
            if other is None:
                self._remove(name)
            elif self._changed(name, line.waits_for):
                way = other.base - drawn.base
                ends = np.array([drawn.base + 0.15 * way, other.base - 0.15 * way])
                ends[:, 2] += 0.03
                self._scene.add_arrows(
                    name, ends[None], colors=drawn.colour, shaft_radius=0.02, head_radius=0.06, head_length=0.16
                )

    def _changed(self, name: str, made_from: object) -> bool:
        if self._built.get(name) == made_from:
            return False
        self._built[name] = made_from
        return True

    def _remove(self, name: str) -> None:
        if self._built.pop(name, None) is not None:
            self._scene.remove_by_name(name)
