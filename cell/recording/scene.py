"""What Foxglove draws of the messages of a cell, in the schemas that it knows.

Each topic tells all there is to know of its subject every time, so that a viewer which jumps in time needs the newest
of each alone. `/joints/<robot>`: `foxglove.JointStates`; `/tf/<robot>` and `/tf/frames`: `foxglove.FrameTransforms`;
`/scene/<robot>`, `/scene/zones` and `/scene/things`: `foxglove.SceneUpdate`; `/log`: `foxglove.Log`.
"""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from foxglove import messages as fox

from cell.config.settings import (
    BoxShape,
    CylinderShape,
    HalfSpaceShape,
    HullShape,
    MeshShape,
    PoseSettings,
    SphereShape,
    ThingSettings,
)
from cell.geometry import Convex
from cell.geometry.arrays import Array
from cell.messages import Event, FramePose, ManagerState, Presence, RobotState, Severity, ZoneGeometry, ZoneState
from cell.recording.cell_files import RecordedCell

WORLD = "world"
DRAWN_S = 0.09
"""A body, and where a TCP is, are drawn at most this often."""
Drawn = tuple[str, Any]
"""Topic, and a message of `foxglove.messages`."""
_LEVELS = {
    Severity.INFO: fox.LogLevel.Info,
    Severity.WARNING: fox.LogLevel.Warning,
    Severity.ALARM: fox.LogLevel.Error,
}
_ROBOTS = ((0.11, 0.42, 0.66), (0.78, 0.33, 0.24), (0.18, 0.55, 0.34), (0.56, 0.37, 0.64), (0.72, 0.53, 0.04))
_ZONES = {
    None: (0.6, 0.6, 0.6),
    ZoneState.FREE: (0.2, 0.7, 0.3),
    ZoneState.GRANTED: (0.2, 0.4, 0.9),
    ZoneState.OCCUPIED: (0.95, 0.6, 0.1),
    ZoneState.ORPHANED: (0.9, 0.1, 0.1),
}
_PLATE_M = (20.0, 20.0, 0.001)
"""Of a half-space its surface is drawn, as far as this."""


