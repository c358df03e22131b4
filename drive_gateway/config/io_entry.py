"""Schema of an I/O node in a drives file, and what it says as settings."""

from collections.abc import Mapping
from typing import Literal

from pydantic import BaseModel, Field

from cell.config.fields import Name
from cell.config.units import STRICT
from drive_gateway.canopen.emcy import Meaning
from drive_gateway.canopen.io_map import MOST_BYTES
from drive_gateway.config.axis_entry import IdentityEntry
from drive_gateway.config.settings import IoSettings


class IoNodeEntry(BaseModel):
    """A node with digital inputs and outputs (CiA 401), for the robots of this bus."""

    model_config = STRICT
    node: int = Field(ge=1, le=127, description="CANopen node-ID, another than gateway_node")
    input_bytes: int = Field(default=0, ge=0, le=MOST_BYTES, description="bytes of inputs: sub-indices of 6000h")
    output_bytes: int = Field(default=0, ge=0, le=MOST_BYTES, description="bytes of outputs: sub-indices of 6200h")
    on_loss: Literal["stop", "tell"] = Field(
        default="stop",
        description="when it falls silent: stop the robots that name an input or output of it, or only tell",
    )
    identity: IdentityEntry = Field(default=IdentityEntry(), description="which device must be at this node")
    error_control: Literal["heartbeat", "guarding"] = Field(
        default="heartbeat", description="how node and gateway watch each other; guarding needs remote frames"
    )
    emergencies: Name | None = Field(default=None, description="its type of node in `emergencies` of this file")
    waive: tuple[Literal["1016", "6206", "6207"], ...] = Field(
        default=(), max_length=3, description="objects that this node may lack; each costs something that is told"
    )

    def settings(self, name: str, kept: int, emergencies: Mapping[int, Meaning]) -> IoSettings:
        """`kept`: bits of the outputs that stay as they are when their robot is stopped."""
        return IoSettings(
            name=name,
            node_id=self.node,
            input_bytes=self.input_bytes,
            output_bytes=self.output_bytes,
            stops=self.on_loss == "stop",
            kept=kept,
            identity=self.identity.settings(),
            guarded=self.error_control == "guarding",
            waived=frozenset(int(index, 16) for index in self.waive),
            emergencies=emergencies,
        )
