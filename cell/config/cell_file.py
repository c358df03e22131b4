"""Schema of the cell file, and what it says as settings."""

import dataclasses
import math
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import AfterValidator, BaseModel, BeforeValidator, Field

from cell.config.document import Document
from cell.config.fields import Endpoint, FileName, Name, Point, Pose
from cell.config.frame_entry import FrameEntry, FrameTree
from cell.config.settings import (
    CellSettings,
    ConveyorSettings,
    CorrectionSettings,
    GatewayEndpoint,
    MountedAtStart,
    OnManagerReturn,
    PairMargin,
    PathWindow,
    PoseSettings,
    RobotSettings,
    SensorFrame,
    SeparationSettings,
    Times,
)
from cell.config.space_entry import OrientationEntry, SpaceEntry, joint_range
from cell.config.thing_entry import ThingEntry
from cell.config.units import STRICT, Milliseconds, Number, PositiveAngle, PositiveLength, Seconds, ToSI, Units
from cell.config.zone_entry import ZoneEntry
from cell.geometry import frame_from_points
from cell.messages.common import ECHO_S

_DEFAULT = Times()
_WINDOW, _WIDEST = PathWindow(), PathWindow(math.radians(5.0) + 1e-12, 0.02 + 1e-12)


_FRAME: Name | None = Field(None, description="the frame in which it is given, by name; default world")


class ManagerEntry(BaseModel):
    """The cell manager."""

    model_config = STRICT
    endpoint: Endpoint = Field(description="where the manager listens, tcp/HOST:PORT")


class ConveyorEntry(BaseModel):
    """A belt and its encoder."""

    model_config = STRICT
    pose: Pose | None = Field(None, description="a frame along whose X the belt runs: X, Y, Z, A, B, C; or points")
    points: tuple[Point, Point, Point] | None = Field(
        None, description="or measured, [x, y, z] each: a mark on the belt, the same farther along, one aside"
    )
    frame: Name | None = _FRAME
    counts_per_metre: Annotated[Number, Field(description="of the encoder; below 0 when it counts backwards")]
    largest_speed: PositiveLength = Field(description="a faster belt is not believed")
    parts: bool = Field(False, description="its encoder tells when parts pass: TRACK waits for the next part")

    def measured(self) -> PoseSettings:
        """Its own frame. Raises `cell.geometry.NoFrame` for points without one, ValueError without either."""
        if self.points is not None:
            return PoseSettings.of(frame_from_points(*np.array(self.points)))
        if self.pose is None:
            raise ValueError("a conveyor with neither pose nor points")
        return self.pose.settings()


class CorrectionEntry(BaseModel):
    """Something measured that a robot may follow on its path, by `TRACK` in its program."""

    model_config = STRICT
    sensor: Annotated[SensorFrame | None, Field(strict=False)] = Field(
        None, description="a sensor's offsets of the tool, in the axes of base or tool; or conveyor"
    )
    conveyor: Name | None = Field(None, description="the conveyor to follow; or sensor")
    largest: PositiveLength = Field(description="farther from its path the robot does not go: it stops")
    largest_turn: PositiveAngle | None = Field(
        None, description="likewise for a sensor's turns; without it they are refused"
    )
    settle_ms: Milliseconds = Field(50.0, description="measurements are filtered with this time constant")
    fresh_ms: Milliseconds = Field(200.0, description="the robot stops when the newest measurement is older")
    speed: PositiveLength = Field(0.2, description="how fast the tool approaches what is measured; default 200 mm/s")
    acceleration: PositiveLength = Field(2.0, description="likewise, jerk ten times as much; default 2000 mm/s^2")

    def settings(self, name: str, conveyors: dict[str, ConveyorSettings]) -> CorrectionSettings:
        """The settings; a conveyor must be known."""
        return CorrectionSettings(
            name=name,
            sensor=self.sensor,
            conveyor=None if self.conveyor is None else conveyors[self.conveyor],
            largest_m=self.largest,
            largest_turn_rad=self.largest_turn or 0.0,
            settle_s=self.settle_ms / 1000.0,
            fresh_s=self.fresh_ms / 1000.0,
            speed_m_s=self.speed,
            acceleration_m_s2=self.acceleration,
        )


def _few_degrees(turn_rad: float) -> float:
    if turn_rad > _WIDEST.turn_rad:
        raise ValueError("5 deg or less: farther away an operator has to look at the way back")
    return turn_rad


def _few_millimetres(slide_m: float) -> float:
    if slide_m > _WIDEST.slide_m:
        raise ValueError("20 mm or less: farther away an operator has to look at the way back")
    return slide_m


class PathWindowEntry(BaseModel):
    """How far the joints of a stopped robot may be from its path, so that its program can continue."""

    model_config = STRICT
    turn: Annotated[PositiveAngle, AfterValidator(_few_degrees)] = Field(
        _WINDOW.turn_rad, description="each joint that turns; default 0.5 deg, at most 5 deg"
    )
    slide: Annotated[PositiveLength, AfterValidator(_few_millimetres)] = Field(
        _WINDOW.slide_m, description="each joint that slides; default 1 mm, at most 20 mm"
    )

    def settings(self) -> PathWindow:
        return PathWindow(self.turn, self.slide)


