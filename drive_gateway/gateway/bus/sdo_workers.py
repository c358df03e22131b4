"""SDO transfers beside the cycle: the `canopen` library's client per node, in worker threads."""

import logging
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from contextlib import AbstractContextManager
from functools import partial
from struct import Struct
from types import TracebackType
from typing import Any, Self

import can
import canopen
from canopen.sdo.client import SdoClient

from drive_gateway.canopen.abort_text import abort_text
from drive_gateway.canopen.cob_id import SDO_FROM_NODE, SDO_TO_NODE, function_code, node_id
from drive_gateway.canopen.frame import CanFrame
from drive_gateway.canopen.sdo import RESTORE_DEFAULTS, STORE_PARAMETERS, Sdo, SdoDone
from drive_gateway.gateway.bus.sdo_transfer import read_object, write_object

STORE_TIMEOUT_S = 3.0
"""Time in which a drive stores or restores all its parameters; shorter than an operator's call waits."""
_ANSWER_BYTES = 8
"""Of each SDO answer, whatever of it is used (CiA 301)."""
_ADDRESS = Struct("<HB")
_NAMING = frozenset({2, 3, 4})
"""Command specifiers of a server whose frames name their object: uploads, downloads, aborts (CiA 301, 7.2.4.3)."""
_UNNAMED = bytes(3)
"""Some servers leave the object out of their aborts."""
_BLOCK_UPLOAD = 5

# Every outcome goes back to the core, which tells it with its node; the library's own log would tell it twice.
logging.getLogger("canopen").setLevel(logging.CRITICAL)


class _Network(canopen.Network):
    """The library's network on a port that somebody else owns: it sends through it and is fed by `notify`."""

    def __init__(self, send: Callable[[CanFrame], None]) -> None:
        super().__init__()
        self._send = send

    def send_message(self, can_id: int, data: bytes, remote: bool = False) -> None:
        self._send(CanFrame(can_id, bytes(data), remote))


class SdoWorkers:
    """Context manager. `done` gets the outcome of each request, from a worker's thread; a node answers each within
    `timeout_s`.

    A transfer runs inside `attend()`, in which received frames must come to `take` without delay.
    """

    def __init__(
        self,
        node_ids: Iterable[int],
        send: Callable[[CanFrame], None],
        attend: Callable[[], AbstractContextManager[None]],
        done: Callable[[SdoDone], None],
        timeout_s: float,
    ) -> None:
        self._done = done
        self._timeout_s = timeout_s
        self._attend = attend
        self._network = _Network(partial(self._sent, send))
        self._clients: dict[int, Any] = {}
        self._malformed: dict[int, int] = {}
        self._asked: dict[int, bytes] = {}
        """By node that is asked: index and sub-index of the object, as in each frame that names it."""
        self._streams: dict[int, bool] = {}
        """By node: its next answers are segments of a block upload, which begin with a number."""
        for number in node_ids:
            dictionary = canopen.ObjectDictionary()  # type: ignore[no-untyped-call]
            client: Any = SdoClient(  # type: ignore[no-untyped-call]
                SDO_TO_NODE + number, SDO_FROM_NODE + number, dictionary
            )
            client.network = self._network
            self._network.subscribe(client.tx_cobid, client.on_response)
            self._clients[number] = client
        self._pool = ThreadPoolExecutor(max_workers=max(1, len(self._clients)), thread_name_prefix="sdo")

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._pool.shutdown(wait=True, cancel_futures=True)

    def take(self, frame: CanFrame) -> bool:
        """Give a received frame to its client; true when it came as an SDO answer of a configured node that is asked.

        An answer that is not 8 bytes long is none: the request goes on to its time-out, which then says so. Nor is one
        about another object: it belongs to a request whose time was over.
        """
        node = node_id(frame.id)
        if function_code(frame.id) != SDO_FROM_NODE or node not in self._clients:
            return False
        if len(frame.data) != _ANSWER_BYTES:
            self._malformed[node] = len(frame.data)
            return True
        asked = self._asked.get(node)
        if asked is None:
            return False
        names = frame.data[0] >> 5 in _NAMING and not self._streams.get(node)
        if names and frame.data[1:4] not in (asked, _UNNAMED):
            return True
        self._network.notify(frame.id, bytearray(frame.data), 0.0)
        return True

    def submit(self, request: Sdo) -> None:
        """Carry a request out; the core sends one per node at a time."""
        self._pool.submit(self._work, request)

    def _sent(self, send: Callable[[CanFrame], None], frame: CanFrame) -> None:
        """A client sends: it may ask for a block upload, or for more of it."""
        self._streams[node_id(frame.id)] = frame.data[0] >> 5 == _BLOCK_UPLOAD and frame.data[0] & 3 in (2, 3)
        send(frame)

    def _work(self, request: Sdo) -> None:
        client = self._clients[request.node_id]
        data, abort_code, problem = b"", None, ""
        slow = request.index in (STORE_PARAMETERS, RESTORE_DEFAULTS)
        timeout_s = max(STORE_TIMEOUT_S, self._timeout_s) if slow else self._timeout_s
        client.RESPONSE_TIMEOUT = timeout_s
        self._malformed.pop(request.node_id, None)
        self._asked[request.node_id] = _ADDRESS.pack(request.index, request.sub)
        try:
            with self._attend():
                if request.data is None:
                    data = read_object(client, request.index, request.sub)
                else:
                    write_object(client, request.index, request.sub, request.data)
        except canopen.SdoAbortedError as error:
            abort_code, problem = error.code, abort_text(error.code)
        except (canopen.SdoCommunicationError, can.CanError, OSError) as error:
            problem = f"{error} within {timeout_s} s"
            length = self._malformed.get(request.node_id)
            if length is not None:
                problem += f"; an answer had {length} bytes, allowed are {_ANSWER_BYTES}: check the node's firmware"
        except Exception as error:
            # Whatever the library makes of an answer: without an outcome the node would never be asked again.
            problem = f"the SDO transfer failed ({type(error).__name__}: {error})"
        del self._asked[request.node_id]
        self._done(SdoDone(request.request_id, data, abort_code, problem))
