"""The CAN bus of one simulated gateway: real frames between its core and the simulated drives, no wire time."""

from collections.abc import Callable

from drive_gateway.canopen.frame import CanFrame
from drive_gateway.canopen.sdo import Sdo, SdoDone
from drive_gateway.config.settings import GatewaySettings
from drive_gateway.sim.shell import Robots, simulated_nodes

_ABORT = 0x80


class Bus:
    """Hands every frame to every node and the nodes' answers to `deliver`."""

    def __init__(
        self, settings: GatewaySettings, deliver: Callable[[object], None], robots: Robots | None = None
    ) -> None:
        self._deliver = deliver
        self.nodes = {node.node_id: node for node in simulated_nodes(settings, robots)}

    def send(self, frame: CanFrame, now: float) -> None:
        """A frame of the gateway."""
        for node in self.nodes.values():
            for answer in node.receive(frame, now):
                self._deliver(answer)

    def step(self, now: float) -> None:
        """Let the nodes' timers run."""
        for node in self.nodes.values():
            for frame in node.step(now):
                self._deliver(frame)

    def sdo(self, request: Sdo, now: float) -> SdoDone:
        """Carry an SDO out with expedited frames, as the gateway's shell does with the canopen library."""
        node = self.nodes[request.node_id]
        answers = node.receive(CanFrame(0x600 + request.node_id, _request_bytes(request)), now)
        answer = next((frame.data for frame in answers if frame.id == 0x580 + request.node_id), None)
        if answer is None:
            return SdoDone(request.request_id, b"", None, "no answer")
        if answer[0] == _ABORT:
            code = int.from_bytes(answer[4:8], "little")
            return SdoDone(request.request_id, b"", code, f"abort {code:08X}h")
        size = 4 - (answer[0] >> 2 & 0x3) if request.data is None else 0
        return SdoDone(request.request_id, bytes(answer[4 : 4 + size]))


def _request_bytes(request: Sdo) -> bytes:
    object_bytes = request.index.to_bytes(2, "little") + bytes([request.sub])
    if request.data is None:
        return b"\x40" + object_bytes + bytes(4)
    return bytes([0x23 | (4 - len(request.data)) << 2]) + object_bytes + request.data.ljust(4, b"\x00")
