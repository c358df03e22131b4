"""What is on a gateway's bus and when: SYNCs and the commands of one axis, by the kernel's time stamps."""

from collections import deque
from collections.abc import Callable
from struct import Struct
from types import TracebackType
from typing import Self

import can

from drive_gateway.canopen.cob_id import RPDO1, SYNC
from drive_gateway.config.settings import BusSettings
from drive_gateway.gateway.bus.opening import open_bus

KEPT = 16
"""Commands whose moments are remembered."""
_COMMAND = Struct("<Hi")


class BusEar:
    """Context manager: a handle of its own on the same channel. udp_multicast stamps a frame when the kernel gets it.

    Args:
        settings: of the bus.
        node_id: whose commands are told to `on_target`: the moment [s, time.time()] and the target position [counts].
    """

    def __init__(self, settings: BusSettings, node_id: int, on_target: Callable[[float, int], None]) -> None:
        self._settings = settings
        self._command = RPDO1 + node_id
        self._on_target = on_target
        self._bus: can.BusABC | None = None
        self.syncs = 0
        self._frames: deque[tuple[int, float]] = deque(maxlen=KEPT)

    def __enter__(self) -> Self:
        self._bus = open_bus(self._settings)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._bus is not None:
            self._bus.shutdown()

    def command_at(self, sync: int) -> float | None:
        """[s, time.time()] the command in the cycle of this SYNC, counted from 1; `None`: not heard, or forgotten."""
        return next((at for number, at in self._frames if number == sync), None)

    def listen(self) -> None:
        """Take all that has come."""
        while self._bus is not None and (message := self._bus.recv(0.0)) is not None:
            if message.arbitration_id == SYNC:
                self.syncs += 1
            elif message.arbitration_id == self._command:
                self._frames.append((self.syncs, message.timestamp))
                self._on_target(message.timestamp, _COMMAND.unpack(message.data)[1])
