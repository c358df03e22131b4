"""Schema of the robot file, and what it says as a description."""

from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any, Literal, Self

import numpy as np
from pydantic import BaseModel, Field, ValidationInfo, field_validator, model_validator

from cell.config.units import STRICT, Number, Positive, PositiveAngle, PositiveLength, Units, in_si
from robot_agent.model.body_file import CapsuleEntry, CarriedName, PartEntry, SelfCollisionEntry, ToolEntry
from robot_agent.model.description import (
    JERK_PER_ACCELERATION,
    JointLimits,
    Mounted,
    PathSpeeds,
    ProfileKind,
    RobotDescription,
    Shaping,
    UrdfSource,
)
from robot_agent.model.mass_file import MassEntry
from robot_agent.model.motor_file import MotorEntry

JointName = Annotated[str, Field(pattern=r"^J[1-9]$", description="a joint, J1, J2, ... from the base on")]


_DEFAULT_JERK = f"left out: {JERK_PER_ACCELERATION:g} times the acceleration per second"


def _jerk_of(acceleration: str) -> Callable[[dict[str, Any]], float]:
    """The default of a jerk: from the acceleration above it, which is in SI by then."""
    return lambda above: JERK_PER_ACCELERATION * above.get(acceleration, 1.0)


class JointEntry(BaseModel):
    """Limits of one joint: angles, or lengths where it slides; `ramp_factor` leaves more for braking."""

    model_config = STRICT
    type: Literal["rotary", "linear"] = Field("rotary", description="rotary, or linear for a joint that slides")
    position: tuple[Number, Number] = Field(description="lower and upper limit: [lower, upper]")
    speed: Positive = Field(description="largest speed")
    acceleration: Positive = Field(description="largest planned acceleration")
    acceleration_down: Positive | None = Field(
        None, description="the same towards lower values of the joint; left out: as towards higher ones"
    )
    jerk: Positive = Field(
        default_factory=_jerk_of("acceleration"), description=f"largest planned jerk; {_DEFAULT_JERK}"
    )

    @property
    def linear(self) -> bool:
        return self.type == "linear"

    @property
    def accelerations(self) -> tuple[float, float]:
        """Towards lower and towards higher values."""
        return self.acceleration_down or self.acceleration, self.acceleration

    @field_validator("position", "speed", "acceleration", "acceleration_down", "jerk")
    @classmethod
    def _si(cls, value: Any, info: ValidationInfo) -> Any:
        linear = info.data.get("type") == "linear"
        if value is None:
            return None
        if isinstance(value, tuple):
            return tuple(in_si(part, linear, info) for part in value)
        return in_si(value, linear, info)


class PathEntry(BaseModel):
    """Default and largest values along a path."""

    model_config = STRICT
    speed: PositiveLength = Field(description="speed of the TCP")
    acceleration: PositiveLength = Field(description="acceleration of the TCP along its path")
    jerk: PositiveLength = Field(
        default_factory=_jerk_of("acceleration"), description=f"jerk of the TCP along its path; {_DEFAULT_JERK}"
    )
    angular_speed: PositiveAngle = Field(description="angular speed of the TCP")
    angular_acceleration: PositiveAngle = Field(description="angular acceleration of the TCP")
    angular_jerk: PositiveAngle = Field(
        default_factory=_jerk_of("angular_acceleration"), description=f"angular jerk of the TCP; {_DEFAULT_JERK}"
    )

    def limits(self) -> PathSpeeds:
        return PathSpeeds(
            self.speed, self.acceleration, self.jerk, self.angular_speed, self.angular_acceleration, self.angular_jerk
        )


class MotionEntry(BaseModel):
    """The shape of motions; what is left out is as fast as the limits allow."""

    model_config = STRICT
    profile: Annotated[ProfileKind, Field(strict=False)] = Field(
        ProfileKind.S_CURVE, description=f"profile of the speed: {', '.join(kind.value for kind in ProfileKind)}"
    )
    filter_ms: float = Field(
        0.0,
        ge=0,
        le=1000,
        description="window of the Gaussian filter on every axis [ms]; 0: none; motions last longer by it",
    )
    blend_mm: float = Field(
        0.1, gt=0, le=1, description="how far blending a step of the curvature may leave the programmed curve [mm]"
    )

    @model_validator(mode="after")
    def _smooth(self) -> Self:
        if self.profile is ProfileKind.TRAPEZOIDAL and self.filter_ms == 0.0:
            raise ValueError("trapezoidal only together with filter_ms above 0: its acceleration steps")
        return self

    def shaping(self) -> Shaping:
        return Shaping(self.profile, self.filter_ms / 1000.0, self.blend_mm / 1000.0)


