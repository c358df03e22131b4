"""Frames of a bus in words: identifiers of CiA 301, PDOs as a drives file maps them, names and types from EDS files."""

from collections.abc import Iterator
from dataclasses import dataclass
from enum import StrEnum

from cell.commands.bus_tools.place import BusPlace, io_eds
from drive_gateway.canopen import cob_id
from drive_gateway.canopen.abort_text import abort_text
from drive_gateway.canopen.axis_objects import first_axis_index
from drive_gateway.canopen.drive_objects import CONTROLWORD, STATUSWORD
from drive_gateway.canopen.eds import Eds, ObjectEntry
from drive_gateway.canopen.emcy import decode_emergency
from drive_gateway.canopen.frame import CanFrame
from drive_gateway.canopen.nmt import NmtCommand, NmtState, decode_heartbeat
from drive_gateway.canopen.pdo_map import Pdo
from drive_gateway.cia402.state_machine import decode
from drive_gateway.config.image import image_of, io_image_of
from drive_gateway.config.known_drive import eds_of

_TIME, _LSS_TO_NODE, _LSS_FROM_NODE = 0x100, 0x7E5, 0x7E4
_TPDOS = range(0x180, 0x580, 0x100)
_RPDOS = range(0x200, 0x600, 0x100)
_CONTROLWORDS = {0x00: "disable voltage", 0x02: "quick stop", 0x06: "shutdown", 0x07: "switch on", 0x0F: "enable"}


class Kind(StrEnum):
    NMT = "nmt"
    SYNC = "sync"
    TIME = "time"
    EMCY = "emcy"
    TPDO = "tpdo"
    RPDO = "rpdo"
    SDO = "sdo"
    HEARTBEAT = "heartbeat"
    LSS = "lss"
    OTHER = "other"


@dataclass(frozen=True, slots=True)
class FrameText:
    """One frame for people."""

    kind: Kind
    node: int
    """0: of none, or of all."""
    text: str


