"""What the gateway's shell does for its core, beside the effects of `cell.core` and `Sdo`."""

from dataclasses import dataclass

from cell.core import Effect
from drive_gateway.canopen.frame import CanFrame


@dataclass(frozen=True, slots=True)
class Frame(Effect):
    """Send a frame now, in the order of the effects."""

    frame: CanFrame


@dataclass(frozen=True, slots=True)
class Finished(Effect):
    """After `Shutdown`: the drives are off and the nodes pre-operational, the loop may end."""


@dataclass(frozen=True, slots=True)
class Shutdown:
    """Message to the core: let the robots come to rest, switch their drives off and leave the bus."""
