"""Schema of the file of a bus and its drives, and what it says as settings."""

from dataclasses import replace
from pathlib import Path
from typing import Annotated, Literal

from pydantic import BaseModel, Field

from cell.config.fields import Name
from cell.config.units import STRICT, Seconds, Units
from drive_gateway.canopen.axis_objects import index_of
from drive_gateway.canopen.cob_id import MASTER_NODE_ID
from drive_gateway.canopen.drive_objects import DIGITAL_OUTPUTS
from drive_gateway.config.axis_entry import AxisEntry
from drive_gateway.config.bus_length import BusLengths
from drive_gateway.config.emergency_entry import EmergencyTables, codes_of
from drive_gateway.config.io_entry import IoNodeEntry
from drive_gateway.config.output_entry import InputEntry, OutputEntry, mask_of
from drive_gateway.config.own_objects import EdsFiles, own_objects
from drive_gateway.config.profile_entry import ProfilePdosEntry
from drive_gateway.config.settings import (
    AxisSettings,
    BusSettings,
    GatewaySettings,
    IoSettings,
    RobotDrives,
)

AxisName = Annotated[str, Field(pattern=r"^J[1-9]$", description="an axis, named for its joint: J1, J2, ...")]
Metres = Annotated[float, Field(ge=0, le=10_000)]


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
    length_m: Metres = Field(default=0.0, description="[m] from end to end, checked against the bit rate")
    longest_stub_m: Metres = Field(default=0.0, description="[m] the longest stub from the bus to a node")
    stubs_m: Metres = Field(default=0.0, description="[m] all stubs together")
    options: dict[str, str | int | float | bool] = Field(default={}, description="more options of the interface")

    def lengths(self) -> BusLengths:
        return BusLengths(self.length_m, self.longest_stub_m, self.stubs_m)


class RobotEntry(BaseModel):
    """The axes of one robot, and what hangs on it."""

    model_config = STRICT
    axes: dict[AxisName, AxisEntry] = Field(
        description="axes by name, in the joints' order", json_schema_extra={"minProperties": 1}
    )
    outputs: dict[Name, OutputEntry] = Field(
        default={},
        description="digital outputs of the drives and I/O nodes by name",
        json_schema_extra={"maxProperties": 32},
    )
    inputs: dict[Name, InputEntry] = Field(
        default={},
        description="digital inputs of the drives and I/O nodes that are told by name",
        json_schema_extra={"maxProperties": 64},
    )


class DrivesFile(BaseModel):
    """One CAN bus, its gateway's times, its drives and I/O nodes."""

    model_config = STRICT
    units: Units = Field(description="units of lengths and angles: {length: mm, angle: deg}")
    bus: BusEntry = Field(description="how to open the bus: interface, channel, bitrate")
    cycle_s: Seconds = Field(description="period of SYNC")
    overrun_limit_s: Seconds = Field(description="a cycle later than this is a fault; 0.02 on real drives")
    heartbeat_producer_s: Seconds = Field(description="period of the heartbeats (1017h)")
    heartbeat_timeout_s: Seconds = Field(description="silence of a heartbeat that is a fault (1016h)")
    tpdo_timeout_s: Seconds = Field(description="silence of a node's TPDO that stops its robot")
    boot_timeout_s: Seconds = Field(description="time for a node's boot-up after its reset, and for each of its values")
    sdo_timeout_s: Annotated[float, Field(gt=0, le=30)] = Field(
        default=0.5, description="[s] a node answers each SDO request within this time"
    )
    sync_counter: Annotated[int, Field(ge=2, le=240)] | None = Field(
        default=None, description="SYNC counts from 1 to this (1019h), for drives that need it; without: no counter"
    )
    gateway_node: int = Field(
        default=MASTER_NODE_ID, ge=1, le=127, description="the gateway's own Node-ID, which no node may have"
    )
    profile_pdos: ProfilePdosEntry | None = Field(
        default=None, description="PDOs for motions that the drives make by themselves; without: cyclic image and SDO"
    )
    emergencies: EmergencyTables = {}
    robots: dict[Name, RobotEntry] = Field(
        description="robots on this bus by name", json_schema_extra={"minProperties": 1}
    )

    io_nodes: dict[Name, IoNodeEntry] = Field(default={}, description="I/O nodes (CiA 401) on this bus by name")

    def settings(self, name: str, folder: Path = Path()) -> GatewaySettings:
        """The same in SI for the gateway `name`, files relative to `folder`; only for a file without problems."""
        files = EdsFiles()
        return GatewaySettings(
            name=name,
            bus=BusSettings(self.bus.interface, self.bus.channel, self.bus.bitrate, self.bus.options),
            cycle_s=self.cycle_s,
            overrun_limit_s=self.overrun_limit_s,
            heartbeat_producer_s=self.heartbeat_producer_s,
            heartbeat_timeout_s=self.heartbeat_timeout_s,
            tpdo_timeout_s=self.tpdo_timeout_s,
            boot_timeout_s=self.boot_timeout_s,
            sdo_timeout_s=self.sdo_timeout_s,
            sync_counter=self.sync_counter or 0,
            node_id=self.gateway_node,
            robots={
                robot: RobotDrives(
                    robot,
                    tuple(self._whole(robot, joint, folder, files) for joint in entry.axes),
                    tuple(output.settings(output_name) for output_name, output in entry.outputs.items()),
                    tuple(item.settings(input_name) for input_name, item in entry.inputs.items()),
                )
                for robot, entry in self.robots.items()
            },
            io_nodes=tuple(self._io_node(io, entry) for io, entry in self.io_nodes.items()),
        )

    def _io_node(self, name: str, entry: IoNodeEntry) -> IoSettings:
        outputs = [output for robot in self.robots.values() for output in robot.outputs.values()]
        kept = sum(1 << output.bit for output in outputs if output.io == name and output.at_stop == "keep")
        return entry.settings(name, kept, codes_of(self.emergencies, entry.emergencies))

    def axis(self, robot: str, name: str, folder: Path = Path()) -> AxisSettings:
        """One axis with what the whole file says of it."""
        entry = self.robots[robot]
        return replace(
            entry.axes[name].settings(name, folder),
            profile_pdos=None if self.profile_pdos is None else self.profile_pdos.pdos(),
            output_mask=mask_of(entry.outputs.values(), name),
            input_mask=mask_of(entry.inputs.values(), name),
        )

    def _whole(self, robot: str, name: str, folder: Path, files: EdsFiles) -> AxisSettings:
        """With what its EDS or DCF says, which is read for it."""
        axis = self.robots[robot].axes[name]
        settings = self.axis(robot, name, folder)
        emergencies = codes_of(self.emergencies, axis.emergencies)
        switched = self._output_objects(robot, axis.node)
        objects = own_objects(axis.objects, axis.axis, settings.eds, files, axis.like)
        objects = tuple(item for item in objects if item.index not in switched)
        return replace(settings, emergencies=emergencies, objects=objects)

    def _output_objects(self, robot: str, node: int) -> set[int]:
        """60FEh of the axes of a node that have outputs: a DCF must not switch them on."""
        entry = self.robots[robot]
        drives = {output.axis for output in entry.outputs.values()}
        axes = [axis for name, axis in entry.axes.items() if axis.node == node and name in drives]
        return {index_of(DIGITAL_OUTPUTS, axis.axis) for axis in axes}