class RobotEntry(BaseModel):
    """One robot of the cell."""

    model_config = STRICT
    model: FileName = Field(description="the robot file, relative to this one")
    gateway: Name = Field(description="the gateway that drives this robot")
    base: Pose = Field(description="pose of the robot's base: X, Y, Z, A, B, C")
    frame: Name | None = _FRAME
    program: FileName = Field(description="the robot's program, relative to this file")
    points: FileName | None = Field(
        None,
        description="the file of its taught points, relative to this one; default NAME.points.yaml beside its program, "
        "which comes to be with the first point that is taught",
    )
    tool: str | None = Field(
        None,
        description="the tool on its flange when its agent starts, of those in its robot file, or `none`; default what "
        "the robot file says",
    )
    mounted_at_start: Annotated[MountedAtStart, Field(strict=False)] = Field(
        MountedAtStart.ASK,
        description="of a program with T, ATTACH or DETACH: `as_described`, somebody sees to it that the robot has the "
        "tool of `tool` or of its robot file, and no part, whenever its agent starts; `ask`, an operator says it after "
        "each start",
    )
    corrections: dict[Name, CorrectionEntry] = Field(default={}, description="what TRACK in its program may follow")
    path_window: PathWindowEntry = Field(
        PathWindowEntry.model_construct(), description="farther from its path a stopped robot does not continue"
    )
    spaces: dict[Name, SpaceEntry] = Field(default={}, description="where it stays, does not go, or is slow, by name")
    orientation: OrientationEntry | None = Field(None, description="where its tool may point")
    joints: dict[str, tuple[Number, Number]] = Field(
        default={}, description="ranges by joint, [low, high], within those of the robot file"
    )


class GatewayEntry(BaseModel):
    """One gateway, the master of one CAN bus."""

    model_config = STRICT
    endpoint: Endpoint = Field(description="where the gateway listens, tcp/HOST:PORT")
    drives: FileName = Field(description="the file of its bus and drives, relative to this one")


class PairEntry(BaseModel):
    """Two robots that keep apart by a margin of their own."""

    model_config = STRICT
    robots: tuple[Name, Name] = Field(description="the two")
    margin: PositiveLength = Field(description="how far they keep apart")


class SeparationEntry(BaseModel):
    """Robots share the room without zones: no one moves where another one is, or may come to."""

    model_config = STRICT
    margin: PositiveLength = Field(
        0.03, description="how far they keep apart; it also covers how well the bases are known; default 30 mm"
    )
    pairs: Annotated[tuple[PairEntry, ...], Field(max_length=120)] = Field(
        default=(), description="pairs of robots with another margin"
    )

    def settings(self) -> SeparationSettings:
        return SeparationSettings(self.margin, tuple(PairMargin(pair.robots, pair.margin) for pair in self.pairs))


def _off_is_none(value: object) -> object:
    if value == "off":
        return None
    if not isinstance(value, dict | SeparationEntry):
        raise ValueError("off, or how far robots keep apart: {margin: 30}")
    return value


Meeting = Annotated[tuple[Name, ...], Field(min_length=2)]
"""The robots that meet."""


class TimesEntry(BaseModel):
    """Deadlines in seconds; what is left out keeps its default."""

    model_config = STRICT
    fresh_s: Annotated[float, Field(gt=0, le=ECHO_S)] = Field(
        _DEFAULT.fresh_s, description="age limit of a presence and of a manager state; at most 2"
    )
    command_s: Annotated[float, Field(gt=0, le=ECHO_S)] = Field(
        _DEFAULT.command_s, description="age limit of an operator's call; at most 2"
    )
    nominal_s: Annotated[float, Field(gt=0, le=1)] = Field(
        _DEFAULT.nominal_s, description="part of a set-point block before its braking ramp; at most 1"
    )
    lead_s: Seconds = Field(_DEFAULT.lead_s, description="how far ahead a new block joins")
    feedback_lost_s: Seconds = Field(_DEFAULT.feedback_lost_s, description="silence of drive feedback that is a fault")
    owner_silent_s: Seconds = Field(
        _DEFAULT.owner_silent_s, description="silence of blocks, at rest, that ends a claim"
    )
    estop_delay_s: Annotated[float, Field(gt=0, le=5)] = Field(
        _DEFAULT.estop_delay_s,
        description="from a software emergency stop (it never replaces a hard-wired one) to a gateway's quick stop; "
        "at most 5, because `cell up` waits 10 s for the end of a gateway",
    )
    clock_error_s: Annotated[float, Field(gt=0, le=1)] = Field(
        _DEFAULT.clock_error_s,
        description="a robot that knows cell time less well takes no part in a common start or a meeting; at most 1",
    )
    idle_off_s: Seconds | None = Field(
        _DEFAULT.idle_off_s, description="a robot without a program for so long is switched off; without it never"
    )


