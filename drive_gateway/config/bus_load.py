"""Whether the wire can carry what is configured."""

from dataclasses import dataclass

from drive_gateway.canopen.bus_load import cyclic_load
from drive_gateway.canopen.pdo_map import RPDO1_LAYOUT, TPDO1_LAYOUT
from drive_gateway.canopen.profile_pdos import ProfilePdos

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


def bus_load(
    nodes: int, bitrate: int, cycle_s: float, heartbeat_s: float, profile_pdos: ProfilePdos | None = None
) -> BusLoad:
    """The load of `nodes` drives with the process image of `drive_gateway.canopen.pdo_map`, and what is beside it."""
    pdo_bytes = max(RPDO1_LAYOUT.size, TPDO1_LAYOUT.size)
    timed_bits_s = 0.0 if profile_pdos is None else profile_pdos.bits_per_s
    return BusLoad(cyclic_load(nodes, bitrate, cycle_s, heartbeat_s, pdo_bytes, timed_bits_s))