class FrameReader:
    """Keeps which object each node was asked for, so that the segments of its answer can be named."""

    def __init__(self, place: BusPlace) -> None:
        self._place = place
        self._eds: dict[int, Eds] = {}
        self._emergencies = {axis.node_id: axis.emergencies for _, axis in place.axes}
        self._pdos: dict[int, tuple[Pdo, str, Eds]] = {}
        for label, axis in place.axes:
            eds = self._eds.setdefault(axis.node_id, eds_of(axis.eds, axis.number, axis.like))
            for pdo in image_of(axis).pdos:
                self._pdos[pdo.cob_id] = (pdo, label, eds)
        for io in place.io_nodes:
            self._eds[io.node_id] = io_eds()
            self._emergencies[io.node_id] = io.emergencies
            for pdo in io_image_of(io).pdos:
                self._pdos[pdo.cob_id] = (pdo, f"I/O {io.name}", self._eds[io.node_id])
        self._plain = Eds()
        self._names: dict[tuple[int, int, int], ObjectEntry] = {}

    def read(self, frame: CanFrame) -> FrameText:
        """What a frame says."""
        number, data = frame.id, frame.data
        node, function = cob_id.node_id(number), cob_id.function_code(number)
        if frame.remote:
            return FrameText(self._kind(number), node, f"remote frame: asks for {number:03X}h")
        if number in self._pdos:
            return self._pdo(number, data)
        match self._kind(number):
            case Kind.NMT:
                return self._nmt(data)
            case Kind.SYNC:
                return FrameText(Kind.SYNC, 0, f"SYNC {data[0]}" if data else "SYNC")
            case Kind.TIME:
                return FrameText(Kind.TIME, 0, f"TIME {data.hex(' ')}")
            case Kind.EMCY:
                return FrameText(Kind.EMCY, node, f"EMCY {self._label(node)}: {self._emergency(node, data)}")
            case Kind.SDO:
                return FrameText(Kind.SDO, node, self._sdo(node, data, function == cob_id.SDO_TO_NODE))
            case Kind.HEARTBEAT:
                state = decode_heartbeat(data)
                words = "boot-up" if state is NmtState.BOOT_UP else state.words if state else f"? {data.hex(' ')}"
                return FrameText(Kind.HEARTBEAT, node, f"heartbeat {self._label(node)}: {words}")
            case Kind.LSS:
                side = "master" if number == _LSS_TO_NODE else "node"
                return FrameText(Kind.LSS, 0, f"LSS of a {side}: {data.hex(' ')}")
            case Kind.TPDO | Kind.RPDO as kind:
                first = _TPDOS if kind is Kind.TPDO else _RPDOS
                name = f"{kind.upper()}{first.index(function) + 1} {self._label(node)}"
                return FrameText(kind, node, f"{name}: {data.hex(' ')}")
        return FrameText(Kind.OTHER, 0, data.hex(" "))

    def _kind(self, number: int) -> Kind:
        """Of an identifier in the predefined connection set (CiA 301)."""
        node, function = cob_id.node_id(number), cob_id.function_code(number)
        if number in self._pdos:
            return Kind.RPDO if self._pdos[number][0].receive else Kind.TPDO
        if not node:
            return {cob_id.NMT: Kind.NMT, cob_id.SYNC: Kind.SYNC, _TIME: Kind.TIME}.get(number, Kind.OTHER)
        if number in (_LSS_TO_NODE, _LSS_FROM_NODE):
            return Kind.LSS
        if function in _TPDOS:
            return Kind.TPDO
        if function in _RPDOS:
            return Kind.RPDO
        return {
            cob_id.EMCY: Kind.EMCY,
            cob_id.SDO_FROM_NODE: Kind.SDO,
            cob_id.SDO_TO_NODE: Kind.SDO,
            cob_id.ERROR_CONTROL: Kind.HEARTBEAT,
        }.get(function, Kind.OTHER)

    def _label(self, node: int) -> str:
        return "of the master" if node == cob_id.MASTER_NODE_ID else self._place.label(node)

    def _nmt(self, data: bytes) -> FrameText:
        if len(data) != 2:
            return FrameText(Kind.NMT, 0, f"NMT ? {data.hex(' ')}")
        known = data[0] in {*NmtCommand}
        words = NmtCommand(data[0]).name.replace("_", " ").lower() if known else f"command {data[0]:02X}h"
        return FrameText(Kind.NMT, data[1], f"NMT {words}: {self._label(data[1]) if data[1] else 'all nodes'}")

    def _emergency(self, node: int, data: bytes) -> str:
        found = decode_emergency(data, self._emergencies.get(node, {}))
        if found is None:
            return f"too short: {data.hex(' ')}"
        remedy = f"; {found.remedy}" if found.remedy else ""
        own = f", maker's {data[3:].hex(' ')}" if any(data[3:]) else ""
        return f"{found.code:04X}h {found.meaning} (register {found.register:02X}h{own}){remedy}"

    # Process data

    def _pdo(self, number: int, data: bytes) -> FrameText:
        pdo, label, eds = self._pdos[number]
        kind = Kind.RPDO if pdo.receive else Kind.TPDO
        name = f"{kind.upper()}{pdo.number} node {pdo.node_id} ({label})"
        if len(data) < pdo.data_bytes:
            short = f"{data.hex(' ')} is too short, {pdo.data_bytes} bytes are mapped"
            return FrameText(kind, pdo.node_id, f"{name}: {short}")
        values = ", ".join(self._values(pdo, data, eds))
        rest = f", and {data[pdo.data_bytes :].hex(' ')}" if len(data) > pdo.data_bytes else ""
        return FrameText(kind, pdo.node_id, f"{name}: {values}{rest}")

    def _values(self, pdo: Pdo, data: bytes, eds: Eds) -> Iterator[str]:
        whole, at = int.from_bytes(data, "little"), 0
        for entry in pdo.entries:
            bits = entry & 0xFF
            value = (whole >> at & (1 << bits) - 1).to_bytes((bits + 7) // 8, "little")
            at += bits
            described = self._object(pdo.node_id, entry >> 16, entry >> 8 & 0xFF, eds)
            yield f"{described.name} {_shown(described, value)}"

    def _object(self, node: int, index: int, sub: int, eds: Eds | None = None) -> ObjectEntry:
        key = (node, index, sub)
        if key not in self._names:
            self._names[key] = (eds or self._eds.get(node, self._plain)).find(f"{index:04X}:{sub:02X}")
        return self._names[key]

    # Objects (CiA 301, SDO)

    def _sdo(self, node: int, data: bytes, request: bool) -> str:
        """Initiations and aborts name the object; of segments and blocks it says only that they are some."""
        name = f"SDO {self._label(node)}"
        if len(data) != 8:
            return f"{name}: {data.hex(' ')} has {len(data)} bytes, allowed are 8"
        command, index, sub = data[0], int.from_bytes(data[1:3], "little"), data[3]
        described = self._object(node, index, sub)
        where = f"{described.address} {described.name}"
        specifier = command >> 5
        if specifier == 4:
            return f"{name}: {where}: {abort_text(int.from_bytes(data[4:], 'little'))}"
        if request and specifier == 2:
            return f"{name}: read {where}"
        if request and specifier == 1:
            return f"{name}: write {where} = {self._content(command, data, described)}"
        if not request and specifier == 2:
            return f"{name}: {where} is {self._content(command, data, described)}"
        if not request and specifier == 3:
            return f"{name}: {where} is written"
        return f"{name}: {'to it' if request else 'from it'}, part of a longer transfer: {data.hex(' ')}"

    def _content(self, command: int, data: bytes, described: ObjectEntry) -> str:
        """Expedited data, or the length of what follows in segments."""
        if command & 2:
            length = 4 - (command >> 2 & 3) if command & 1 else described.size or 4
            return _shown(described, data[4 : 4 + length])
        return f"{int.from_bytes(data[4:], 'little')} bytes follow" if command & 1 else "an unknown length follows"


def _shown(described: ObjectEntry, value: bytes) -> str:
    shown = described.show(value)
    word = int.from_bytes(value[:2], "little")
    match first_axis_index(described.index):
        case index if index == STATUSWORD and len(value) == 2:
            state = decode(word)
            return f"{word:04X}h {state.words if state is not None else '(no state of CiA 402)'}"
        case index if index == CONTROLWORD and len(value) == 2:
            words = _CONTROLWORDS.get(word & 0x0F, "")
            return f"{word:04X}h {'fault reset' if word & 0x80 else words}".rstrip()
    return shown
