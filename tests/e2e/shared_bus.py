"""CAN buses that processes of this computer can share: drives in one of them, the gateway or a listener in another."""

import re
from pathlib import Path

from live_cell import LiveCell

from tests.ports import free_port

_IFF_UP = 0x1


def _vcan() -> list[str]:
    """A virtual CAN interface of the kernel that is up, if there is one."""
    up = [
        flags.parent.name
        for flags in sorted(Path("/sys/class/net").glob("vcan*/flags"))
        if int(flags.read_text(), 16) & _IFF_UP
    ]
    return up[:1]


SHARED_BUSES = ["udp_multicast", *_vcan()]
"""`udp_multicast` is everywhere, a vcan interface where somebody has set one up (docs/drives.md, SocketCAN)."""


def move_left_bus_to(bus: str, live: LiveCell) -> None:
    """Put the left bus of a cell on one of the `SHARED_BUSES`."""
    if bus == "udp_multicast":
        options = f"{{port: {free_port()}, hop_limit: 0}}"
        entry = f"interface: udp_multicast, channel: 239.74.163.2, options: {options}"
    else:
        entry = f"interface: socketcan, channel: {bus}"
    drives = live.file.parent / "left_drives.yaml"
    line = f"bus: {{{entry}, bitrate: 1000000}}"
    drives.write_text(re.sub(r"^bus: .*$", line, drives.read_text(), flags=re.MULTILINE))