class Scene:
    """What was heard so far, as far as later pictures need it."""

    def __init__(self, cell: RecordedCell) -> None:
        self._settings = cell.settings
        self._joints = cell.joints
        self._colours = {name: _ROBOTS[i % len(_ROBOTS)] for i, name in enumerate(cell.settings.robots)}
        self._zones: dict[str, ZoneGeometry] = {}
        self._states: dict[str, ZoneState] = {}
        self._frames = {name: frame.pose for name, frame in cell.settings.frames.items()}
        things = {thing.name: thing for robot in cell.settings.robots.values() for thing in robot.things}
        self._things = list(things.values())
        self._due: dict[str, float] = {}

    def begin(self, at: float) -> Iterator[Drawn]:
        """What is drawn before anything was heard."""
        if self._things:
            yield "/scene/things", fox.SceneUpdate(entities=[_thing(thing, at) for thing in self._things])
        if self._frames:
            yield "/tf/frames", _transforms(self._frames, at)

    def of(self, message: object, at: float) -> Iterator[Drawn]:
        """What is drawn of a message that was heard at `at`, seconds since 1970."""
        match message:
            case RobotState():
                yield from self._robot(message, at)
            case Presence() if self._is_due(f"body {message.robot}", at):
                yield f"/scene/{message.robot}", self._body(message, at)
            case ManagerState():
                states = {name: zone.state for name, zone in message.zones.items()}
                if states != self._states:
                    self._states = states
                    yield "/scene/zones", self._all_zones(at)
            case ZoneGeometry():
                self._zones[message.zone] = message
                yield "/scene/zones", self._all_zones(at)
            case FramePose():
                self._frames[message.frame] = PoseSettings(message.position_m, message.quaternion_xyzw)
                yield "/tf/frames", _transforms(self._frames, at)
            case Event():
                text = f"{message.text}; {message.remedy}" if message.remedy else message.text
                level = _LEVELS[message.severity]
                told = f"{text} [{message.code}]"
                yield "/log", fox.Log(timestamp=_stamp(at), level=level, message=told, name=message.source)

    def _is_due(self, what: str, at: float) -> bool:
        if at < self._due.get(what, at):
            return False
        self._due[what] = at + DRAWN_S
        return True

    def _robot(self, state: RobotState, at: float) -> Iterator[Drawn]:
        if state.joints is not None:
            names: Sequence[str] = self._joints.get(state.robot, ())
            if len(names) != len(state.joints):
                names = [str(i + 1) for i in range(len(state.joints))]
            joints = [fox.JointState(name=name, position=q) for name, q in zip(names, state.joints, strict=True)]
            yield f"/joints/{state.robot}", fox.JointStates(timestamp=_stamp(at), joints=joints)
        if not self._is_due(f"tf {state.robot}", at):
            return
        robot = self._settings.robots.get(state.robot)
        placed = {} if robot is None else {f"{state.robot}/base": robot.base}
        if state.tcp_position_m is not None and state.tcp_quaternion_xyzw is not None:
            placed[f"{state.robot}/tcp"] = PoseSettings(state.tcp_position_m, state.tcp_quaternion_xyzw)
        yield f"/tf/{state.robot}", _transforms(placed, at)

    def _all_zones(self, at: float) -> fox.SceneUpdate:
        entities = []
        for zone in self._zones.values():
            colour = _colour(_ZONES[self._states.get(zone.zone)], 0.25)
            drawn = _measured(zone.shape, zone.size_m, PoseSettings(zone.position_m, zone.quaternion_xyzw), colour)
            entities.append(fox.SceneEntity(timestamp=_stamp(at), frame_id=WORLD, id=f"zone {zone.zone}", **drawn))
        return fox.SceneUpdate(entities=entities)

    def _body(self, presence: Presence, at: float) -> fox.SceneUpdate:
        """The body where it is, and fainter where it comes to rest; its whole reach while nobody knows where it is."""
        body, rgb = presence.body, self._colours.get(presence.robot, _ROBOTS[0])
        now: dict[str, Any] = {}
        rest: dict[str, Any] = {}
        if body.known and len(body.poses):
            now = _capsules(body.poses[0], body.radii_m + body.growth_m[0], _colour(rgb, 0.9))
            rest = _capsules(body.poses[-1], body.radii_m + body.growth_m[-1], _colour(rgb, 0.2))
        else:
            reach = PoseSettings(body.base, (0.0, 0.0, 0.0, 1.0))
            now = _measured("sphere", (body.reach_m,), reach, _colour(rgb, 0.1))
        named = {f"{presence.robot} now": now, f"{presence.robot} at rest": rest}
        entities = [
            fox.SceneEntity(timestamp=_stamp(at), frame_id=WORLD, id=name, **drawn) for name, drawn in named.items()
        ]
        return fox.SceneUpdate(entities=entities)


def _capsules(points: Array, radii: Array, colour: fox.Color) -> dict[str, Any]:
    """Capsules with ends `(c, 2, 3)` and radii `(c,)` as balls and round columns."""
    balls, columns = [], []
    for (start, end), radius in zip(np.asarray(points, float), radii.tolist(), strict=True):
        size = _vector((2.0 * radius,) * 3)
        balls += [fox.SpherePrimitive(pose=_pose(place, _UPRIGHT), size=size, color=colour) for place in (start, end)]
        length = float(np.linalg.norm(end - start))
        if length > 0.0:
            pose = _pose((start + end) / 2.0, _turned_up((end - start) / length))
            long = _vector((2.0 * radius, 2.0 * radius, length))
            columns.append(fox.CylinderPrimitive(pose=pose, size=long, bottom_scale=1.0, top_scale=1.0, color=colour))
    return {"spheres": balls, "cylinders": columns}


_UPRIGHT = (0.0, 0.0, 0.0, 1.0)


def _turned_up(way: Array) -> tuple[float, float, float, float]:
    """The shortest turn of Z to the direction `way` `(3,)`, as quaternion (x, y, z, w)."""
    x, y, z = way.tolist()
    if z < -1.0 + 1e-12:
        return (1.0, 0.0, 0.0, 0.0)
    w = np.sqrt((1.0 + z) / 2.0)
    return (-y / (2.0 * w), x / (2.0 * w), 0.0, float(w))


