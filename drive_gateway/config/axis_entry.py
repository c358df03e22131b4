"""Schema of one axis in a drives file, and what it says as settings."""

import math
from pathlib import Path
from typing import Annotated, Literal

from pydantic import AfterValidator, BaseModel, Field, ValidationInfo, WithJsonSchema, field_validator, model_validator

from cell.config.fields import FileName, Name
from cell.config.units import STRICT, Number, Positive, PositiveLength, Seconds, in_si
from drive_gateway.canopen.axis_objects import AXES
from drive_gateway.canopen.eds import TYPES
from drive_gateway.config.drive_units import ACCELERATION_UNITS, VELOCITY_UNITS, DriveUnits, drive_units, unit_of
from drive_gateway.config.known_drive import KNOWN_DRIVES, check_name, with_known_keys
from drive_gateway.config.object_address import ObjectAddress, address_of
from drive_gateway.config.own_objects import OwnObjects
from drive_gateway.config.pdo_entry import PdosEntry
from drive_gateway.config.settings import (
    BRAKE_S,
    DELAY_CYCLES,
    REST_WINDOW,
    SWITCH_ON_S,
    AxisSettings,
    EncoderSettings,
    HomingSettings,
    IdentitySettings,
    InputSettings,
    TemperatureSettings,
    TorqueSettings,
)

METHODS = frozenset({*range(-128, 0), *range(1, 15), *range(17, 31), 33, 34, 35, 37})
"""Homing methods (CiA 402-2, 6098h): 15, 16, 31, 32 and 36 are reserved, and 0 is none."""


def _method(number: int) -> int:
    if number not in METHODS:
        raise ValueError("1 to 14, 17 to 30, 33, 34, 35 or 37; -128 to -1 as the drive's manual has them")
    return number


class HomingEntry(BaseModel):
    """How one axis finds its home point; directions are those of the drive's counts."""

    model_config = STRICT
    method: Annotated[int, AfterValidator(_method)] = Field(
        description="homing method of CiA 402 (6098h): 1 to 14, 17 to 30, 33 to 35, 37; -128 to -1 are the maker's own"
    )
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


UInt32 = Annotated[int, Field(ge=0, lt=2**32)]


class IdentityEntry(BaseModel):
    """Which drive must be at this node (1018h); a node with another one is not configured."""

    model_config = STRICT
    vendor: UInt32 | None = Field(default=None, description="vendor-ID, 1018h:01")
    product: UInt32 | None = Field(default=None, description="product code, 1018h:02")
    revision: UInt32 | None = Field(default=None, description="revision number, 1018h:03")
    serial: UInt32 | None = Field(default=None, description="serial number, 1018h:04")

    def settings(self) -> IdentitySettings:
        return IdentitySettings(self.vendor, self.product, self.revision, self.serial)


Bits = Annotated[tuple[Annotated[int, Field(ge=0, le=31)], ...], Field(max_length=32)]


class InputsEntry(BaseModel):
    """Safety inputs at the drive; a bit that is 1 is closed, so a broken wire is open."""

    model_config = STRICT
    enable: Bits = Field(default=(), description="bits of 60FDh without which the drive does not switch on")
    door: Bits = Field(default=(), description="bits of guard doors")
    estop: Bits = Field(default=(), description="bits of emergency-stop buttons, which stop the whole cell")

    def settings(self) -> InputSettings:
        return InputSettings(self.enable, self.door, self.estop)


class EncoderCheckEntry(BaseModel):
    """What is compared after each start of an absolute encoder's drive."""

    model_config = STRICT
    window: Positive | None = Field(
        default=None,
        description="how far the axis may move while its drive is off; without it a sixteenth of a motor turn",
    )
    serial: ObjectAddress | None = Field(default=None, description="object with the encoder's serial number")
    status: ObjectAddress | None = Field(default=None, description="object with the encoder's status")
    battery_mask: int = Field(
        default=0, ge=0, lt=2**32, description="bits of the status that are set after its battery was empty"
    )


