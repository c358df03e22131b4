"""The smallest world around one simulated node: a master that counts cycles on virtual time."""

import struct
from collections.abc import Callable

from drive_gateway.canopen.frame import CanFrame
from drive_gateway.config.settings import AxisSettings
from drive_gateway.sim.nodes.node import SimulatedNode

CYCLE_S = 0.004
LAG_S = 0.01
NODE = 3
COUNTS = 10_000.0
"""Counts per rad."""
START = 5_000
"""[counts] where the axis stands, 0.5 rad."""
QUICK_STOP = 300_000
"""[counts/s^2]"""

AXIS = AxisSettings(
    name="j1",
    node_id=NODE,
    counts_per_unit=COUNTS,
    offset=0.0,
    speed=3.0,
    acceleration=20.0,
    quick_stop=30.0,
    following_window=0.1,
    following_time_s=0.02,
)

PARAMETERS: dict[tuple[int, int], tuple[int, int]] = {
    (0x60C2, 1): (4, 1),
    (0x6060, 0): (8, 1),
    (0x6085, 0): (QUICK_STOP, 4),
    (0x605A, 0): (6, 2),
    (0x6065, 0): (1000, 4),
    (0x6066, 0): (20, 2),
    (0x1400, 1): (0x80000200 + NODE, 4),
    (0x1400, 2): (1, 1),
    (0x1600, 0): (0, 1),
    (0x1600, 1): (0x60400010, 4),
    (0x1600, 2): (0x607A0020, 4),
    (0x1800, 1): (0xC0000180 + NODE, 4),
    (0x1800, 2): (1, 1),
    (0x1A00, 0): (0, 1),
    (0x1A00, 1): (0x60410010, 4),
    (0x1A00, 2): (0x60640020, 4),
}


class Refused(Exception):
    """An SDO abort; `code` is what the node said."""

    def __init__(self, code: int) -> None:
        super().__init__(f"{code:08X}")
        self.code = code


class Bench:
    """One node and its master. `sent` is everything the node has sent."""

    def __init__(self, axis: AxisSettings = AXIS, start: float = START / COUNTS) -> None:
        self.node = SimulatedNode([axis], [start], CYCLE_S, LAG_S)
        self.id = axis.node_id
        self.now = 100.0
        self.sent: list[CanFrame] = []

    def send(self, cob_id: int, data: bytes, remote: bool = False) -> list[CanFrame]:
        answers = self.node.receive(CanFrame(cob_id, data, remote), self.now)
        self.sent += answers
        return answers

    def wait(self, seconds: float, each: Callable[[], None] = lambda: None) -> list[CanFrame]:
        """Let time pass in steps of 1 ms; returns what the node sent by itself."""
        before = len(self.sent)
        for _ in range(round(seconds * 1000)):
            self.now += 0.001
            each()
            self.sent += self.node.step(self.now)
        return self.sent[before:]

    def sent_on(self, cob_id: int) -> list[bytes]:
        return [frame.data for frame in self.sent if frame.id == cob_id]

    # SDO

    def read(self, index: int, sub: int = 0, signed: bool = False) -> int:
        answer = self._request(struct.pack("<BHBI", 0x40, index, sub, 0))
        return int.from_bytes(answer[4 : 8 - (answer[0] >> 2 & 3)], "little", signed=signed)

    def write(self, index: int, sub: int, value: int, size: int) -> None:
        data = value.to_bytes(size, "little", signed=value < 0)
        self._request(struct.pack("<BHB", 0x23 | (4 - size) << 2, index, sub) + data.ljust(4, b"\0"))

    def _request(self, request: bytes) -> bytes:
        answer = self.send(0x600 + self.id, request)[0].data
        if answer[0] == 0x80:
            raise Refused(int.from_bytes(answer[4:], "little"))
        return answer

    # NMT and process data

    def nmt(self, command: int) -> None:
        self.send(0x000, bytes((command, self.id)))

    def boot(self) -> None:
        self.wait(0.05)

    def prepare(self, **changes: int) -> None:
        """Boot, write all parameters and start; `changes` such as `x605A_0=2` replace values."""
        self.boot()
        for (index, sub), (value, size) in PARAMETERS.items():
            self.write(index, sub, changes.get(f"x{index:04X}_{sub}", value), size)
        for index in (0x1600, 0x1A00):
            self.write(index, 0, 2, 1)
        self.write(0x1400, 1, 0x200 + self.id, 4)
        self.write(0x1800, 1, 0x40000180 + self.id, 4)
        self.nmt(0x01)

    def cycle(self, controlword: int, target: float) -> tuple[int, int]:
        """One bus cycle: SYNC, the node's TPDO, the RPDO for the next SYNC. Returns statusword and position."""
        self.wait(CYCLE_S)
        answers = [frame.data for frame in self.send(0x080, b"") if frame.id == 0x180 + self.id]
        self.send(0x200 + self.id, struct.pack("<Hi", controlword, round(target)))
        statusword, position = struct.unpack("<Hi", answers[0])
        return statusword, position

    def enable(self) -> None:
        """From Switch On Disabled to Operation Enabled, holding the position."""
        for word in (0x00, 0x00, 0x06, 0x06, 0x07, 0x07, 0x0F, 0x0F, 0x0F):
            self.cycle(word, round(self.node.position))

    def drive(self, seconds: float, speed: float, start: float | None = None) -> float:
        """Move with `speed` [counts/s] for some cycles; returns the last target."""
        target = self.node.position if start is None else start
        for _ in range(round(seconds / CYCLE_S)):
            target += speed * CYCLE_S
            self.cycle(0x0F, target)
        return target
