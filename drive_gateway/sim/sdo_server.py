"""The SDO server of a node (CiA 301): expedited and segmented transfers, one at a time, every refusal with its code."""

from dataclasses import dataclass
from struct import Struct

from drive_gateway.sim.abort import Abort, AccessRefused
from drive_gateway.sim.dictionary import key_of
from drive_gateway.sim.objects import Objects

_HEAD = Struct("<BHB")
_U32 = Struct("<I")
_LONGEST = 1024
"""A download without a size is cut off here; no object of the drive is that long."""


@dataclass(slots=True)
class _Upload:
    index: int
    sub: int
    data: bytes
    toggle: int = 0


@dataclass(slots=True)
class _Download:
    index: int
    sub: int
    size: int | None
    data: bytes = b""
    toggle: int = 0


class SdoServer:
    """Turns one request into one answer, 8 bytes each. `None`: the request needs no answer (abort, wrong length)."""

    def __init__(self, objects: Objects) -> None:
        self._objects = objects
        self._transfer: _Upload | _Download | None = None

    def reset(self) -> None:
        """Forget a transfer that is under way."""
        self._transfer = None

    def answer(self, request: bytes) -> bytes | None:
        if len(request) != 8:
            return None
        command, index, sub = _HEAD.unpack_from(request)
        try:
            match command >> 5:
                case 0:
                    return self._download_segment(request)
                case 1:
                    return self._initiate_download(request, index, sub)
                case 2:
                    return self._initiate_upload(index, sub)
                case 3:
                    return self._upload_segment(command)
                case 4:
                    self._transfer = None
                    return None
                case _:
                    raise AccessRefused(Abort.UNKNOWN_COMMAND)
        except AccessRefused as refusal:
            return self._abort(command, index, sub, refusal.code)

    def _abort(self, command: int, index: int, sub: int, code: Abort) -> bytes:
        """A segment carries no address: its abort names the object of the transfer (zeros when there is none)."""
        if command >> 5 in (0, 3):
            transfer = self._transfer
            index, sub = (0, 0) if transfer is None else (transfer.index, transfer.sub)
        self._transfer = None
        return _HEAD.pack(0x80, index, sub) + _U32.pack(code)

    def _initiate_upload(self, index: int, sub: int) -> bytes:
        self._transfer = None
        data = self._objects.read(key_of(index, sub))
        if len(data) <= 4:
            return _HEAD.pack(0x43 | (4 - len(data)) << 2, index, sub) + data.ljust(4, b"\0")
        self._transfer = _Upload(index, sub, data)
        return _HEAD.pack(0x41, index, sub) + _U32.pack(len(data))

    def _upload_segment(self, command: int) -> bytes:
        transfer = self._transfer
        if not isinstance(transfer, _Upload):
            raise AccessRefused(Abort.UNKNOWN_COMMAND)
        toggle = command & 0x10
        if toggle != transfer.toggle:
            raise AccessRefused(Abort.TOGGLE)
        part, transfer.data = transfer.data[:7], transfer.data[7:]
        transfer.toggle ^= 0x10
        last = not transfer.data
        if last:
            self._transfer = None
        return bytes((toggle | (7 - len(part)) << 1 | last,)) + part.ljust(7, b"\0")

    def _initiate_download(self, request: bytes, index: int, sub: int) -> bytes:
        self._transfer = None
        command, key = request[0], key_of(index, sub)
        entry = self._objects.writable(key)
        sized = bool(command & 0x01)
        if command & 0x02:
            length = 4 - (command >> 2 & 0x03) if sized else entry.layout.size
            self._objects.write(key, request[4 : 4 + length])
        else:
            size = _U32.unpack_from(request, 4)[0] if sized else None
            if size is not None:
                self._objects.check_size(entry, size)
            self._transfer = _Download(index, sub, size)
        return _HEAD.pack(0x60, index, sub) + bytes(4)

    def _download_segment(self, request: bytes) -> bytes:
        transfer = self._transfer
        if not isinstance(transfer, _Download):
            raise AccessRefused(Abort.UNKNOWN_COMMAND)
        command = request[0]
        toggle = command & 0x10
        if toggle != transfer.toggle:
            raise AccessRefused(Abort.TOGGLE)
        transfer.toggle ^= 0x10
        transfer.data += request[1 : 8 - (command >> 1 & 0x07)]
        if len(transfer.data) > (_LONGEST if transfer.size is None else transfer.size):
            raise AccessRefused(Abort.TOO_LONG)
        if command & 0x01:
            if transfer.size is not None and len(transfer.data) != transfer.size:
                raise AccessRefused(Abort.LENGTH)
            self._objects.write(key_of(transfer.index, transfer.sub), transfer.data)
            self._transfer = None
        return bytes((0x20 | toggle,)) + bytes(7)
