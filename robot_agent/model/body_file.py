"""Schema of what a robot file says about bodies: capsules of links, and tools."""

from typing import Annotated

import numpy as np
from pydantic import BaseModel, Field

from cell.config.fields import Pose
from cell.config.units import LARGEST, STRICT, Length, NotNegativeLength, PositiveLength
from cell.geometry import from_xyz_abc
from robot_agent.model.description import Apart, Capsule, CapsuleBody, Part, Tool
from robot_agent.model.mass_file import Inertia, inertia_matrix

Point = tuple[Length, Length, Length]


class ToolCapsuleEntry(BaseModel):
    """Everything within `radius` of the line from `start` to `end`, in the flange frame."""

    model_config = STRICT
    start: Point = Field(description="in the flange's frame: [x, y, z]")
    end: Point = Field(description="in the flange's frame: [x, y, z]")
    radius: PositiveLength = Field(description="radius of the capsule")

    def capsule(self) -> Capsule:
        return Capsule(self.start, self.end, self.radius)


class CapsuleEntry(BaseModel):
    """A capsule that moves with a link: everything within `radius` of the line from `start` to `end`."""

    model_config = STRICT
    link: int = Field(ge=0, description="0 is the base, 1 the link behind J1, ... the last one the flange")
    start: Point = Field(description="in the link's frame: [x, y, z]")
    end: Point = Field(description="in the link's frame: [x, y, z]")
    radius: PositiveLength = Field(description="radius of the capsule")

    def body(self) -> CapsuleBody:
        return CapsuleBody(self.link, self.start, self.end, self.radius)


LinkName = int | str


class SelfCollisionEntry(BaseModel):
    """How the robot's own links keep away from each other; those that a joint holds together may touch."""

    model_config = STRICT
    margin: NotNegativeLength = Field(0.0, description="how near they may come; default 0")
    may_touch: tuple[tuple[LinkName, LinkName], ...] = Field(
        (),
        description="pairs that are not kept apart, [[2, flange], [1, tool]]: links, tool, or a part",
    )

    def apart(self) -> Apart:
        return Apart(self.margin, tuple((str(one), str(other)) for one, other in self.may_touch))


class ToolEntry(BaseModel):
    """A tool on the flange."""

    model_config = STRICT
    tcp: Pose = Field(description="pose of the TCP in the flange frame: X, Y, Z, A, B, C")
    mass_kg: Annotated[float, Field(ge=0, le=LARGEST)] = Field(0.0, description="mass [kg]")
    centre: Point = Field((0.0, 0.0, 0.0), description="centre of mass in the flange frame: [x, y, z]")
    inertia_kg_m2: Inertia = Field(
        (0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
        description="about the centre of mass, along the flange's axes: [xx, yy, zz, xy, xz, yz] in kg m^2",
    )
    capsules: Annotated[tuple[ToolCapsuleEntry, ...], Field(min_length=1)] = Field(description="the tool's body")

    def tool(self, name: str) -> Tool:
        p = self.tcp
        return Tool(
            name=name,
            pose_flange_tcp=from_xyz_abc(np.array([p.X, p.Y, p.Z, p.A, p.B, p.C])),
            mass_kg=self.mass_kg,
            centre_m=self.centre,
            inertia_kg_m2=inertia_matrix(self.inertia_kg_m2),
            capsules=tuple(capsule.capsule() for capsule in self.capsules),
        )


CarriedName = Annotated[str, Field(pattern=r"^[A-Za-z][A-Za-z0-9_]*$", description="a name for T or ATTACH")]


class PartCapsuleEntry(BaseModel):
    """Everything within `radius` of the line from `start` to `end`, in the frame of the TCP."""

    model_config = STRICT
    start: Point = Field(description="in the TCP's frame: [x, y, z]")
    end: Point = Field(description="in the TCP's frame: [x, y, z]")
    radius: PositiveLength = Field(description="radius of the capsule")

    def capsule(self) -> Capsule:
        return Capsule(self.start, self.end, self.radius)


class PartEntry(BaseModel):
    """A part as the gripper holds it; everything is in the frame of the TCP, without a tool in that of the flange."""

    model_config = STRICT
    mass_kg: Annotated[float, Field(ge=0, le=LARGEST)] = Field(0.0, description="mass [kg]")
    centre: Point = Field((0.0, 0.0, 0.0), description="centre of mass in the TCP's frame: [x, y, z]")
    inertia_kg_m2: Inertia = Field(
        (0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
        description="about the centre of mass, along the TCP's axes: [xx, yy, zz, xy, xz, yz] in kg m^2",
    )
    capsules: Annotated[tuple[PartCapsuleEntry, ...], Field(min_length=1)] = Field(description="the part's body")

    def part(self, name: str) -> Part:
        capsules = tuple(capsule.capsule() for capsule in self.capsules)
        return Part(name, self.mass_kg, self.centre, inertia_matrix(self.inertia_kg_m2), capsules)
