"""The SDO server of a node (CiA 301): expedited, segmented and block transfers, one at a time; refusals have codes."""

from dataclasses import dataclass
from struct import Struct

from drive_gateway.sim.services.abort import Abort, AccessRefused
from drive_gateway.sim.services.dictionary import key_of
from drive_gateway.sim.services.objects import Objects
from drive_gateway.sim.services.sdo_block import BlockDownload, BlockUpload

_HEAD = Struct("<BHB")
_U32 = Struct("<I")
_EXPEDITED_BYTES = 4
_ABORTED = 0x80
_INITIATES = {1: 0, 2: 0, 5: 0x03, 6: 0x01, 7: 0}
"""Requests that name an object, by command specifier, and the bits that must be zero in those that do."""


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
    longest: int
    data: bytes = b""
    toggle: int = 0


class SdoServer:
    """Turns one request into the frames that answer it, 8 bytes each; an abort and a wrong length get none."""

    def __init__(self, objects: Objects) -> None:
        self._objects = objects
        self._transfer: _Upload | _Download | BlockUpload | BlockDownload | None = None

    def reset(self) -> None:
        """Forget a transfer that is under way."""
        self._transfer = None

    def answer(self, request: bytes) -> list[bytes]:
        if len(request) != 8:
            return []
        command, index, sub = _HEAD.unpack_from(request)
        transfer = self._transfer
        if isinstance(transfer, BlockDownload) and transfer.takes_segments and command != _ABORTED:
            try:
                return transfer.segment(request)
            except AccessRefused as refusal:
                return [self._abort(None, refusal.code)]
        try:
            return self._obey(request, command, index, sub)
        except AccessRefused as refusal:
            zeros = _INITIATES.get(command >> 5)
            names_object = zeros is not None and not command & zeros
            return [self._abort((index, sub) if names_object else None, refusal.code)]

    def _obey(self, request: bytes, command: int, index: int, sub: int) -> list[bytes]:
        match command >> 5:
            case 0:
                return [self._download_segment(request)]
            case 1:
                return [self._initiate_download(request, index, sub)]
            case 2:
                return [self._initiate_upload(index, sub)]
            case 3:
                return [self._upload_segment(command)]
            case 4:
                self._transfer = None
                return []
            case 5:
                return self._block_upload(request, index, sub)
            case 6:
                return [self._block_download(request, index, sub)]
            case _:
                raise AccessRefused(Abort.UNKNOWN_COMMAND)

    def _abort(self, address: tuple[int, int] | None, code: Abort) -> bytes:
        """A request within a transfer carries no address: its abort names the transfer's (zeros when there is none)."""
        if address is None:
            transfer = self._transfer
            address = (0, 0) if transfer is None else (transfer.index, transfer.sub)
        self._transfer = None
        return _HEAD.pack(_ABORTED, *address) + _U32.pack(code)

    def _initiate_upload(self, index: int, sub: int) -> bytes:
        self._transfer = None
        data = self._objects.read(key_of(index, sub))
        if 0 < len(data) <= _EXPEDITED_BYTES:
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
            length = 4 - (command >> 2 & 0x03) if sized else min(entry.longest, _EXPEDITED_BYTES)
            self._objects.write(key, request[4 : 4 + length])
        else:
            size = _U32.unpack_from(request, 4)[0] if sized else None
            if size is not None:
                self._objects.check_size(entry, size)
            self._transfer = _Download(index, sub, size, entry.longest if size is None else size)
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
        if len(transfer.data) > transfer.longest:
            raise AccessRefused(Abort.TOO_LONG)
        if command & 0x01:
            if transfer.size is not None and len(transfer.data) != transfer.size:
                raise AccessRefused(Abort.LENGTH)
            self._objects.write(key_of(transfer.index, transfer.sub), transfer.data)
            self._transfer = None
        return bytes((0x20 | toggle,)) + bytes(7)

    def _block_upload(self, request: bytes, index: int, sub: int) -> list[bytes]:
        """One request of the client in a block upload; a short object goes the ordinary way if the client wishes."""
        command, transfer = request[0], self._transfer
        step = command & 0x03
        if step == 0:
            self._transfer = None
            data = self._objects.read(key_of(index, sub))
            block, switch_up_to = request[4:6]
            if switch_up_to and len(data) <= switch_up_to:
                return [self._initiate_upload(index, sub)]
            self._transfer = opened = BlockUpload(index, sub, data, block, bool(command & 0x04))
            return [opened.opened()]
        if not isinstance(transfer, BlockUpload):
            raise AccessRefused(Abort.UNKNOWN_COMMAND)
        if step == 3:
            return transfer.started()
        if step == 2:
            return transfer.acknowledged(request)
        transfer.closed()
        self._transfer = None
        return []

    def _block_download(self, request: bytes, index: int, sub: int) -> bytes:
        """The client's beginning or end of a block download; its segments go to the transfer at once."""
        command, transfer = request[0], self._transfer
        if not command & 0x01:
            self._transfer = None
            entry = self._objects.writable(key_of(index, sub))
            size = _U32.unpack_from(request, 4)[0] if command & 0x02 else None
            if size is not None:
                self._objects.check_size(entry, size)
            self._transfer = opened = BlockDownload(index, sub, size, entry.longest, bool(command & 0x04))
            return opened.opened()
        if not isinstance(transfer, BlockDownload):
            raise AccessRefused(Abort.UNKNOWN_COMMAND)
        self._objects.write(key_of(transfer.index, transfer.sub), transfer.closed(request))
        self._transfer = None
        return bytes((0xA1,)) + bytes(7)
