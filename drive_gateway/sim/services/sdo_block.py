"""The server's half of an SDO block transfer (CiA 301): sub-blocks of up to 127 segments, one answer for each.

Segments that the wire lost are sent again: the receiver names the last one of the unbroken row, and the sender goes on
after it. A CRC-16-CCITT over the whole object closes the transfer when both sides can compute it.
"""

from binascii import crc_hqx
from dataclasses import dataclass
from enum import Enum, auto
from struct import Struct

from drive_gateway.sim.services.abort import Abort, AccessRefused

LONGEST_BLOCK = 127
"""Segments that a sub-block may have; the number goes into seven bits."""
SEGMENT_BYTES = 7

_HEAD = Struct("<BHB")
_U32 = Struct("<I")
_CRC = Struct("<H")
_LAST = 0x80


class _Phase(Enum):
    OPENED = auto()
    SEGMENTS = auto()
    CLOSING = auto()


@dataclass(slots=True)
class BlockDownload:
    """Takes an object in. `size` is what the client announced, `longest` [bytes] what is taken at most."""

    index: int
    sub: int
    size: int | None
    longest: int
    with_crc: bool
    data: bytes = b""
    received: int = 0
    """Last segment of the unbroken row in this sub-block."""
    phase: _Phase = _Phase.SEGMENTS

    @property
    def takes_segments(self) -> bool:
        """The next frame is a segment, whatever its first byte would otherwise mean."""
        return self.phase is _Phase.SEGMENTS

    def opened(self) -> bytes:
        """The answer that lets the client begin."""
        return _HEAD.pack(0xA4, self.index, self.sub) + bytes((LONGEST_BLOCK, 0, 0, 0))

    def segment(self, request: bytes) -> list[bytes]:
        """Take one segment; the last of a sub-block is answered.

        Raises:
            AccessRefused: the number 0 is none, or more bytes came than announced or fit.
        """
        number, last = request[0] & 0x7F, bool(request[0] & _LAST)
        if not number:
            raise AccessRefused(Abort.SEQUENCE)
        taken = number == self.received + 1
        if taken:
            self.received = number
            self.data += request[1:]
            fewest = len(self.data) - (SEGMENT_BYTES if last else 0)
            if fewest > (self.longest if self.size is None else self.size):
                raise AccessRefused(Abort.TOO_LONG)
        if not last and number < LONGEST_BLOCK:
            return []
        answer = bytes((0xA2, self.received, LONGEST_BLOCK)) + bytes(5)
        self.received = 0
        if last and taken:
            self.phase = _Phase.CLOSING
        return [answer]

    def closed(self, request: bytes) -> bytes:
        """The object, after the client's end of the transfer.

        Raises:
            AccessRefused: segments are missing, or length or CRC do not match.
        """
        if self.phase is not _Phase.CLOSING:
            raise AccessRefused(Abort.UNKNOWN_COMMAND)
        data = self.data[: len(self.data) - (request[0] >> 2 & 0x07)]
        if self.size is not None and len(data) != self.size:
            raise AccessRefused(Abort.LENGTH)
        if self.with_crc and _CRC.unpack_from(request, 1)[0] != crc_hqx(data, 0):
            raise AccessRefused(Abort.CRC)
        return data


@dataclass(slots=True)
class BlockUpload:
    """Gives an object out. `block` is the number of segments that the client takes in one row."""

    index: int
    sub: int
    data: bytes
    block: int
    with_crc: bool
    position: int = 0
    """First byte of the sub-block that is on its way."""
    sent: int = 0
    phase: _Phase = _Phase.OPENED

    def opened(self) -> bytes:
        """The answer that tells the client what comes.

        Raises:
            AccessRefused: a sub-block of that many segments does not exist.
        """
        self._check_block()
        return _HEAD.pack(0xC6, self.index, self.sub) + _U32.pack(len(self.data))

    def started(self) -> list[bytes]:
        """The first sub-block.

        Raises:
            AccessRefused: the transfer has begun already.
        """
        if self.phase is not _Phase.OPENED:
            raise AccessRefused(Abort.UNKNOWN_COMMAND)
        self.phase = _Phase.SEGMENTS
        return self._sub_block()

    def acknowledged(self, request: bytes) -> list[bytes]:
        """What follows the client's answer to a sub-block: its lost segments and the next ones, or the end.

        Raises:
            AccessRefused: no sub-block is on its way, a segment is acknowledged that was not sent, or the
                next sub-block has a size that does not exist.
        """
        if self.phase is not _Phase.SEGMENTS:
            raise AccessRefused(Abort.UNKNOWN_COMMAND)
        _, arrived, self.block = request[:3]
        if arrived > self.sent:
            raise AccessRefused(Abort.SEQUENCE)
        self._check_block()
        complete = arrived == self.sent and self.position + SEGMENT_BYTES * arrived >= len(self.data)
        if not complete:
            self.position += SEGMENT_BYTES * arrived
            return self._sub_block()
        self.phase = _Phase.CLOSING
        unused = -len(self.data) % SEGMENT_BYTES if self.data else SEGMENT_BYTES
        crc = crc_hqx(self.data, 0) if self.with_crc else 0
        return [bytes((0xC1 | unused << 2,)) + _CRC.pack(crc) + bytes(5)]

    def closed(self) -> None:
        """The client has everything.

        Raises:
            AccessRefused: it cannot have.
        """
        if self.phase is not _Phase.CLOSING:
            raise AccessRefused(Abort.UNKNOWN_COMMAND)

    def _check_block(self) -> None:
        if not 1 <= self.block <= LONGEST_BLOCK:
            raise AccessRefused(Abort.BLOCK_SIZE)

    def _sub_block(self) -> list[bytes]:
        rest = self.data[self.position : self.position + SEGMENT_BYTES * self.block]
        parts = [rest[at : at + SEGMENT_BYTES] for at in range(0, max(1, len(rest)), SEGMENT_BYTES)]
        self.sent = len(parts)
        ends = self.position + len(rest) == len(self.data)
        heads = [number | (_LAST if ends and number == self.sent else 0) for number in range(1, self.sent + 1)]
        return [bytes((head,)) + part.ljust(SEGMENT_BYTES, b"\0") for head, part in zip(heads, parts, strict=True)]
