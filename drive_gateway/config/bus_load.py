"""Whether the wire can carry what is configured."""

from collections.abc import Sequence
from dataclasses import dataclass

from drive_gateway.canopen.bus_load import cyclic_load
from drive_gateway.canopen.io_map import IoImage
from drive_gateway.canopen.pdo_map import ProcessImage

KEPT_FREE = 0.10
"""Share of the wire for SDO and EMCY, which come when they come."""
WARN_ABOVE = 0.70
REFUSE_ABOVE = 0.80


@dataclass(frozen=True, slots=True)
class BusLoad:
    """Shares of the wire, 0 to 1, with worst-case stuffing: every SYNC, PDO and heartbeat, and what is kept free."""

    cyclic: float
    kept: float = KEPT_FREE

    @property
    def total(self) -> float:
        return self.cyclic + self.kept

    @property
    def refused(self) -> bool:
        return self.total > REFUSE_ABOVE

    @property
    def high(self) -> bool:
        return self.total > WARN_ABOVE


def bus_load(images: Sequence[ProcessImage | IoImage], bitrate: int, cycle_s: float, heartbeat_s: float) -> BusLoad:
    """The load of nodes with these process images."""
    nodes = {image.node_id for image in images}
    bits = sum(image.bits_per_cycle for image in images)
    timed = sum(image.timed_bits_s for image in images)
    return BusLoad(cyclic_load(len(nodes), bitrate, cycle_s, heartbeat_s, bits, timed))
