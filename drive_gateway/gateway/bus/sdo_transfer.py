"""One SDO transfer by the `canopen` library's client (CiA 301): a large object goes in blocks."""

import io
from struct import Struct
from typing import Any

import canopen
from canopen.sdo.client import BlockDownloadStream

BLOCK_FROM = 64
"""Bytes from which a block transfer needs less of the bus than segments with an answer each."""
SEGMENT_PAUSE_S = 0.001
"""Between two segments of a download: SYNC and set points share the sender and must not queue behind many of them."""

_SEGMENT_BYTES = 7
_NO_BLOCKS = 0x05040001
"""What a node answers that does not know block transfers: unknown command specifier."""
_GENERAL_ERROR = 0x08000000
_ABORT = Struct("<BHBI")
# Version 2.4 of the library raises the second when the last segments of a download were lost and the third when the end
# of an upload was lost.
_BROKEN = (canopen.SdoCommunicationError, RuntimeError, AttributeError)


def read_object(client: Any, index: int, sub: int) -> bytes:
    """The bytes of an object, by a `canopen.sdo.SdoClient`.

    One that announces `BLOCK_FROM` bytes or more is fetched in blocks. A node without block transfers, or one whose
    block transfer broke off, is read in segments.

    Raises:
        canopen.SdoAbortedError: the node refuses.
        canopen.SdoCommunicationError: it does not answer, or not as it should.
    """
    with client.open(index, sub, "rb", buffering=0) as segments:
        if segments.size is None or segments.size < BLOCK_FROM:
            return bytes(segments.read())
    _abort(client, index, sub)
    try:
        with client.open(index, sub, "rb", buffering=0, block_transfer=True) as blocks:
            data = bytes(blocks.read())
        if len(data) == segments.size:  # after a time-out the library can leave a segment out; no CRC, no complaint
            return data
    except canopen.SdoAbortedError as refusal:
        if refusal.code != _NO_BLOCKS:
            raise
    except _BROKEN:
        _abort(client, index, sub)
    return bytes(client.upload(index, sub))


def write_object(client: Any, index: int, sub: int, data: bytes) -> None:
    """Write an object by a `canopen.sdo.SdoClient`, `BLOCK_FROM` bytes or more in blocks.

    A node without block transfers, or one whose block transfer broke off, is written in segments.

    Raises:
        canopen.SdoAbortedError: the node refuses.
        canopen.SdoCommunicationError: it does not answer, or not as it should.
    """
    if len(data) >= BLOCK_FROM and _written_in_blocks(client, index, sub, data):
        return
    client.download(index, sub, data)


def _written_in_blocks(client: Any, index: int, sub: int, data: bytes) -> bool:
    """False when it must be done another way. Raises `canopen.SdoAbortedError`: the node refuses the value."""
    client.PAUSE_BEFORE_SEND = SEGMENT_PAUSE_S
    stream: Any = None
    try:
        stream = BlockDownloadStream(client, index, sub, len(data))  # type: ignore[no-untyped-call]
        for at in range(0, len(data), _SEGMENT_BYTES):
            stream.write(data[at : at + _SEGMENT_BYTES])
        stream.close()
    except canopen.SdoAbortedError as refusal:
        if refusal.code != _NO_BLOCKS:
            raise
        return False
    except _BROKEN:
        _abort(client, index, sub)
        return False
    finally:
        client.PAUSE_BEFORE_SEND = 0.0
        if stream is not None:
            io.RawIOBase.close(stream)  # the stream's own `close` would end the transfer a second time
    return True


def _abort(client: Any, index: int, sub: int) -> None:
    """Let the node forget a transfer; an abort is not answered."""
    client.send_request(_ABORT.pack(0x80, index, sub, _GENERAL_ERROR))
