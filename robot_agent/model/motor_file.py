"""Schema of what a robot file says about its motors: one per axis, with the gear between them."""

from typing import Annotated

from pydantic import BaseModel, Field

from cell.config.units import STRICT, Positive, PositiveLength
from robot_agent.model.description import Motor


class MotorEntry(BaseModel):
    """A rotary servomotor with the names of its data sheet, and its gear; torques and speeds are the shaft's."""

    model_config = STRICT
    type: Annotated[str, Field(min_length=1)] = Field(description="the motor's type, for people")
    source: Annotated[str, Field(min_length=1)] = Field(description="where its numbers are from, for people")
    gear: Positive = Field(description="motor turns per turn of the axis, or of what drives a linear one")
    feed: PositiveLength | None = Field(None, description="way of a linear axis per turn behind the gear")
    pole_pairs: int = Field(ge=1, le=1000, description="pairs of poles: half the poles of a data sheet")
    rated_speed_rpm: Positive = Field(description="speed at the rated torque [1/min]")
    maximum_speed_rpm: Positive = Field(description="highest speed on its supply [1/min]")
    rated_torque_nm: Positive = Field(description="torque for unlimited time at the rated speed [Nm]")
    peak_torque_nm: Positive = Field(description="torque for a moment [Nm]; more of it harms the magnets")
    torque_constant_nm_a: Positive = Field(description="torque per ampere rms [Nm/A]")
    inertia_kg_m2: Positive = Field(description="inertia of the rotor with its brake [kg m^2]")

    def motor(self) -> Motor:
        return Motor(
            type=self.type,
            source=self.source,
            gear=self.gear,
            feed_m=self.feed,
            pole_pairs=self.pole_pairs,
            rated_speed_rpm=self.rated_speed_rpm,
            maximum_speed_rpm=self.maximum_speed_rpm,
            rated_torque_nm=self.rated_torque_nm,
            peak_torque_nm=self.peak_torque_nm,
            torque_constant_nm_a=self.torque_constant_nm_a,
            inertia_kg_m2=self.inertia_kg_m2,
        )
