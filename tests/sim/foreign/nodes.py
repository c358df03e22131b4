"""Nodes of other stacks around a `ForeignDrive`: their own SDO server, PDOs, NMT state machine, heartbeat and EMCY.

Each is a node of a `Bus` on virtual time: `receive` takes a frame and answers, `step` lets time pass.
"""

from collections.abc import Callable
from typing import Any

import canopen
from canopen.objectdictionary import datatypes

from drive_gateway.canopen.frame import CanFrame
from tests.sim.foreign.drive import OBJECTS, ForeignDrive
from tests.unit.bus_tool_world import dictionary

SYNC, NMT = 0x080, 0x000
_STEP_S = 0.001
MEMORY, NOTE, BIG, CONSTANT = 0x2000, 0x2001, 0x2002, 0x2003
"""Of the maker's own: a number, a text of any length, a domain, and a number that can only be read."""
NOTE_TEXT, BIG_BYTES = b"as long as a text of three segments", bytes(range(256)) * 2


class ForeignNode:
    """What the bus of the tests needs of a node."""

    handlers = range(0x800)
    """It looks at every frame by itself."""

    def __init__(self, node_id: int, drive: ForeignDrive) -> None:
        self.node_id = node_id
        self.drive = drive
        self.silent = False
        """Its heartbeats do not come any more."""
        self._out: list[CanFrame] = []
        self._now = 0.0

    @property
    def position(self) -> int:
        return self.drive.position

    def receive(self, frame: CanFrame, now: float) -> list[CanFrame]:
        self.pass_time(now)
        if not frame.remote:
            self.hear(frame)
        return self._said()

    def step(self, now: float) -> list[CanFrame]:
        self.pass_time(now)
        return self._said()

    def hear(self, frame: CanFrame) -> None:
        """The stack takes a frame."""
        raise NotImplementedError

    def pass_time(self, now: float) -> None:
        """The stack's timers run."""
        raise NotImplementedError

    def emergency(self, code: int, register: int) -> None:
        """The stack sends one."""
        raise NotImplementedError

    def say(self, cob_id: int, data: bytes) -> None:
        if not (self.silent and cob_id == 0x700 + self.node_id):
            self._out.append(CanFrame(cob_id, bytes(data)))

    def _said(self) -> list[CanFrame]:
        said, self._out = self._out, []
        return said


class _Beat:
    """A periodic message of the `canopen` library, on virtual time."""

    def __init__(self, data: list[int], period_s: float, due: float) -> None:
        self.data, self.period_s, self.due = bytes(data), period_s, due
        self.stopped = False

    def stop(self) -> None:
        self.stopped = True

    def update(self, data: list[int]) -> None:
        self.data = bytes(data)


class _Network(canopen.Network):
    """The library's network without a bus: it says frames to somebody, and hears by `notify`."""

    def __init__(self, say: Callable[[int, bytes], None], now: Callable[[], float]) -> None:
        super().__init__()
        self._say, self._now = say, now
        self.beats: list[tuple[int, _Beat]] = []

    def send_message(self, can_id: int, data: Any, *_others: Any, **_named: Any) -> None:
        self._say(can_id, bytes(data))

    def send_periodic(self, can_id: int, data: Any, period: float, *_others: Any, **_named: Any) -> Any:
        beat = _Beat(data, period, self._now() + period)
        self.beats.append((can_id, beat))
        return beat


class NodeOfCanopen(ForeignNode):
    """`canopen.LocalNode`; what the library leaves to its user is after CiA 301: boot-up, PDOs that act with SYNC."""

    def __init__(self, node_id: int, drive: ForeignDrive) -> None:
        super().__init__(node_id, drive)
        self._network = _Network(self.say, lambda: self._now)
        self.node: Any = self._network.create_node(node_id, dictionary(_objects_of_canopen(node_id)))  # type: ignore[no-untyped-call]
        for index in (0x1001, CONSTANT):
            self.node.object_dictionary[index].access_type = "ro"
        self._network.subscribe(NMT, self._on_nmt)
        self._network.subscribe(SYNC, self._on_sync)
        self.node.add_write_callback(self._on_write)
        self._latched: list[tuple[int, int, bytes]] = []
        for pdo in self.node.rpdo.values():
            pdo.add_callback(self._latch)
        self._on_nmt(NMT, bytearray((0x81, node_id)), 0.0)

    def hear(self, frame: CanFrame) -> None:
        self._network.notify(frame.id, bytearray(frame.data), self._now)

    def pass_time(self, now: float) -> None:
        self._now = max(self._now, now)
        self._network.beats = [(can_id, beat) for can_id, beat in self._network.beats if not beat.stopped]
        for can_id, beat in self._network.beats:
            if now >= beat.due:
                beat.due = max(beat.due + beat.period_s, now)
                self.say(can_id, beat.data)

    def emergency(self, code: int, register: int) -> None:
        self.node.emcy.send(code, register)

    def _on_nmt(self, _id: int, data: bytearray, _at: float) -> None:
        command, whom = data
        if whom not in (0, self.node_id):
            return
        if command in (0x81, 0x82):
            for index in [index for index in self.node.data_store if index < 0x2000]:
                del self.node.data_store[index]
            self.node.nmt.stop_heartbeat()
            self.node.nmt.send_command(0x82)
            self.node.nmt.state = "PRE-OPERATIONAL"
        elif command == 0x01:
            self.node.rpdo.read()
            self.node.tpdo.read()

    def _on_write(self, index: int, data: bytes, **_others: object) -> None:
        if index == 0x6060:
            self.node.set_data(0x6061, 0, data)

    def _latch(self, pdo: Any) -> None:
        if pdo.enabled and self.node.nmt.state == "OPERATIONAL":
            self._latched += [(variable.index, variable.subindex, bytes(variable.data)) for variable in pdo]

    def _on_sync(self, _id: int, _data: bytearray, _at: float) -> None:
        if self.node.nmt.state != "OPERATIONAL":
            return
        shown = {0x6041: self.drive.statusword, 0x6061: 8, 0x6064: self.drive.position}
        for pdo in self.node.tpdo.values():
            if pdo.enabled and pdo.trans_type == 1:
                for variable in pdo:
                    variable.raw = shown[variable.index]
                pdo.transmit()
        for index, sub, data in self._latched:
            self.node.set_data(index, sub, data)
        self._latched.clear()
        self.drive.sync(self.node.sdo[0x6040].raw, self.node.sdo[0x607A].raw)


