"""The nodes of a bus directly, by the `canopen` library, where nobody masters it: listen first, then send."""

import threading
import time
from collections.abc import Callable
from contextlib import suppress
from typing import Any

import can
import canopen
from canopen.sdo.client import SdoClient

from cell.commands.bus_tools.place import BusPlace
from cell.commands.errors import CommandError
from drive_gateway.canopen import cob_id
from drive_gateway.canopen.abort_text import abort_text
from drive_gateway.canopen.axis_objects import AXES, first_axis_index, index_of
from drive_gateway.canopen.drive_objects import CONTROLWORD, DIGITAL_OUTPUTS, STATUSWORD
from drive_gateway.canopen.sdo import RESTORE_DEFAULTS, STORE_PARAMETERS
from drive_gateway.gateway.bus.bus_news import name_of, remedy_of
from drive_gateway.gateway.bus.opening import BusError, open_bus
from drive_gateway.gateway.bus.sdo_transfer import read_object, write_object
from drive_gateway.gateway.bus.sdo_workers import STORE_TIMEOUT_S

SDO_TIMEOUT_S = 0.5
"""Where no drives file says another: a drive answers within a few ms, some take longer to store a value."""
LISTEN_S = 1.0
"""A master is heard by then: its SYNC comes every few ms, its heartbeat a few times a second."""
_POLL_S = 0.02
_FRAME_BITS = 135
"""Of a frame with 8 bytes and worst-case stuffing: no faster than the wire takes them are nodes asked for."""
_DEVICE_TYPE = 0x1000
_ANSWER_BYTES = 8
_TORQUE_BITS = 0x6F
_WITH_TORQUE = (0x23, 0x27, 0x07, 0x0F)
"""Statusword & 6Fh of Switched On, Operation Enabled, Quick Stop Active, Fault Reaction Active."""
_SWITCH_ON = 0x07
"""Bits 0 to 2 of a controlword that switches torque on."""
_PROFILES = range(0x6000, 0xA000)
"""Objects of the standardized device profiles (CiA 301): outputs, for example, where the node is no drive."""
_OPERATIONAL = b"\x05"
_BY_ID = {cob_id.NMT: "an NMT command", cob_id.SYNC: "SYNC"}
_BY_FUNCTION = {
    **dict.fromkeys((0x200, 0x300, 0x400, 0x500), "a command to a drive"),
    cob_id.SDO_TO_NODE: "access to a node's objects",
}

Heard = Callable[[int, bytes], None]


class NodeRefuses(CommandError):
    """The node refuses an access to one of its objects, with an abort code."""


class NodeSilent(CommandError):
    """The node does not answer."""


