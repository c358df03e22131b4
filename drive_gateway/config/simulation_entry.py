"""Schema of the part of a drives file that says how its drives are simulated."""

from typing import Annotated, Literal

from pydantic import BaseModel, Field

from cell.config.fields import Name
from cell.config.units import STRICT, Angle, PositiveLength
from drive_gateway.sim.axis.axis_data import AxisData
from drive_gateway.sim.axis.dc_bus import DcBusData
from drive_gateway.sim.axis.encoder import EncoderData
from drive_gateway.sim.axis.gains import ServoData
from drive_gateway.sim.axis.load import Load, constant, pendulum, stops, together
from drive_gateway.sim.axis.mechanics import LoadData
from drive_gateway.sim.axis.motor_data import MOTORS

AxisName = Annotated[str, Field(pattern=r"^J[1-9]$", description="an axis, named for its joint: J1, J2, ...")]
Positive = Annotated[float, Field(gt=0, le=1e9)]
NotNegative = Annotated[float, Field(ge=0, le=1e9)]
Torque = Annotated[float, Field(ge=-1e9, le=1e9)]


class GravityEntry(BaseModel):
    """A mass on an arm: m g l sin."""

    model_config = STRICT
    mass_kg: Positive = Field(description="mass [kg]")
    length: PositiveLength = Field(description="from the axis to the mass")
    hanging: Angle = Field(description="axis position at which the mass hangs down")

    def load(self) -> Load:
        return pendulum(self.mass_kg, self.length, self.hanging)


class ServoEntry(BaseModel):
    """What a commissioning engineer chooses of the servo loop."""

    model_config = STRICT
    speed_hz: Annotated[float, Field(ge=1, le=300)] = Field(default=50.0, description="bandwidth of the speed loop")
    reset_s: Annotated[float, Field(ge=1e-3, le=10)] = Field(default=0.02, description="reset time of the speed loop")
    position_per_s: Annotated[float, Field(ge=1, le=1000)] = Field(
        default=30.0, description="gain of the position loop [1/s]"
    )


class DcBusEntry(BaseModel):
    """The DC bus that all drives of this file share."""

    model_config = STRICT
    supply_v: Positive = Field(default=DcBusData().supply_v, description="voltage of the supply [V]")
    capacitance_f: Positive = Field(default=DcBusData().capacitance_f, description="of all capacitors [F]")
    chopper_v: Positive = Field(default=DcBusData().chopper_v, description="where the braking resistor begins [V]")
    chopper_ohm: Positive = Field(default=DcBusData().chopper_ohm, description="the braking resistor [Ohm]")
    low_v: Positive = Field(default=DcBusData().low_v, description="below this drives open their bridge [V]")
    high_v: Positive = Field(default=DcBusData().high_v, description="above this drives open their bridge [V]")

    def data(self) -> DcBusData:
        return DcBusData(
            supply_v=self.supply_v,
            capacitance_f=self.capacitance_f,
            chopper_v=self.chopper_v,
            chopper_ohm=self.chopper_ohm,
            low_v=self.low_v,
            high_v=self.high_v,
        )


class SimulatedAxisEntry(BaseModel):
    """Motor and load of one axis; the load is behind the gear."""

    model_config = STRICT
    motor: str = Field(description="a motor preset", json_schema_extra={"enum": list(MOTORS)})
    inertia_kg_m2: Positive = Field(description="inertia of the load [kg m^2]")
    coulomb_nm: NotNegative = Field(default=0.0, description="dry friction [Nm]")
    viscous_nm_s: NotNegative = Field(default=0.0, description="friction that grows with the speed [Nm s/rad]")
    stiffness_nm_rad: Positive | None = Field(
        default=None, description="between gear and load [Nm/rad]; without it they are one mass"
    )
    damping_nm_s: NotNegative = Field(default=0.0, description="beside the stiffness [Nm s/rad]")
    constant_nm: Torque = Field(default=0.0, description="constant torque on the axis [Nm]")
    gravity: GravityEntry | None = Field(default=None, description="a mass on an arm")
    stops: tuple[Angle, Angle] | None = Field(
        default=None, description="axis positions of two springy stops, or of what stands in the axis' way"
    )
    noise_counts: NotNegative = Field(default=0.0, description="standard deviation of one encoder reading [counts]")
    servo: ServoEntry = Field(default=ServoEntry(), description="the drive's servo loop")

    def data(
        self, *, gear: float, direction: int, counts_per_turn: int, offset: float, top_speed: float, seed: int
    ) -> AxisData:
        """With what the axis itself says: `offset` [rad] behind the gear, `top_speed` [rad/s] of the shaft."""
        torques = [] if self.gravity is None else [self.gravity.load()]
        torques += [] if self.stops is None else [stops(*self.stops)]
        torques += [constant(self.constant_nm)] if self.constant_nm or not torques else []
        return AxisData(
            motor=MOTORS[self.motor],
            gear=gear,
            direction=direction,
            offset=offset,
            load=LoadData(
                self.inertia_kg_m2, self.coulomb_nm, self.viscous_nm_s, self.stiffness_nm_rad, self.damping_nm_s
            ),
            torque=together(*torques),
            encoder=EncoderData(counts_per_turn, noise_counts=self.noise_counts),
            servo=ServoData(self.servo.speed_hz, self.servo.reset_s, self.servo.position_per_s),
            top_speed=top_speed,
            seed=seed,
        )


class SimulationEntry(BaseModel):
    """How the drives are simulated; real drives do not look at it."""

    model_config = STRICT
    level: Literal["fast", "full"] = Field(
        default="fast", description="fast: position loop only; full: motor, load, encoder, servo loop, power"
    )
    masses: Literal["axes", "robot"] = Field(
        default="axes",
        description="full level, axes: each has the load said here; robot: they carry the masses of the robot file",
    )
    wire_time: bool = Field(default=False, description="frames take their time on the wire, at the bus' bit rate")
    dc_bus: DcBusEntry = Field(default=DcBusEntry(), description="the DC bus that the drives share")
    axes: dict[Name, dict[AxisName, SimulatedAxisEntry]] = Field(
        default={}, description="motor and load by robot and axis; the full level needs all of them"
    )