def _objects_of_canopen(node_id: int) -> dict[tuple[int, int], tuple[int, object]]:
    kinds = {
        "U8": datatypes.UNSIGNED8, "U16": datatypes.UNSIGNED16, "U32": datatypes.UNSIGNED32,
        "I8": datatypes.INTEGER8, "I16": datatypes.INTEGER16, "I32": datatypes.INTEGER32,
    }  # fmt: skip
    u8, u16, u32 = kinds["U8"], kinds["U16"], kinds["U32"]
    objects: dict[tuple[int, int], tuple[int, object]] = {
        **{(index, 0): (kinds[kind], value) for index, (kind, value) in OBJECTS.items()},
        (0x1001, 0): (u8, 0), (0x1005, 0): (u32, 0x80), (0x1006, 0): (u32, 0), (0x1014, 0): (u32, 0x80 + node_id),
        (0x1016, 1): (u32, 0), (0x1017, 0): (u16, 0), (0x1018, 1): (u32, 0x1D), (0x60C2, 1): (u8, 1),
        (0x60C2, 2): (kinds["I8"], -3), (MEMORY, 0): (u32, 0),
        (NOTE, 0): (datatypes.VISIBLE_STRING, NOTE_TEXT.decode()), (BIG, 0): (datatypes.DOMAIN, BIG_BYTES),
        (CONSTANT, 0): (u32, 7),
    }  # fmt: skip
    for number in range(4):
        for communication, mapping, cob_id in ((0x1400, 0x1600, 0x200), (0x1800, 0x1A00, 0x180)):
            objects[communication + number, 1] = (u32, cob_id + 0x100 * number + node_id)
            objects[communication + number, 2] = (u8, 255)
            objects[mapping + number, 0] = (u8, 0)
            objects.update({(mapping + number, sub): (u32, 0) for sub in range(1, 9)})
    return objects


class _DurandNetwork:
    """What durand sends and hears through."""

    def __init__(self, say: Callable[[int, bytes], None]) -> None:
        self.send = say
        self.callbacks: dict[int, Callable[[int, bytes], None]] = {}

    def add_subscription(self, cob_id: int, callback: Callable[[int, bytes], None]) -> None:
        self.callbacks[cob_id] = callback

    def remove_subscription(self, cob_id: int, **_others: object) -> None:
        self.callbacks.pop(cob_id, None)


class NodeOfDurand(ForeignNode):
    """A node of durand, which is no master and knows no other stack. It has no heartbeat consumer (1016h)."""

    def __init__(self, node_id: int, drive: ForeignDrive) -> None:
        import durand
        from durand.scheduler import VirtualScheduler

        super().__init__(node_id, drive)
        self._scheduler = VirtualScheduler()
        durand.set_scheduler(self._scheduler)
        self._network = _DurandNetwork(self.say)
        self.node: Any = durand.MinimalNode(self._network, node_id)  # type: ignore[arg-type]
        types = durand.DatatypeEnum
        kinds = {
            "U16": types.UNSIGNED16, "U32": types.UNSIGNED32,
            "I8": types.INTEGER8, "I16": types.INTEGER16, "I32": types.INTEGER32,
        }  # fmt: skip
        od = self.node.object_dictionary
        for index, (kind, value) in OBJECTS.items():
            od[index] = durand.Variable(kinds[kind], "rw", value)
        period = durand.Record()
        period[1], period[2] = durand.Variable(types.UNSIGNED8, "rw", 1), durand.Variable(types.INTEGER8, "rw", -3)
        od[0x60C2] = period
        od[MEMORY] = durand.Variable(types.UNSIGNED32, "rw", 0)
        od[NOTE] = durand.Variable(types.VISIBLE_STRING, "rw", NOTE_TEXT)
        od[BIG] = durand.Variable(types.DOMAIN, "rw", BIG_BYTES)
        od[CONSTANT] = durand.Variable(types.UNSIGNED32, "ro", 7)
        od.update_callbacks[(0x6060, 0)].add(lambda mode: od.write(0x6061, 0, mode))

    def hear(self, frame: CanFrame) -> None:
        od = self.node.object_dictionary
        if frame.id == SYNC:
            od.write(0x6041, 0, self.drive.statusword)
            od.write(0x6064, 0, self.drive.position)
        callback = self._network.callbacks.get(frame.id)
        if callback is not None:
            callback(frame.id, frame.data)
        if frame.id == SYNC and self.node.nmt.state == 5:
            self.drive.sync(od.read(0x6040, 0), od.read(0x607A, 0))

    def pass_time(self, now: float) -> None:
        if self._now == 0.0:
            self._now = now
        while self._now + _STEP_S <= now:
            self._now += _STEP_S
            self._scheduler.run(_STEP_S)

    def emergency(self, code: int, register: int) -> None:
        self.node.emcy.set(code, register)
