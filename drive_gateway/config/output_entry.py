"""Schema of a digital output in a drives file, and what it says as settings."""

from collections.abc import Iterable
from typing import Annotated, Literal

from pydantic import BaseModel, Field

from cell.config.units import STRICT
from drive_gateway.config.settings import OutputSettings

LONGEST_LEAD_S = 0.08
"""A block's nominal part is at least 0.1 s long, and an event is told no sooner."""


class OutputEntry(BaseModel):
    """A bit of 60FEh that programs can switch where the motion passes a place."""

    model_config = STRICT
    axis: Annotated[str, Field(min_length=1)] = Field(description="the axis whose drive has the output")
    bit: int = Field(ge=0, le=31, description="bit of 60FEh:01")
    lead_s: float = Field(
        default=0.0,
        ge=0,
        le=LONGEST_LEAD_S,
        description="how long what hangs on it takes: it is switched so much before its place, in whole cycles",
    )
    at_stop: Literal["off", "keep"] = Field(
        description="off or keep: what becomes of it when the robot is stopped, or its blocks stop coming"
    )

    def settings(self, name: str) -> OutputSettings:
        return OutputSettings(name, self.axis, self.bit, self.lead_s, self.at_stop == "keep")


def mask_of(outputs: Iterable[OutputEntry], axis: str) -> int:
    """The bits of 60FEh that are outputs of one axis' drive."""
    mask = 0
    for output in outputs:
        if output.axis == axis:
            mask |= 1 << output.bit
    return mask