class CellFile(BaseModel):
    """A whole cell."""

    model_config = STRICT
    cell: Name = Field(description="the cell's name")
    units: Units = Field(description="units of lengths and angles: {length: mm, angle: deg}")
    manager: ManagerEntry = Field(description="the cell manager: {endpoint: tcp/HOST:PORT}")
    robots: Annotated[dict[Name, RobotEntry], Field(max_length=16)] = Field(
        description="1 to 16 robots by name", json_schema_extra={"minProperties": 1}
    )
    gateways: dict[Name, GatewayEntry] = Field(description="gateways by name", json_schema_extra={"minProperties": 1})
    frames: Annotated[dict[Name, FrameEntry], Field(max_length=200)] = Field(
        default={}, description="up to 200 frames in which the others may be given, by name"
    )
    conveyors: dict[Name, ConveyorEntry] = Field(default={}, description="belts that robots may follow, by name")
    zones: dict[Name, ZoneEntry] = Field(default={}, description="exclusive zones by name")
    meetings: Annotated[dict[Name, Meeting], Field(max_length=16)] = Field(
        default={}, description="up to 16 meetings, where robots wait for each other (MEET): their robots, by name"
    )
    variables: Annotated[dict[Name, Name], Field(max_length=100)] = Field(
        default={},
        description="up to 100 variables that all programs may ask for in IF: by name, the robot whose LET sets it",
    )
    things: dict[Name, ThingEntry] = Field(default={}, description="what robots keep away from, by name")
    separation: Annotated[
        SeparationEntry | None, BeforeValidator(_off_is_none, json_schema_input_type=SeparationEntry | Literal["off"])
    ] = Field(
        SeparationEntry.model_construct(),
        description="keeps the robots apart wherever they are, also where it is not given; off: only zones do",
    )
    times: TimesEntry = Field(TimesEntry.model_construct(), description="deadlines in seconds")
    on_manager_return: Annotated[OnManagerReturn, Field(strict=False)] = Field(
        OnManagerReturn.OPERATOR,
        description="what a robot does that stopped because the manager was silent: continue, or wait for an operator",
    )

    def settings(self, document: Document, digest: str) -> CellSettings:
        """The settings; file names become absolute, as seen from the cell file."""
        frames = FrameTree(self.frames)
        conveyors = {
            name: ConveyorSettings(
                name,
                frames.in_world(belt.measured(), belt.frame),
                belt.counts_per_metre,
                belt.largest_speed,
                belt.parts,
            )
            for name, belt in self.conveyors.items()
        }
        things = tuple(thing.settings(name, document, frames) for name, thing in self.things.items())
        si = ToSI.of(self.units.model_dump())
        separation = self.kept_apart()
        return CellSettings(
            name=self.cell,
            file=document.file,
            manager_endpoint=self.manager.endpoint,
            robots={
                name: RobotSettings(
                    name,
                    document.beside(robot.model),
                    robot.gateway,
                    frames.in_world(robot.base.settings(), robot.frame),
                    document.beside(robot.program),
                    {key: entry.settings(key, conveyors) for key, entry in robot.corrections.items()},
                    robot.path_window.settings(),
                    things,
                    tuple(space.settings(key, document, frames) for key, space in robot.spaces.items()),
                    None if robot.orientation is None else robot.orientation.settings(),
                    {joint: joint_range(pair, si) for joint, pair in robot.joints.items()},
                    separation is not None,
                    document.beside(robot.points or str(Path(robot.program).parent / f"{name}.points.yaml")),
                    robot.mounted_at_start,
                    robot.tool,
                )
                for name, robot in self.robots.items()
            },
            gateways={
                name: GatewayEndpoint(name, gateway.endpoint, document.beside(gateway.drives))
                for name, gateway in self.gateways.items()
            },
            zones={name: zone.settings(name, frames) for name, zone in self.zones.items()},
            times=Times(**{field.name: getattr(self.times, field.name) for field in dataclasses.fields(Times)}),
            on_manager_return=self.on_manager_return,
            digest=digest,
            conveyors=conveyors,
            frames=frames.settings(self._fixed()),
            separation=separation,
            meetings=dict(self.meetings),
            variables=dict(self.variables),
        )

    def kept_apart(self) -> SeparationSettings | None:
        """How far robots keep apart; None where nothing but zones keeps them apart, or there is only one."""
        return None if self.separation is None or len(self.robots) < 2 else self.separation.settings()

    def _fixed(self) -> dict[str, str | None]:
        """What every process has to see at the same place, and takes from its own cell file; with its frame."""
        bases = {f"the base of robot {name}": robot.frame for name, robot in self.robots.items()}
        zones = {f"zone {name}": zone.frame for name, zone in self.zones.items()}
        spaces = {
            f"space {key} of robot {name}": space.frame
            for name, robot in self.robots.items()
            for key, space in robot.spaces.items()
        }
        return bases | zones | spaces | {f"conveyor {name}": belt.frame for name, belt in self.conveyors.items()}
