"""Schema of the robot file, and what it says as a description."""

from typing import Annotated

import numpy as np
from pydantic import BaseModel, Field

from cell.config.units import STRICT, Angle, Length, PositiveAngle, PositiveLength, Units
from robot_agent.model.description import CapsuleBody, Family, JointLimits, PathLimits, RobotDescription

JointName = Annotated[str, Field(pattern=r"^J[1-9]$", description="a joint, J1, J2, ... from the base on")]
Point = tuple[Length, Length, Length]


class Geometry(BaseModel):
    """Lengths of a six-axis arm, named by the joint that the link leads to and the axis along which it is measured."""

    model_config = STRICT
    a1z: Length = Field(description="base to axis 1, along Z")
    a2x: Length = Field(description="axis 1 to axis 2, along X")
    a2z: Length = Field(description="axis 1 to axis 2, along Z")
    a3z: PositiveLength = Field(description="upper arm: axis 2 to axis 3, along Z")
    a4x: Length = Field(description="axis 3 to axis 4, along X")
    a4z: Length = Field(description="axis 3 to axis 4, along Z")
    a5x: Length = Field(description="axis 4 to the wrist centre, along X")
    a6x: Length = Field(description="wrist centre to the flange, along X")


class JointEntry(BaseModel):
    """Limits of one joint; `ramp_factor` times acceleration and jerk is left for braking."""

    model_config = STRICT
    position: tuple[Angle, Angle] = Field(description="lower and upper limit: [lower, upper]")
    speed: PositiveAngle = Field(description="largest speed")
    acceleration: PositiveAngle = Field(description="largest planned acceleration")
    jerk: PositiveAngle = Field(description="largest planned jerk")


class PathEntry(BaseModel):
    """Default and largest values along a path."""

    model_config = STRICT
    speed: PositiveLength = Field(description="speed of the flange")
    acceleration: PositiveLength = Field(description="acceleration of the flange along its path")
    jerk: PositiveLength = Field(description="jerk of the flange along its path")
    angular_speed: PositiveAngle = Field(description="angular speed of the flange")
    angular_acceleration: PositiveAngle = Field(description="angular acceleration of the flange")
    angular_jerk: PositiveAngle = Field(description="angular jerk of the flange")

    def limits(self) -> PathLimits:
        return PathLimits(
            self.speed, self.acceleration, self.jerk, self.angular_speed, self.angular_acceleration, self.angular_jerk
        )


class CapsuleEntry(BaseModel):
    """A capsule that moves with a link: everything within `radius` of the line from `start` to `end`."""

    model_config = STRICT
    link: int = Field(ge=0, description="0 is the base, 1 the link behind J1, ... the last one the flange")
    start: Point = Field(description="in the link's frame: [x, y, z]")
    end: Point = Field(description="in the link's frame: [x, y, z]")
    radius: PositiveLength = Field(description="radius of the capsule")


class RobotFile(BaseModel):
    """One robot model."""

    model_config = STRICT
    name: Annotated[str, Field(min_length=1)] = Field(description="the model's name, for people")
    family: Annotated[Family, Field(strict=False)] = Field(description="kinematic family: six_axis")
    units: Units = Field(description="units of lengths and angles: {length: mm, angle: deg}")
    geometry: Geometry = Field(description="the family's lengths: a1z, a2x, a2z, a3z, a4x, a4z, a5x, a6x")
    joints: dict[JointName, JointEntry] = Field(description="limits of the joints J1, J2, ... in this order")
    ramp_factor: float = Field(
        ge=1.25, le=4, description="braking ramps may use this many times acceleration and jerk; 1.25 to 4"
    )
    path: PathEntry = Field(description="default and largest speeds along a path")
    home: dict[JointName, Angle] = Field(description="home position of every joint")
    capsules: Annotated[tuple[CapsuleEntry, ...], Field(min_length=1)] = Field(description="the robot's body")

    def description(self) -> RobotDescription:
        """The same in SI; only for a file without problems."""
        joints = list(self.joints.values())
        limits = JointLimits(
            position=np.array([joint.position for joint in joints]),
            velocity=np.array([joint.speed for joint in joints]),
            acceleration=np.array([joint.acceleration for joint in joints]),
            jerk=np.array([joint.jerk for joint in joints]),
            ramp_factor=self.ramp_factor,
        )
        return RobotDescription(
            name=self.name,
            family=self.family,
            geometry=self.geometry.model_dump(),
            joint_names=tuple(self.joints),
            limits=limits,
            path=self.path.limits(),
            home=np.array([self.home[joint] for joint in self.joints]),
            capsules=tuple(CapsuleBody(c.link, c.start, c.end, c.radius) for c in self.capsules),
        )