class TemperatureEntry(BaseModel):
    """Where the drive shows a temperature; CiA 402 has no object for it."""

    model_config = STRICT
    object: ObjectAddress
    type: Literal["INTEGER8", "INTEGER16", "INTEGER32", "UNSIGNED8", "UNSIGNED16", "UNSIGNED32"] = Field(
        description="its data type (CiA 301)"
    )
    unit_c: Positive = Field(default=1.0, description="degrees Celsius of one unit: 0.1 where it counts tenths")

    def settings(self) -> TemperatureSettings:
        size, signed = TYPES[self.type]
        return TemperatureSettings(address_of(self.object), size, signed, self.unit_c)


class AxisEntry(BaseModel):
    """One drive and its axis; angles and lengths are behind the gear."""

    model_config = STRICT
    type: Literal["rotary", "linear"] = Field("rotary", description="rotary, or linear for an axis that slides")
    node: int = Field(ge=1, le=127, description="CANopen node-ID, 1 to 127 but for the gateway's own")
    axis: int = Field(default=1, ge=1, le=AXES, description="which axis of its node, 1 to 3")
    feed: PositiveLength | None = Field(None, description="way of a linear axis per turn behind the gear")
    gear: float = Field(ge=1e-3, le=1e6, description="motor turns per turn of the axis, or of what drives a linear one")
    counts_per_turn: int = Field(gt=0, le=2**40, description="encoder counts per motor turn")
    velocity_unit: Annotated[str, AfterValidator(unit_of(VELOCITY_UNITS))] = Field(
        default="counts/s",
        description=f"unit in which the drive takes velocities (6081h, 6099h, 60B1h, 60FFh): {VELOCITY_UNITS}; of the "
        "motor's shaft, or of the axis where it is a length; with a factor: 0.1 rpm",
    )
    acceleration_unit: Annotated[str, AfterValidator(unit_of(ACCELERATION_UNITS))] = Field(
        default="counts/s^2",
        description=f"unit in which the drive takes accelerations (6083h, 6084h, 6085h, 609Ah): {ACCELERATION_UNITS}; "
        "as for velocity_unit",
    )
    try_units: bool = Field(
        default=True,
        description="the axis' first motion by its drive tries its units, in mode profile velocity; false for a drive "
        "without that mode",
    )
    direction: Literal[1, -1] = Field(description="1, or -1 when the motor turns against the axis")
    offset: Number = Field(description="axis position at encoder count zero")
    speed: Positive = Field(description="set points above this are refused")
    acceleration: Positive = Field(description="set points above this are refused; more than the joint's ramp")
    quick_stop: Positive = Field(description="deceleration of the drive's own quick stop (6085h)")
    following_window: Positive = Field(description="following error that is a fault (6065h)")
    following_time_s: Seconds = Field(description="how long the following error may be larger (6066h)")
    delay_cycles: int = Field(
        default=DELAY_CYCLES,
        ge=1,
        le=50,
        description="cycles from a sample on the bus to the position that shows it, for the gateway's following error",
    )
    brake_s: float = Field(
        default=BRAKE_S,
        ge=0,
        le=0.5,
        description="how long motor and holding brake hold together, while it opens and while it closes; 0: no brake",
    )
    switch_on_s: float = Field(
        default=SWITCH_ON_S,
        ge=0.1,
        le=10,
        description="[s] how long the drive may take to switch on, its DC link and its brake included",
    )
    rest_window: Positive | None = Field(
        default=None,
        description="an axis that stays within this for 0.1 s is at rest; without it 0.2 mrad or 0.2 mm. Larger for a "
        "drive that hunts",
    )
    encoder: Literal["absolute", "incremental"] = Field(
        default="absolute", description="incremental: the axis must home after each start of its drive"
    )
    limits: tuple[Number, Number] | None = Field(
        default=None, description="lowest and highest axis position, which the drive keeps too (607Dh)"
    )
    endless: bool = Field(
        default=False, description="the axis turns without end; its drive counts within one turn (607Bh)"
    )
    limit_switches: tuple[Number, Number] | None = Field(
        default=None, description="lower and upper axis position of its limit switches, which its drive shows in 60FDh"
    )
    encoder_check: EncoderCheckEntry = Field(
        default=EncoderCheckEntry(), description="how an absolute encoder is checked after each start"
    )
    inputs: InputsEntry | None = Field(default=None, description="safety inputs at this drive")
    mode: Literal["cyclic", "interpolated"] = Field(
        default="cyclic",
        description="mode in which blocks are played: cyclic synchronous position, or interpolated position",
    )
    interpolation: int = Field(
        default=0, ge=-32768, le=0, description="60C0h in mode interpolated: 0 linear, below 0 a maker's own number"
    )
    rated_torque_nm: Annotated[float, Field(ge=0.001, le=1e6)] | None = Field(
        default=None, description="rated torque of the motor [Nm], as the drive must show it (6076h)"
    )
    feed_forward: Literal["none", "velocity", "torque"] = Field(
        default="none",
        description="velocity: each sample's velocity goes to the drive as its offset (60B1h); torque: its torque too "
        "(60B2h)",
    )
    temperature: TemperatureEntry | None = Field(
        default=None, description="object of the maker's own that shows a temperature, to be seen beside the current"
    )
    identity: IdentityEntry = Field(default=IdentityEntry(), description="which drive must be at this node")
    error_control: Literal["heartbeat", "guarding"] = Field(
        default="heartbeat", description="how node and gateway watch each other; guarding needs remote frames"
    )
    homing: HomingEntry | None = Field(default=None, description="how the axis finds its home point")
    eds: FileName | None = Field(default=None, description="EDS or DCF of the drive, relative to this file")
    like: Annotated[str, AfterValidator(check_name), WithJsonSchema({"enum": list(KNOWN_DRIVES)})] | None = Field(
        default=None, description="a known drive, which says some keys; those of this file go before"
    )
    emergencies: Name | None = Field(default=None, description="its type of drive in `emergencies` of this file")
    objects: OwnObjects = {}
    pdos: PdosEntry = Field(default=PdosEntry(), description="PDOs that are not as usual: number, identifier, mapping")
    quick_stop_option: Literal[2, 6] = Field(
        default=6,
        description="how the drive ends its quick stop (605Ah): 6 stays with voltage on, 2 takes it off by itself",
    )
    connection_lost: Literal[1, 3] = Field(
        default=3, description="what the drive does when the gateway is gone (6007h): 3 quick stop, 1 fault"
    )
    waive: tuple[Literal["1016", "6007", "605A", "6065", "6066", "60C2"], ...] = Field(
        default=(), max_length=6, description="objects that this drive may lack; each costs something that is told"
    )

    @model_validator(mode="before")
    @classmethod
    def _as_known(cls, entry: object) -> object:
        return with_known_keys(entry)

    @field_validator("offset", "speed", "acceleration", "quick_stop", "following_window")
    @classmethod
    def _si(cls, value: float, info: ValidationInfo) -> float:
        return in_si(value, info.data.get("type") == "linear", info)

    @field_validator("velocity_unit", "acceleration_unit")
    @classmethod
    def _of_its_kind(cls, unit: str, info: ValidationInfo) -> str:
        if unit.split()[-1].startswith(("m/s", "mm/s")) and info.data.get("type") != "linear":
            raise ValueError("a unit of angles or counts for an axis that turns")
        return unit

    @field_validator("rest_window")
    @classmethod
    def _rest_window_si(cls, window: float | None, info: ValidationInfo) -> float | None:
        return None if window is None else in_si(window, info.data.get("type") == "linear", info)

    @field_validator("homing")
    @classmethod
    def _homing_si(cls, homing: HomingEntry | None, info: ValidationInfo) -> HomingEntry | None:
        return None if homing is None else homing.in_si(info.data.get("type") == "linear", info)

    @field_validator("limits", "limit_switches")
    @classmethod
    def _limits_si(cls, limits: tuple[float, float] | None, info: ValidationInfo) -> tuple[float, float] | None:
        if limits is None:
            return None
        linear = info.data.get("type") == "linear"
        return in_si(limits[0], linear, info), in_si(limits[1], linear, info)

    @field_validator("encoder_check")
    @classmethod
    def _window_si(cls, check: EncoderCheckEntry, info: ValidationInfo) -> EncoderCheckEntry:
        if check.window is None:
            return check
        return check.model_copy(update={"window": in_si(check.window, info.data.get("type") == "linear", info)})

    @property
    def linear(self) -> bool:
        return self.type == "linear"

    def settings(self, name: str, folder: Path = Path()) -> AxisSettings:
        return AxisSettings(
            name=name,
            node_id=self.node,
            number=self.axis,
            counts_per_unit=self.counts_per_unit(),
            offset=self.offset,
            speed=self.speed,
            acceleration=self.acceleration,
            quick_stop=self.quick_stop,
            following_window=self.following_window,
            following_time_s=self.following_time_s,
            delay_cycles=self.delay_cycles,
            brake_s=self.brake_s,
            switch_on_s=self.switch_on_s,
            units=self.units(),
            try_units=self.try_units,
            rest_window=REST_WINDOW if self.rest_window is None else self.rest_window,
            index_counts=self.counts_per_turn,
            linear=self.linear,
            limits=self.limits,
            modulus=round(self.counts_per_turn * self.gear) if self.endless else 0,
            limit_switches=self.limit_switches,
            inputs=None if self.inputs is None else self.inputs.settings(),
            interpolated=self.mode == "interpolated",
            interpolation=self.interpolation,
            velocity_offset=self.feed_forward != "none",
            torque=self._torque(),
            torque_offset=self.feed_forward == "torque",
            temperature=None if self.temperature is None else self.temperature.settings(),
            identity=self.identity.settings(),
            guarded=self.error_control == "guarding",
            incremental=self.encoder == "incremental",
            absolute=self._absolute() if self.encoder == "absolute" else None,
            homing=None if self.homing is None else self.homing.settings(),
            quick_stop_option=self.quick_stop_option,
            connection_lost=self.connection_lost,
            waived=frozenset(int(index, 16) for index in self.waive),
            own_pdos=self.pdos.own(),
            eds="" if self.eds is None else str(folder / self.eds),
            like=self.like,
        )

    def _torque(self) -> TorqueSettings | None:
        if self.rated_torque_nm is None:
            return None
        shaft_per_axis = self.gear * 2 * math.pi / self.feed if self.feed else self.gear
        return TorqueSettings(
            rated_mnm=round(1000 * self.rated_torque_nm),
            per_mille=1000 * self.direction / (shaft_per_axis * self.rated_torque_nm),
            rpm=shaft_per_axis * 30 / math.pi,
        )

    def _absolute(self) -> EncoderSettings:
        check = self.encoder_check
        sixteenth = self.counts_per_turn // 16
        return EncoderSettings(
            counts_per_turn=self.counts_per_turn,
            window=sixteenth if check.window is None else round(check.window * abs(self.counts_per_unit())),
            serial=None if check.serial is None else address_of(check.serial),
            status=None if check.status is None else address_of(check.status),
            battery_mask=check.battery_mask,
        )

    def units(self) -> DriveUnits:
        per_metre = abs(self.counts_per_unit()) if self.linear else 0.0
        return drive_units(self.velocity_unit, self.acceleration_unit, self.counts_per_turn, per_metre)

    def counts_per_unit(self) -> float:
        """Encoder counts per radian, or metre, of the axis, with its sign."""
        return self.direction * self.counts_per_turn * self.gear / (self.feed or 2 * math.pi)

    def way_per_rad(self) -> float:
        """Way of a linear axis per radian behind the gear; 1 for a rotary one."""
        return 1.0 if self.feed is None else self.feed / (2 * math.pi)
