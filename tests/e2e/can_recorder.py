"""What really goes over a CAN bus: set points decoded from its frames, read back into joints."""

from dataclasses import dataclass
from threading import Lock

import can
import numpy as np
from numpy.typing import NDArray

from drive_gateway.config import GatewaySettings

SYNC, TPDO1, RPDO1 = 0x080, 0x180, 0x200


@dataclass(frozen=True, slots=True, eq=False)
class Cycle:
    """What the nodes were told and what they answered between two SYNCs: `(n,)` [rad], NaN where a frame is missing."""

    commanded: NDArray[np.float64]
    measured: NDArray[np.float64]


class CanRecorder(can.Listener):
    """A listener on the bus of one gateway with one robot; a context manager."""

    def __init__(self, settings: GatewaySettings) -> None:
        (drives,) = settings.robots.values()
        self._axes = drives.axes
        self._index = {axis.node_id: i for i, axis in enumerate(drives.axes)}
        self._lock = Lock()
        self._cycles: list[Cycle] = []
        self._begin()
        bus = settings.bus
        self._bus = can.Bus(interface=bus.interface, channel=bus.channel, bitrate=bus.bitrate, **bus.options)
        self._notifier = can.Notifier(self._bus, [self])

    def __enter__(self) -> "CanRecorder":
        return self

    def __exit__(self, *_: object) -> None:
        self._notifier.stop()
        self._bus.shutdown()

    def _begin(self) -> None:
        self._commanded = np.full(len(self._axes), np.nan)
        self._measured = np.full(len(self._axes), np.nan)

    def on_message_received(self, msg: can.Message) -> None:
        if msg.arbitration_id == SYNC:
            with self._lock:
                self._cycles.append(Cycle(self._commanded, self._measured))
            self._begin()
            return
        function, node = msg.arbitration_id & ~0x7F, msg.arbitration_id & 0x7F
        if function in (TPDO1, RPDO1) and node in self._index and len(msg.data) == 6:
            index = self._index[node]
            axis = self._axes[index]
            counts = int.from_bytes(msg.data[2:6], "little", signed=True)
            values = self._commanded if function == RPDO1 else self._measured
            values[index] = counts / axis.counts_per_unit + axis.offset

    def cycles(self) -> list[Cycle]:
        """All complete cycles so far."""
        with self._lock:
            return list(self._cycles)
