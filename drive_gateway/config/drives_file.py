"""Schema of the file of a bus and its drives, and what it says as settings."""

import math
from pathlib import Path
from typing import Annotated, Literal

from pydantic import BaseModel, Field, ValidationInfo, field_validator

from cell.config.fields import FileName, Name
from cell.config.units import STRICT, Number, Positive, PositiveLength, Seconds, Units, in_si
from drive_gateway.config.settings import AxisSettings, BusSettings, GatewaySettings, HomingSettings, RobotDrives
from drive_gateway.config.simulation import Level, Simulation
from drive_gateway.config.simulation_entry import AxisName, SimulationEntry
from drive_gateway.sim.axis.axis_data import AxisData
from drive_gateway.sim.servo import SPEED_RESERVE


class BusEntry(BaseModel):
    """How python-can opens the bus."""

    model_config = STRICT
    interface: Annotated[str, Field(min_length=1)] = Field(
        description="interface of python-can: virtual, socketcan, ..."
    )
    channel: Annotated[str, Field(min_length=1)] = Field(
        description="channel of the interface: can0, a group address, ..."
    )
    bitrate: Literal[10_000, 20_000, 50_000, 125_000, 250_000, 500_000, 800_000, 1_000_000] = Field(
        description="bit rate [bit/s], one of CiA 301"
    )
    options: dict[str, str | int | float | bool] = Field(default={}, description="more options of the interface")


class HomingEntry(BaseModel):
    """How one axis finds its home point; directions are those of the drive's counts."""

    model_config = STRICT
    method: Literal[1, 2, 17, 18, 23, 27, 33, 34, 35, 37] = Field(description="homing method of CiA 402 (6098h)")
    fast: Positive = Field(description="speed towards the switch")
    slow: Positive = Field(description="speed off the switch")
    acceleration: Positive = Field(description="acceleration while homing")
    position: Number = Field(description="axis position of the home point")
    order: int = Field(default=1, ge=1, le=9, description="axes of one number home together, lower numbers first")

    def in_si(self, linear: bool, info: ValidationInfo) -> "HomingEntry":
        """The same in SI: the unit depends on what kind of axis homes."""
        names = ("fast", "slow", "acceleration", "position")
        return self.model_copy(update={name: in_si(getattr(self, name), linear, info) for name in names})

    def settings(self) -> HomingSettings:
        return HomingSettings(self.method, self.fast, self.slow, self.acceleration, self.position, self.order)


class AxisEntry(BaseModel):
    """One drive and its axis; angles and lengths are behind the gear."""

    model_config = STRICT
    type: Literal["rotary", "linear"] = Field("rotary", description="rotary, or linear for an axis that slides")
    node: int = Field(ge=1, le=127, description="CANopen node-ID, 1 to 127")
    feed: PositiveLength | None = Field(None, description="way of a linear axis per turn behind the gear")
    gear: float = Field(ge=1e-3, le=1e6, description="motor turns per turn of the axis, or of what drives a linear one")
    counts_per_turn: int = Field(gt=0, le=2**40, description="encoder counts per motor turn")
    direction: Literal[1, -1] = Field(description="1, or -1 when the motor turns against the axis")
    offset: Number = Field(description="axis position at encoder count zero")
    speed: Positive = Field(description="set points above this are refused")
    acceleration: Positive = Field(description="set points above this are refused; more than the joint's ramp")
    quick_stop: Positive = Field(description="deceleration of the drive's own quick stop (6085h)")
    following_window: Positive = Field(description="following error that is a fault (6065h)")
    following_time_s: Seconds = Field(description="how long the following error may be larger (6066h)")
    simulated_start: Number = Field(description="where a simulated drive stands when it is switched on")
    encoder: Literal["absolute", "incremental"] = Field(
        default="absolute", description="incremental: the axis must home after each start of its drive"
    )
    error_control: Literal["heartbeat", "guarding"] = Field(
        default="heartbeat", description="how node and gateway watch each other; guarding needs remote frames"
    )
    homing: HomingEntry | None = Field(default=None, description="how the axis finds its home point")
    eds: FileName | None = Field(default=None, description="EDS or DCF of the drive, relative to this file")

    @field_validator("offset", "speed", "acceleration", "quick_stop", "following_window", "simulated_start")
    @classmethod
    def _si(cls, value: float, info: ValidationInfo) -> float:
        return in_si(value, info.data.get("type") == "linear", info)

    @field_validator("homing")
    @classmethod
    def _homing_si(cls, homing: HomingEntry | None, info: ValidationInfo) -> HomingEntry | None:
        return None if homing is None else homing.in_si(info.data.get("type") == "linear", info)

    @property
    def linear(self) -> bool:
        return self.type == "linear"

    def settings(self, name: str, folder: Path = Path()) -> AxisSettings:
        return AxisSettings(
            name=name,
            node_id=self.node,
            counts_per_unit=self.counts_per_unit(),
            offset=self.offset,
            speed=self.speed,
            acceleration=self.acceleration,
            quick_stop=self.quick_stop,
            following_window=self.following_window,
            following_time_s=self.following_time_s,
            simulated_start=self.simulated_start,
            linear=self.linear,
            guarded=self.error_control == "guarding",
            incremental=self.encoder == "incremental",
            homing=None if self.homing is None else self.homing.settings(),
            eds="" if self.eds is None else str(folder / self.eds),
        )

    def counts_per_unit(self) -> float:
        """Encoder counts per radian, or metre, of the axis, with its sign."""
        return self.direction * self.counts_per_turn * self.gear / (self.feed or 2 * math.pi)

    def way_per_rad(self) -> float:
        """Way of a linear axis per radian behind the gear; 1 for a rotary one."""
        return 1.0 if self.feed is None else self.feed / (2 * math.pi)


