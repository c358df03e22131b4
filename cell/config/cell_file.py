"""Schema of the cell file, and what it says as settings."""

import dataclasses
from typing import Annotated

from pydantic import BaseModel, Field

from cell.config.document import Document
from cell.config.fields import Endpoint, FileName, Name, Pose
from cell.config.settings import (
    CellSettings,
    GatewayEndpoint,
    OnManagerReturn,
    RobotSettings,
    Times,
    ZoneSettings,
)
from cell.config.units import STRICT, PositiveLength, Seconds, Units

_DEFAULT = Times()


class ManagerEntry(BaseModel):
    """The cell manager."""

    model_config = STRICT
    endpoint: Endpoint = Field(description="where the manager listens, tcp/HOST:PORT")


class RobotEntry(BaseModel):
    """One robot of the cell."""

    model_config = STRICT
    model: FileName = Field(description="the robot file, relative to this one")
    gateway: Name = Field(description="the gateway that drives this robot")
    base: Pose = Field(description="pose of the robot's base in world: X, Y, Z, A, B, C")
    program: FileName = Field(description="the robot's program, relative to this file")


class GatewayEntry(BaseModel):
    """One gateway, the master of one CAN bus."""

    model_config = STRICT
    endpoint: Endpoint = Field(description="where the gateway listens, tcp/HOST:PORT")
    drives: FileName = Field(description="the file of its bus and drives, relative to this one")


class ZoneEntry(BaseModel):
    """An exclusive zone: a box that one robot at a time may be in."""

    model_config = STRICT
    size: tuple[PositiveLength, PositiveLength, PositiveLength] = Field(
        description="edge lengths of the box: [x, y, z]"
    )
    pose: Pose = Field(description="pose of the box's centre in world: X, Y, Z, A, B, C")
    robots: Annotated[tuple[Name, ...], Field(min_length=1)] = Field(description="robots that may ask for the zone")


class TimesEntry(BaseModel):
    """Deadlines in seconds; what is left out keeps its default."""

    model_config = STRICT
    fresh_s: Seconds = Field(_DEFAULT.fresh_s, description="age limit of a presence and of a manager state")
    command_s: Seconds = Field(_DEFAULT.command_s, description="age limit of an operator's call")
    nominal_s: Seconds = Field(_DEFAULT.nominal_s, description="part of a set-point block before its braking ramp")
    lead_s: Seconds = Field(_DEFAULT.lead_s, description="how far ahead a new block joins")
    feedback_lost_s: Seconds = Field(_DEFAULT.feedback_lost_s, description="silence of drive feedback that is a fault")
    owner_silent_s: Seconds = Field(
        _DEFAULT.owner_silent_s, description="silence of blocks, at rest, that ends a claim"
    )
    estop_delay_s: Seconds = Field(
        _DEFAULT.estop_delay_s,
        description="from a software emergency stop (it never replaces a hard-wired one) to a gateway's quick stop",
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
    zones: dict[Name, ZoneEntry] = Field(default={}, description="exclusive zones by name")
    times: TimesEntry = Field(TimesEntry.model_construct(), description="deadlines in seconds")
    on_manager_return: Annotated[OnManagerReturn, Field(strict=False)] = Field(
        OnManagerReturn.OPERATOR,
        description="what a robot does that stopped because the manager was silent: continue, or wait for an operator",
    )

    def settings(self, document: Document, digest: str) -> CellSettings:
        """The settings; file names become absolute, as seen from the cell file."""
        return CellSettings(
            name=self.cell,
            file=document.file,
            manager_endpoint=self.manager.endpoint,
            robots={
                name: RobotSettings(
                    name,
                    document.beside(robot.model),
                    robot.gateway,
                    robot.base.settings(),
                    document.beside(robot.program),
                )
                for name, robot in self.robots.items()
            },
            gateways={
                name: GatewayEndpoint(name, gateway.endpoint, document.beside(gateway.drives))
                for name, gateway in self.gateways.items()
            },
            zones={
                name: ZoneSettings(name, zone.size, zone.pose.settings(), zone.robots)
                for name, zone in self.zones.items()
            },
            times=Times(**{field.name: getattr(self.times, field.name) for field in dataclasses.fields(Times)}),
            on_manager_return=self.on_manager_return,
            digest=digest,
        )