class BusLine:
    """Context manager: a bus that this process opens. Before anything is sent it is listened to for `LISTEN_S`.

    Args:
        place: the bus.
        instead: what to do where a gateway masters the bus.
        may_move: writes that may move something are wanted.

    Raises:
        BusError: the bus cannot be opened, or fails.
        CommandError: somebody masters it (on entering).
    """

    def __init__(self, place: BusPlace, instead: str, may_move: bool = False) -> None:
        self._place = place
        self._instead = instead
        self._may_move = may_move
        self._own_id = cob_id.MASTER_NODE_ID if place.drives is None else place.drives.node_id
        self._timeout_s = SDO_TIMEOUT_S if place.drives is None else place.drives.sdo_timeout_s
        self._master = ""
        self._failure = ""
        self._malformed: dict[int, int] = {}
        self._clients: dict[int, Any] = {}
        self._listeners: list[Heard] = []
        self.living: set[int] = set()
        """Nodes whose boot-up or heartbeat was heard."""
        self.network: Any = None
        """Of the `canopen` library; only inside the `with` block."""

    def __enter__(self) -> "BusLine":
        bus = open_bus(self._place.bus)
        self.network = canopen.Network(bus)
        self.network.NOTIFIER_CYCLE = _POLL_S
        self.network.listeners = [_Ear(self._on_frame, self._on_remote, self._on_failure)]
        self.network.connect()
        try:
            self._refuse_master()
        except BaseException:
            self._close()
            raise
        return self

    def __exit__(self, *_error: object) -> None:
        self._close()

    def _close(self) -> None:
        with suppress(Exception):  # of a bus that failed before: the library raises it once more when all is closed
            self.network.disconnect()

    def _refuse_master(self) -> None:
        deadline = time.monotonic() + LISTEN_S
        while time.monotonic() < deadline:
            self._refuse_failed_bus()
            if self._master:
                raise CommandError(
                    f"{name_of(self._place.bus)} has a master: {self._master}; nothing was sent",
                    f"{self._instead}; or end that master first",
                )
            time.sleep(_POLL_S)

    # Frames

    def hear(self, listener: Heard) -> None:
        """From now on `listener` takes identifier and data of each frame, from another thread."""
        self._listeners.append(listener)

    def send(self, number: int, data: bytes) -> None:
        """Raises `BusError`."""
        try:
            self.network.send_message(number, data)
        except Exception as error:  # drivers of adapters raise what they like
            self._on_failure(str(error))
            self._refuse_failed_bus()

    def _on_frame(self, number: int, data: bytes) -> None:
        self._master = self._master or _of_master(number, data, self._own_id)
        if cob_id.function_code(number) == cob_id.SDO_FROM_NODE and len(data) != _ANSWER_BYTES:
            self._malformed[cob_id.node_id(number)] = len(data)
            return
        if cob_id.function_code(number) == cob_id.ERROR_CONTROL and len(data) == 1:
            self.living.add(cob_id.node_id(number))
        for listener in list(self._listeners):
            listener(number, data)
        self.network.notify(number, bytearray(data), 0.0)

    def _on_remote(self, number: int) -> None:
        if cob_id.function_code(number) == cob_id.ERROR_CONTROL:
            self._master = self._master or f"node guarding (remote frame {number:03X}h) is heard"

    def _on_failure(self, text: str) -> None:
        self._failure = self._failure or text

    def _refuse_failed_bus(self) -> None:
        """Silent nodes say nothing while the bus itself is down. Raises `BusError`."""
        if self._failure:
            raise BusError(self._place.bus, self._failure, remedy_of(self._place.bus))

    # Objects

    def answering(self) -> list[int]:
        """All Node-IDs whose node answers the question for its device type (1000h), an abort included."""
        found: set[int] = set()

        def heard(number: int, _data: bytes) -> None:
            if cob_id.function_code(number) == cob_id.SDO_FROM_NODE:
                found.add(cob_id.node_id(number))

        self.hear(heard)
        question = bytes((0x40, *_DEVICE_TYPE.to_bytes(2, "little"), 0, 0, 0, 0, 0))
        for node_id in range(1, 128):
            self.send(cob_id.SDO_TO_NODE + node_id, question)
            time.sleep(max(0.001, 2 * _FRAME_BITS / self._place.bus.bitrate))
        time.sleep(self._timeout_s)
        self._listeners.remove(heard)
        self._refuse_failed_bus()
        return sorted(found)

    def read(self, node_id: int, index: int, sub: int) -> bytes:
        """Raises `NodeRefuses`, `NodeSilent` or `BusError`."""
        return bytes(self._carry_out(node_id, index, sub, read_object))

    def write(self, node_id: int, index: int, sub: int, data: bytes) -> None:
        """Raises `CommandError` for what is unsafe now, and as `read`."""
        self._refuse_unsafe(node_id, index, sub, data)
        self._carry_out(node_id, index, sub, lambda client, *at: write_object(client, at[0], at[1], data))

    def statuswords(self, node_id: int) -> list[int]:
        """Of each axis of a node; none where it is no drive. Raises `NodeSilent` or `BusError`."""
        words = []
        for axis in range(1, AXES + 1):
            try:
                words.append(int.from_bytes(self.read(node_id, index_of(STATUSWORD, axis), 0), "little"))
            except NodeRefuses:
                continue
        return words

    def refuse_torque(self, node_id: int, what: str) -> None:
        """Raises `CommandError` while a drive of the node has its power stage on, unless motion is wanted."""
        if self._may_move:
            return
        for word in self.statuswords(node_id):
            if word & _TORQUE_BITS in _WITH_TORQUE:
                raise CommandError(
                    f"node {node_id} has its power stage on (statusword {word:04X}h); {what} is refused",
                    "switch the drive off first, or add --may-move where nobody and nothing is in its way",
                )

    def _refuse_unsafe(self, node_id: int, index: int, sub: int, data: bytes) -> None:
        if self._may_move:
            return
        self.refuse_torque(node_id, "a write")
        first, name = first_axis_index(index), f"{index:04X}h:{sub:02X} of node {node_id}"
        problem = ""
        if first == CONTROLWORD and data and data[0] & _SWITCH_ON == _SWITCH_ON:
            problem = "this controlword switches its torque on"
        elif first == DIGITAL_OUTPUTS:
            problem = "it switches outputs, a brake or a gripper for example"
        elif index in _PROFILES and not self.statuswords(node_id):
            problem = "the node shows no statusword (6041h), so what this moves or switches is not known"
        if problem:
            raise CommandError(
                f"{name} is not written: {problem}", "add --may-move where nobody and nothing is in its way"
            )

    def _carry_out(self, node_id: int, index: int, sub: int, transfer: Callable[[Any, int, int], Any]) -> Any:
        client = self._client(node_id)
        slow = index in (STORE_PARAMETERS, RESTORE_DEFAULTS)
        client.RESPONSE_TIMEOUT = max(STORE_TIMEOUT_S, self._timeout_s) if slow else self._timeout_s
        name = f"{index:04X}h:{sub:02X} of {self._place.label(node_id)}"
        self._malformed.pop(node_id, None)
        try:
            return transfer(client, index, sub)
        except canopen.SdoAbortedError as error:
            raise NodeRefuses(f"{name}: {abort_text(error.code)}") from error
        except (can.CanError, OSError) as error:
            self._on_failure(str(error))
            self._refuse_failed_bus()
        except canopen.SdoCommunicationError as error:
            self._refuse_failed_bus()
            length = self._malformed.get(node_id)
            if length is not None:
                found = f"an answer had {length} bytes, allowed are {_ANSWER_BYTES}"
                raise NodeSilent(f"{name}: {found}", "check the node's firmware") from error
            raise NodeSilent(
                f"{name}: {error} within {client.RESPONSE_TIMEOUT:g} s", "check power, wiring, bit rate and Node-ID"
            ) from error
        except Exception as error:  # whatever the library makes of an answer that is none
            self._refuse_failed_bus()
            raise CommandError(f"{name}: the SDO transfer failed ({type(error).__name__}: {error})") from error

    def _client(self, node_id: int) -> Any:
        if node_id not in self._clients:
            dictionary = canopen.ObjectDictionary()  # type: ignore[no-untyped-call]
            client: Any = SdoClient(  # type: ignore[no-untyped-call]
                cob_id.SDO_TO_NODE + node_id, cob_id.SDO_FROM_NODE + node_id, dictionary
            )
            client.network = self.network
            self.network.subscribe(client.tx_cobid, client.on_response)
            self._clients[node_id] = client
        return self._clients[node_id]