def _thing(thing: ThingSettings, at: float) -> fox.SceneEntity:
    """In its frame, which says where it is."""
    frame, pose = (WORLD, thing.pose) if thing.in_frame is None else (thing.in_frame.frame, thing.in_frame.pose)
    drawn = _shape(thing, pose, _colour((0.5, 0.5, 0.5), 0.7))
    return fox.SceneEntity(timestamp=_stamp(at), frame_id=frame, id=f"thing {thing.name}", **drawn)


def _shape(thing: ThingSettings, pose: PoseSettings, colour: fox.Color) -> dict[str, Any]:
    match thing.shape:
        case BoxShape(size):
            return _measured("box", size, pose, colour)
        case SphereShape(radius):
            return _measured("sphere", (radius,), pose, colour)
        case CylinderShape(radius, length):
            return _measured("cylinder", (radius, length), pose, colour)
        case HalfSpaceShape():
            return _measured("box", _PLATE_M, pose, colour)
        case HullShape(points):
            faces = Convex.of_points(np.array(points)).faces
            corners = [face[i] for face in faces for last in range(2, len(face)) for i in (0, last - 1, last)]
            triangles = [fox.Point3(x=x, y=y, z=z) for x, y, z in np.array(corners).tolist()]
            placed = _pose(pose.position_m, pose.quaternion_xyzw)
            return {"triangles": [fox.TriangleListPrimitive(pose=placed, points=triangles, color=colour)]}
        case MeshShape(file, unit):
            try:
                data = file.read_bytes()
            except OSError:
                return {}
            kind = f"model/{file.suffix.lower().lstrip('.')}"
            placed, scale = _pose(pose.position_m, pose.quaternion_xyzw), _vector((unit,) * 3)
            model = fox.ModelPrimitive(
                pose=placed, scale=scale, color=colour, override_color=True, media_type=kind, data=data
            )
            return {"models": [model]}


def _measured(shape: str, size: Sequence[float], pose: PoseSettings, colour: fox.Color) -> dict[str, Any]:
    """A word of `cell.geometry.MEASURED` as the primitives of an entity."""
    placed = _pose(pose.position_m, pose.quaternion_xyzw)
    if shape == "sphere":
        return {"spheres": [fox.SpherePrimitive(pose=placed, size=_vector((2.0 * size[0],) * 3), color=colour)]}
    if shape == "cylinder":
        long = _vector((2.0 * size[0], 2.0 * size[0], size[1]))
        column = fox.CylinderPrimitive(pose=placed, size=long, bottom_scale=1.0, top_scale=1.0, color=colour)
        return {"cylinders": [column]}
    return {"cubes": [fox.CubePrimitive(pose=placed, size=_vector(size), color=colour)]}


def _transforms(placed: dict[str, PoseSettings], at: float) -> fox.FrameTransforms:
    """Frames in world."""
    return fox.FrameTransforms(
        transforms=[
            fox.FrameTransform(
                timestamp=_stamp(at),
                parent_frame_id=WORLD,
                child_frame_id=name,
                translation=_vector(pose.position_m),
                rotation=_quaternion(pose.quaternion_xyzw),
            )
            for name, pose in placed.items()
        ]
    )


def _pose(position: Sequence[float] | Array, quaternion: Sequence[float]) -> fox.Pose:
    return fox.Pose(position=_vector(position), orientation=_quaternion(quaternion))


def _quaternion(xyzw: Sequence[float]) -> fox.Quaternion:
    x, y, z, w = xyzw
    return fox.Quaternion(x=x, y=y, z=z, w=w)


def _vector(xyz: Sequence[float] | Array) -> fox.Vector3:
    x, y, z = xyz
    return fox.Vector3(x=float(x), y=float(y), z=float(z))


def _colour(rgb: tuple[float, float, float], opacity: float) -> fox.Color:
    return fox.Color(r=rgb[0], g=rgb[1], b=rgb[2], a=opacity)


def _stamp(at: float) -> fox.Timestamp:
    return fox.Timestamp.from_epoch_secs(at)
