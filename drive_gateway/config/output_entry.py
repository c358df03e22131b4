"""Schema of the digital outputs and named inputs of a robot in a drives file, and what they say as settings."""

from collections.abc import Iterable
from typing import Annotated, Literal

from pydantic import BaseModel, Field

from cell.config.units import STRICT
from drive_gateway.config.settings import NamedInput, OutputSettings

LONGEST_LEAD_S = 0.08
"""A block's nominal part is at least 0.1 s long, and an event is told no sooner."""

Where = Annotated[str, Field(min_length=1)]


class OutputEntry(BaseModel):
    """A bit of a drive's 60FEh or of an I/O node that programs can switch where the motion passes a place."""

    model_config = STRICT
    axis: Where | None = Field(default=None, description="the axis whose drive has the output; else `io`")
    io: Where | None = Field(default=None, description="the I/O node that has the output, one of `io_nodes`")
    bit: int = Field(
        ge=0, le=63, description="bit of 60FEh:01, 0 to 31; of an I/O node from the first bit of its first output byte"
    )
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
        return OutputSettings(name, self.axis or "", self.bit, self.lead_s, self.at_stop == "keep", self.io or "")


class InputEntry(BaseModel):
    """A bit of a drive's 60FDh or of an I/O node that is told by its name."""

    model_config = STRICT
    axis: Where | None = Field(default=None, description="the axis whose drive has the input; else `io`")
    io: Where | None = Field(default=None, description="the I/O node that has the input, one of `io_nodes`")
    bit: int = Field(
        ge=0, le=63, description="bit of 60FDh, 0 to 31; of an I/O node from the first bit of its first input byte"
    )

    def settings(self, name: str) -> NamedInput:
        return NamedInput(name, self.axis or "", self.bit, self.io or "")


def mask_of(bits: Iterable[OutputEntry] | Iterable[InputEntry], axis: str) -> int:
    """The bits of 60FEh, or of 60FDh, that are outputs, or named inputs, of one axis' drive."""
    mask = 0
    for item in bits:
        if item.axis == axis:
            mask |= 1 << item.bit
    return mask
