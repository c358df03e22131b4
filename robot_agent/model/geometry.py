"""Lengths of each family as a robot file gives them, named by the joint that a link leads to and the axis along it."""

from pydantic import BaseModel, Field

from cell.config.units import STRICT, Length, PositiveLength


class SixAxisGeometry(BaseModel):
    """Lengths of a six-axis arm with a spherical wrist; at joints zero upper arm up, forearm and flange along +X."""

    model_config = STRICT
    a1z: Length = Field(description="base to axis 1, along Z")
    a2x: Length = Field(description="axis 1 to axis 2, along X")
    a2z: Length = Field(description="axis 1 to axis 2, along Z")
    a3z: PositiveLength = Field(description="upper arm: axis 2 to axis 3, along Z")
    a4x: Length = Field(description="axis 3 to axis 4, along X")
    a4z: Length = Field(description="axis 3 to axis 4, along Z")
    a5x: Length = Field(description="axis 4 to the wrist centre, along X")
    a6x: Length = Field(description="wrist centre to the flange, along X")


class CobotGeometry(BaseModel):
    """Lengths of a cobot with three parallel axes; at joints zero the arm along +X, the flange looks along +Y."""

    model_config = STRICT
    a1y: Length = Field(description="axis 1 to axis 2, along Y")
    a1z: Length = Field(description="base to axis 2, along Z")
    a2x: PositiveLength = Field(description="upper arm: axis 2 to axis 3, along X")
    a2y: Length = Field(description="axis 2 to axis 3, along Y; usually negative")
    a3x: PositiveLength = Field(description="forearm: axis 3 to axis 4, along X")
    a3y: Length = Field(description="axis 3 to axis 4, along Y")
    a4z: Length = Field(description="axis 4 to axis 6, along Z; usually negative")
    a5y: Length = Field(description="axis 5 to the flange, along Y")


class ScaraGeometry(BaseModel):
    """Lengths of a SCARA; at joints zero both arms along +X. The base frame is at link 1, its column is below."""

    model_config = STRICT
    a1x: PositiveLength = Field(description="arm 1: axis 1 to axis 2, along X")
    a1z: Length = Field(description="base to arm 2, along Z")
    a2x: PositiveLength = Field(description="arm 2: axis 2 to the spindle, along X")
    a2z: Length = Field(description="arm 2 to the end of the spindle at J3 = 0, along Z; usually negative")
    a4z: Length = Field(description="lift of the spindle per turn of J4; 0 without a screw")


class PalletizerGeometry(BaseModel):
    """Lengths of a palletizer; at joints zero upper arm up, forearm along +X, the hand always level."""

    model_config = STRICT
    a1x: Length = Field(description="axis 1 to axis 2, along X")
    a1z: Length = Field(description="base to axis 2, along Z")
    a2z: PositiveLength = Field(description="upper arm: axis 2 to axis 3, along Z")
    a3x: PositiveLength = Field(description="forearm: axis 3 to the hand, along X")
    a4x: Length = Field(description="hand to the flange, along X")
    a4z: Length = Field(description="hand to the flange, along Z; usually negative")


class DeltaGeometry(BaseModel):
    """Lengths of a delta robot; the arms are at 0, 120 and 240 degrees from +X."""

    model_config = STRICT
    r: PositiveLength = Field(description="centre of the base to the axes of the arms")
    h: PositiveLength = Field(description="arms: axis to elbow")
    k: PositiveLength = Field(description="rods: elbow to platform")
    s: PositiveLength = Field(description="centre of the platform to the rods")
    t: Length = Field(description="centre of the platform down to the flange")


class GantryGeometry(BaseModel):
    """Length of a gantry with a wrist Z Y Z; its slides are along -Y, +X and +Z of the base."""

    model_config = STRICT
    a6z: Length = Field(description="wrist centre to the flange, along Z")


class UrdfGeometry(BaseModel):
    """Where the chain of joints of any other robot is."""

    model_config = STRICT
    file: str = Field(min_length=1, description="the URDF file, relative to this one")
    flange: str | None = Field(None, description="the link that is the flange; left out: the one link without a child")
