"""What the gateway's shell does for its core, beside the effects of `cell.core` and `Sdo`."""

from dataclasses import dataclass

from cell.core import Effect
from drive_gateway.canopen.frame import CanFrame


@dataclass(frozen=True, slots=True)
class Frame(Effect):
    """Send a frame now, in the order of the effects."""

    frame: CanFrame
