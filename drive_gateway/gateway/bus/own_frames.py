"""Keeps a udp_multicast bus from giving the frames of a handle back to it, which is most of what a gateway would read.

python-can writes the time stamp of a message first into the datagram and its receivers put their kernel's in its place:
so a time stamp that only one handle uses marks its frames, and a filter in the kernel drops them before anybody wakes.
A datagram that is laid out in another way is not recognised and comes through.
"""

import ctypes
import os
import random
import socket
import sys
from struct import Struct, pack

import can

_SO_ATTACH_FILTER = 26
_MARK_AT = 8 + 12
"""Header of UDP, then a map (1 byte), the key `timestamp` (10) and the type of a double (1)."""
_LOAD, _EQUAL, _RETURN = 0x20, 0x15, 0x06
"""Classic BPF: load a word, skip instructions by comparison, return how much of the packet is kept."""
_INSTRUCTION = Struct("=HBBI")
_ALL = 0xFFFFFFFF


def leave_out_own(bus: can.BusABC) -> float:
    """`bus` is a udp_multicast one: answers the time stamp that its messages must have from now on (0: as ever).

    Systems other than Linux have no such filter; there the frames still come back.
    """
    if sys.platform != "linux":
        return 0.0
    mark = random.uniform(1.0, 2.0)
    high, low = Struct(">II").unpack(pack(">d", mark))
    program = [
        (_LOAD, 0, 0, _MARK_AT),
        (_EQUAL, 0, 3, high),
        (_LOAD, 0, 0, _MARK_AT + 4),
        (_EQUAL, 0, 1, low),
        (_RETURN, 0, 0, 0),
        (_RETURN, 0, 0, _ALL),
    ]
    code = ctypes.create_string_buffer(b"".join(_INSTRUCTION.pack(*step) for step in program))
    with socket.socket(fileno=os.dup(bus.fileno())) as handle:
        handle.setsockopt(socket.SOL_SOCKET, _SO_ATTACH_FILTER, pack("@HP", len(program), ctypes.addressof(code)))
    return mark
