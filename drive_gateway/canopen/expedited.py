"""One short object read by two frames (CiA 301, 7.2.4.3): the expedited upload of SDO, and its abort."""

from dataclasses import dataclass
from struct import Struct

from drive_gateway.canopen.cob_id import SDO_TO_NODE
from drive_gateway.canopen.frame import CanFrame

_UPLOAD, _ABORT = 0x40, 0x80
_ADDRESS = Struct("<HB")
_FRAME = Struct("<BHBI")
_BYTES = 8
"""Of each SDO frame, whatever of it is used."""
_UNNAMED = bytes(3)
"""Some servers leave the object out of their aborts."""
_EXPEDITED, _SIZED = 2, 1
_GENERAL_ERROR = 0x08000000


@dataclass(frozen=True, slots=True)
class Answer:
    """The bytes of the object, or the code with which the node refuses it."""

    data: bytes
    abort_code: int | None = None


def upload(node_id: int, index: int, sub: int) -> CanFrame:
    """Asks a node for an object."""
    return CanFrame(SDO_TO_NODE + node_id, _FRAME.pack(_UPLOAD, index, sub, 0))


def abort(node_id: int, index: int, sub: int) -> CanFrame:
    """Lets a node forget what it was asked for; it answers nothing to this, and may be asked for something else."""
    return CanFrame(SDO_TO_NODE + node_id, _FRAME.pack(_ABORT, index, sub, _GENERAL_ERROR))


def answer_of(data: bytes, index: int, sub: int) -> Answer | None:
    """What a frame of the node's SDO server says of an object; `None`: nothing, or more than fits into the frame.

    A server that does not tell the size has four bytes in its frame, of which the object may use fewer.
    """
    if len(data) != _BYTES:
        return None
    head, address = data[0], data[1:4]
    named = address == _ADDRESS.pack(index, sub)
    if head == _ABORT and (named or address == _UNNAMED):
        return Answer(b"", int.from_bytes(data[4:], "little"))
    if not named or head & 0xE0 != _UPLOAD or not head & _EXPEDITED:
        return None
    return Answer(data[4 : 8 - (head >> 2 & 3)] if head & _SIZED else data[4:])