class _Ear(can.Listener):
    """Hands on what is CANopen's business: frames with 11 bits, and the failure of the bus."""

    def __init__(self, on_frame: Heard, on_remote: Callable[[int], None], on_failure: Callable[[str], None]) -> None:
        self._on_frame = on_frame
        self._on_remote = on_remote
        self._on_failure = on_failure
        self._pause = threading.Event()

    def on_message_received(self, msg: can.Message) -> None:
        if msg.is_error_frame or msg.is_extended_id:
            return
        if msg.is_remote_frame:
            self._on_remote(msg.arbitration_id)
        else:
            self._on_frame(msg.arbitration_id, bytes(msg.data))

    def on_error(self, exc: Exception) -> None:
        self._on_failure(str(exc))
        self._pause.wait(_POLL_S)


def _of_master(number: int, data: bytes, own_id: int) -> str:
    """What shows that somebody commands the nodes of a bus; empty for what nodes send by themselves.

    A master is Operational; a new drive that ships with the gateway's Node-ID is not.
    """
    what = _BY_ID.get(number) or _BY_FUNCTION.get(cob_id.function_code(number))
    if number == cob_id.ERROR_CONTROL | own_id and data == _OPERATIONAL:
        what = "a master's heartbeat"
    return f"{what} ({number:03X}h) is heard" if what else ""