class RobotEntry(BaseModel):
    """The axes of one robot."""

    model_config = STRICT
    axes: dict[AxisName, AxisEntry] = Field(
        description="axes by name, in the joints' order", json_schema_extra={"minProperties": 1}
    )


class DrivesFile(BaseModel):
    """One CAN bus, its gateway's times and its drives."""

    model_config = STRICT
    units: Units = Field(description="units of lengths and angles: {length: mm, angle: deg}")
    bus: BusEntry = Field(description="how to open the bus: interface, channel, bitrate")
    cycle_s: Seconds = Field(description="period of SYNC")
    overrun_limit_s: Seconds = Field(description="a cycle later than this is a fault; 0.02 on real drives")
    heartbeat_producer_s: Seconds = Field(description="period of the heartbeats (1017h)")
    heartbeat_timeout_s: Seconds = Field(description="silence of a heartbeat that is a fault (1016h)")
    tpdo_timeout_s: Seconds = Field(description="silence of a node's TPDO that stops its robot")
    boot_timeout_s: Seconds = Field(description="time for a node's boot-up after its reset")
    simulated_lag_s: float = Field(ge=0, le=1, description="lag of a simulated drive behind its set points")
    simulation: SimulationEntry = Field(default=SimulationEntry(), description="how drives are simulated")
    robots: dict[Name, RobotEntry] = Field(
        description="robots on this bus by name", json_schema_extra={"minProperties": 1}
    )

    def settings(self, name: str, folder: Path = Path()) -> GatewaySettings:
        """The same in SI for the gateway `name`, files relative to `folder`; only for a file without problems."""
        return GatewaySettings(
            name=name,
            bus=BusSettings(self.bus.interface, self.bus.channel, self.bus.bitrate, self.bus.options),
            cycle_s=self.cycle_s,
            overrun_limit_s=self.overrun_limit_s,
            heartbeat_producer_s=self.heartbeat_producer_s,
            heartbeat_timeout_s=self.heartbeat_timeout_s,
            tpdo_timeout_s=self.tpdo_timeout_s,
            boot_timeout_s=self.boot_timeout_s,
            simulated_lag_s=self.simulated_lag_s,
            robots={
                robot: RobotDrives(robot, tuple(axis.settings(joint, folder) for joint, axis in entry.axes.items()))
                for robot, entry in self.robots.items()
            },
            simulation=Simulation(
                level=Level(self.simulation.level),
                wire_time=self.simulation.wire_time,
                dc_bus=self.simulation.dc_bus.data(),
                axes=self.simulated_axes(),
            ),
        )

    def simulated_axes(self) -> dict[tuple[str, str], AxisData]:
        """What the full level knows of each axis, by robot and name."""
        found: dict[tuple[str, str], AxisData] = {}
        for robot, entries in self.simulation.axes.items():
            for name, entry in entries.items():
                axis = self.robots[robot].axes[name]
                found[robot, name] = entry.data(
                    gear=axis.gear,
                    direction=axis.direction,
                    counts_per_turn=axis.counts_per_turn,
                    offset=axis.offset / axis.way_per_rad(),
                    top_speed=SPEED_RESERVE * axis.speed * axis.gear / axis.way_per_rad(),
                    seed=axis.node,
                )
        return found
