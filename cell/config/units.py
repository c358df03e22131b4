"""Units: a file declares them once, its values become SI while they are validated."""

import math
from dataclasses import dataclass
from typing import Annotated, Literal

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, ValidationInfo

STRICT = ConfigDict(extra="forbid", strict=True, frozen=True, allow_inf_nan=False)
"""Configuration of every schema: unknown keys and wrong types are refused, numbers are finite."""


class Units(BaseModel):
    """The units of all lengths and angles in the file; speeds are per second, accelerations per second squared."""

    model_config = STRICT
    length: Literal["mm", "m"] = Field(description="unit of lengths: mm or m")
    angle: Literal["deg", "rad"] = Field(description="unit of angles: deg or rad")


@dataclass(frozen=True, slots=True)
class ToSI:
    """From the file's units to metres and radians; the context in which a file is validated."""

    per_metre: float = 1.0
    """Divisor of lengths: 1000 mm are exactly 1 m."""
    angle: float = 1.0
    """Factor of angles."""

    @classmethod
    def of(cls, declared: object) -> "ToSI":
        """From the raw `units` of a file; what is not declared properly counts as SI, it is reported elsewhere."""
        units = declared if isinstance(declared, dict) else {}
        return cls(
            per_metre=1000.0 if units.get("length") == "mm" else 1.0,
            angle=math.pi / 180 if units.get("angle") == "deg" else 1.0,
        )


def _length(value: float, info: ValidationInfo) -> float:
    return value / info.context.per_metre if isinstance(info.context, ToSI) else value


def _angle(value: float, info: ValidationInfo) -> float:
    return value * info.context.angle if isinstance(info.context, ToSI) else value


def _not_tiny(value: float) -> float:
    if value < SMALLEST:
        raise ValueError(f"{SMALLEST:g} or more")
    return value


# Bounds far beyond any machine, so that no product or square of values leaves the range of a float.
LARGEST = 1e9
SMALLEST = 1e-9
Number = Annotated[float, Field(ge=-LARGEST, le=LARGEST)]
"""A number without a unit, or with one that depends on other values of the file."""
Positive = Annotated[float, Field(gt=0, le=LARGEST), AfterValidator(_not_tiny)]


def in_si(value: float, linear: bool, info: ValidationInfo) -> float:
    """What is a length where a joint or an axis slides, and an angle where it turns, in m or rad."""
    return _length(value, info) if linear else _angle(value, info)


Length = Annotated[Number, AfterValidator(_length)]
"""A length, or a speed, acceleration or jerk along a path, in the file's unit; SI after validation."""
Angle = Annotated[Number, AfterValidator(_angle)]
"""An angle, or an angular speed, acceleration or jerk, in the file's unit; SI after validation."""
PositiveLength = Annotated[Positive, AfterValidator(_length)]
NotNegativeLength = Annotated[float, Field(ge=0, le=LARGEST), AfterValidator(_length)]
PositiveAngle = Annotated[Positive, AfterValidator(_angle)]
Milliseconds = Annotated[float, Field(gt=0, le=60_000), AfterValidator(_not_tiny)]
Seconds = Annotated[float, Field(gt=0, le=3600), AfterValidator(_not_tiny)]
