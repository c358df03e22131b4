"""Schema of the file beside a drives file that says how its drives are simulated, and what it says."""

from typing import Annotated, Literal

from pydantic import BaseModel, Field

from cell.config.fields import Name
from cell.config.units import STRICT, Angle, Number, PositiveLength, ToSI, Units
from drive_gateway.config.axis_entry import AxisEntry
from drive_gateway.config.drives_file import AxisName, DrivesFile
from drive_gateway.config.settings import MOTOR_SPEED_RESERVE
from drive_gateway.sim.axis.axis_data import AxisData
from drive_gateway.sim.axis.dc_bus import DcBusData
from drive_gateway.sim.axis.encoder import EncoderData
from drive_gateway.sim.axis.gains import ServoData
from drive_gateway.sim.axis.load import Load, constant, pendulum, stops, together
from drive_gateway.sim.axis.mechanics import LoadData
from drive_gateway.sim.axis.motor_data import MOTORS
from drive_gateway.sim.config.simulation import LAG_S, Level, Simulation

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
    """The DC bus that all drives of this file's bus share."""

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

    def data(self, axis: AxisEntry) -> AxisData:
        """With what the axis itself says."""
        torques = [] if self.gravity is None else [self.gravity.load()]
        torques += [] if self.stops is None else [stops(*self.stops)]
        torques += [constant(self.constant_nm)] if self.constant_nm or not torques else []
        return AxisData(
            motor=MOTORS[self.motor],
            gear=axis.gear,
            direction=axis.direction,
            offset=axis.offset / axis.way_per_rad(),
            load=LoadData(
                self.inertia_kg_m2, self.coulomb_nm, self.viscous_nm_s, self.stiffness_nm_rad, self.damping_nm_s
            ),
            torque=together(*torques),
            encoder=EncoderData(axis.counts_per_turn, noise_counts=self.noise_counts),
            servo=ServoData(self.servo.speed_hz, self.servo.reset_s, self.servo.position_per_s),
            top_speed=MOTOR_SPEED_RESERVE * axis.speed * axis.gear / axis.way_per_rad(),
            seed=axis.node + 0x80 * (axis.axis - 1),
        )


class SimulationFile(BaseModel):
    """How the drives of the drives file beside it are simulated. Real drives never see it, and it may be left out."""

    model_config = STRICT
    units: Units = Field(description="units of lengths and angles: {length: mm, angle: deg}")
    level: Literal["fast", "full"] = Field(
        default="fast", description="fast: position loop only; full: motor, load, encoder, servo loop, power"
    )
    lag_s: Annotated[float, Field(ge=0, le=1)] | None = Field(
        default=None,
        description=f"[s] lag of a drive behind its set points; without it {LAG_S:g}, or less where a following_window "
        "is tight",
    )
    wire_time: bool = Field(default=False, description="frames take their time on the wire, at the bus' bit rate")
    starts: dict[Name, dict[AxisName, Number]] = Field(
        default={},
        description="where axes stand when their drives are switched on, by robot and axis; others at the home "
        "position of the robot's file",
    )
    masses: Literal["axes", "robot"] = Field(
        default="axes",
        description="full level, axes: each has the load said here; robot: they carry the masses of the robot file",
    )
    dc_bus: DcBusEntry = Field(default=DcBusEntry(), description="the DC bus that the drives share")
    axes: dict[Name, dict[AxisName, SimulatedAxisEntry]] = Field(
        default={}, description="motor and load by robot and axis; the full level needs all of them"
    )

    def simulation(self, drives: DrivesFile) -> Simulation:
        """The same in SI, for the drives of a file; only for files without problems."""
        return Simulation(
            lag_s=lag_of(drives) if self.lag_s is None else self.lag_s,
            starts=self.places(drives),
            level=Level(self.level),
            wire_time=self.wire_time,
            dc_bus=self.dc_bus.data(),
            axes={
                (robot, name): entry.data(drives.robots[robot].axes[name])
                for robot, entries in self.axes.items()
                for name, entry in entries.items()
            },
            whole_robots=self.masses == "robot",
        )

    def places(self, drives: DrivesFile) -> dict[tuple[str, str], float]:
        """[rad or m] `starts` of axes that the drives file has; there it says which of them slide."""
        to_si = ToSI.of(self.units.model_dump())
        return {
            (robot, name): place / to_si.per_metre if drives.robots[robot].axes[name].linear else place * to_si.angle
            for robot, places in self.starts.items()
            for name, place in places.items()
            if robot in drives.robots and name in drives.robots[robot].axes
        }


def lag_of(drives: DrivesFile) -> float:
    """[s] Lag of drives of which nothing is said: at full speed it takes up to 3/4 of each axis' following window."""
    axes = [axis for robot in drives.robots.values() for axis in robot.axes.values()]
    return min([LAG_S, *(0.75 * axis.following_window / axis.speed for axis in axes)])