class RobotFile(BaseModel):
    """What the files of all families have in common."""

    model_config = STRICT
    name: Annotated[str, Field(min_length=1)] = Field(description="the model's name, for people")
    family: str = Field(description="kinematic family")
    units: Units = Field(description="units of lengths and angles: {length: mm, angle: deg}")
    joints: dict[JointName, JointEntry] = Field(description="limits of the joints J1, J2, ... in this order")
    coupling: dict[JointName, dict[JointName, Number]] = Field(
        {}, description="mechanical coupling: J5: {J4: 0.02} turns J5 by 0.02 of what axis 4 turns"
    )
    ramp_factor: float = Field(
        ge=1.25, le=4, description="braking ramps may use this many times acceleration and jerk; 1.25 to 4"
    )
    motors: dict[JointName, MotorEntry] = Field(
        {}, description="motors by axis, one for each joint; left out: nothing is known of them"
    )
    masses: tuple[MassEntry, ...] = Field(
        (), description="masses of the links, for the torques of the axes; left out: nothing is known of them"
    )
    path: PathEntry = Field(description="default and largest speeds along a path")
    motion: MotionEntry = Field(
        default_factory=lambda: MotionEntry.model_validate({}),
        description="profile and filter; left out: S-curve, no filter",
    )
    home: dict[JointName, Number] = Field(description="home position of every joint")
    capsules: Annotated[tuple[CapsuleEntry, ...], Field(min_length=1)] = Field(description="the robot's body")
    self_collision: SelfCollisionEntry = Field(
        default_factory=lambda: SelfCollisionEntry.model_validate({}),
        description="how its own links keep away from each other; left out: all but those that a joint holds together",
    )
    tools: dict[CarriedName, ToolEntry] = Field({}, description="tools that T in its program may name")
    tool: str | None = Field(None, description="the tool on the flange when its agent starts; left out: none")
    parts: dict[CarriedName, PartEntry] = Field(
        {}, description="parts that ATTACH in its program may name, as it holds them"
    )

    @field_validator("home")
    @classmethod
    def _home_in_si(cls, home: dict[str, float], info: ValidationInfo) -> dict[str, float]:
        joints = info.data.get("joints", {})
        return {name: in_si(value, name in joints and joints[name].linear, info) for name, value in home.items()}

    @classmethod
    def stand_in_geometry(cls) -> dict[str, Any]:
        """A geometry in place of one that is wrong, so that the rest of the file can be checked."""
        return {}

    def lengths(self) -> dict[str, float]:
        """The family's lengths [m] by name."""
        return {}

    def urdf(self) -> UrdfSource | None:
        """Where the chain is, as the file says it, for a family whose lengths do not."""
        return None

    def coupling_matrix(self) -> np.ndarray | None:
        """`(n, n)` joints per axis."""
        if not self.coupling:
            return None
        names = list(self.joints)
        matrix = np.eye(len(names))
        for joint, sources in self.coupling.items():
            for source, ratio in sources.items():
                matrix[names.index(joint), names.index(source)] = ratio
        return matrix

    def description(self, folder: Path) -> RobotDescription:
        """The same in SI; only for a file without problems. Files that it names are relative to `folder`."""
        joints, urdf = list(self.joints.values()), self.urdf()
        limits = JointLimits(
            position=np.array([joint.position for joint in joints]),
            velocity=np.array([joint.speed for joint in joints]),
            acceleration=np.array([joint.acceleration for joint in joints]),
            acceleration_down=np.array([joint.accelerations[0] for joint in joints]),
            jerk=np.array([joint.jerk for joint in joints]),
            ramp_factor=self.ramp_factor,
        )
        return RobotDescription(
            name=self.name,
            family=self.family,
            geometry=self.lengths(),
            joint_names=tuple(self.joints),
            limits=limits,
            path=self.path.limits(),
            home=np.array([self.home[joint] for joint in self.joints]),
            capsules=tuple(capsule.body() for capsule in self.capsules),
            linear=tuple(joint.linear for joint in joints),
            coupling=self.coupling_matrix(),
            tools={name: tool.tool(name) for name, tool in self.tools.items()},
            mounted=Mounted(() if self.tool is None else (self.tool,)),
            parts={name: part.part(name) for name, part in self.parts.items()},
            urdf=None if urdf is None else UrdfSource(folder / urdf.file, urdf.flange),
            motors={axis: motor.motor() for axis, motor in self.motors.items()},
            masses=tuple(entry.mass() for entry in self.masses),
            shaping=self.motion.shaping(),
            apart=self.self_collision.apart(),
        )
