"""Who is on the bus: every Node-ID is asked for its device type, a few per cycle, and answers are collected."""

from collections.abc import Callable, Collection
from math import ceil

from cell.core import Effect
from drive_gateway.canopen.cob_id import HIGHEST_NODE_ID, SDO_TO_NODE
from drive_gateway.canopen.frame import CanFrame
from drive_gateway.gateway.effects import Frame

READ_DEVICE_TYPE = bytes.fromhex("4000100000000000")
"""SDO read request of 1000h:00."""
PER_CYCLE = 2
"""Requests per bus cycle, so that the process data keep their room; more where cycles are long or come late."""
ASK_WITHIN_S = 1.0
"""All are asked within this time: a caller waits 2 s for the answer."""
LISTEN_S = 0.3
"""A node answers an SDO within a few ms; after the last request it gets this long."""

Found = Callable[[dict[int, int]], None]
"""Takes the device type (1000h) of each strange node that answered."""


class Scan:
    """Looks for nodes that are not in the drives file; those that are have their own SDO channel and are left alone.

    The gateway's own Node-ID is asked, too: a new drive may have it from its factory, and a gateway answers no SDO.
    """

    def __init__(self, known: Collection[int]) -> None:
        self._strange = [number for number in range(1, HIGHEST_NODE_ID + 1) if number not in known]
        self._asking: list[int] = []
        self._waiting: list[Found] = []
        self._found: dict[int, int] = {}
        self._began: float | None = None
        self._until = 0.0

    def begin(self, then: Found) -> None:
        """Start a scan, or join the one that goes on."""
        if not self._waiting:
            self._asking, self._found, self._began = list(self._strange), {}, None
        self._waiting.append(then)

    def take(self, node_id: int, data: bytes) -> None:
        """An SDO answer; one that gives another object than the device type is no answer to this."""
        if self._waiting and len(data) == 8 and data[1:4] == READ_DEVICE_TYPE[1:4]:
            refused = data[0] == 0x80
            self._found[node_id] = 0 if refused else int.from_bytes(data[4:8], "little")

    def step(self, now: float) -> list[Effect]:
        """The requests of this cycle; tells what was found when the time is over."""
        if not self._waiting:
            return []
        if self._began is None:
            self._began = now
        due = ceil(len(self._strange) * (now - self._began) / ASK_WITHIN_S)
        count = max(PER_CYCLE, due - (len(self._strange) - len(self._asking)))
        asked, self._asking = self._asking[:count], self._asking[count:]
        if asked:
            self._until = now + LISTEN_S
        elif now >= self._until:
            waiting, self._waiting = self._waiting, []
            for then in waiting:
                then(self._found)
        return [Frame(CanFrame(SDO_TO_NODE + number, READ_DEVICE_TYPE)) for number in asked]
