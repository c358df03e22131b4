"""The exact length of a CAN frame on the wire: checksum and stuff bits of its own content (ISO 11898-1).

After five equal bits between start of frame and the end of the checksum the sender inserts the opposite one. Both the
checksum and the stuffing go byte by byte through tables, because a simulated bus asks for every frame.
"""

from functools import cache, lru_cache

from drive_gateway.canopen.frame import CanFrame

_POLYNOMIAL = 0x4599
"""x^15 + x^14 + x^10 + x^8 + x^7 + x^4 + x^3 + 1"""
_TAIL_BITS = 13
"""Checksum delimiter, acknowledge with its delimiter, end of frame, and three bits between frames."""


@lru_cache(maxsize=4096)
def exact_bits(frame: CanFrame) -> int:
    """Bits that this frame occupies, with the space after it."""
    length = len(frame.data)
    head = frame.id << 7 | frame.remote << 6 | length
    stream = int.from_bytes(head.to_bytes(3, "big") + frame.data, "big")
    whole = (stream << 15 | _checksum(stream, length + 3)).to_bytes(length + 5, "big")
    # 34 bits and the data: start of frame and the first bit of the identifier, then whole bytes.
    state, stuffed = (_state(1, 1) if frame.id & 0x400 else _state(0, 2)), 0
    table = _stuffing()
    for byte in whole[1:]:
        more, state = table[state][byte]
        stuffed += more
    return 8 * length + 34 + stuffed + _TAIL_BITS


def _checksum(stream: int, length: int) -> int:
    crc, table = 0, _crc_table()
    for byte in stream.to_bytes(length, "big"):
        crc = (crc << 8 & 0x7FFF) ^ table[crc >> 7 ^ byte]
    return crc


@cache
def _crc_table() -> tuple[int, ...]:
    table = []
    for byte in range(256):
        crc = byte << 7
        for _ in range(8):
            crc = (crc << 1 ^ (_POLYNOMIAL if crc & 0x4000 else 0)) & 0x7FFF
        table.append(crc)
    return tuple(table)


def _state(bit: int, run: int) -> int:
    """The newest bit and how often it came in a row, 1 to 5."""
    return 5 * bit + run - 1


@cache
def _stuffing() -> tuple[tuple[tuple[int, int], ...], ...]:
    """By state and byte: stuff bits inserted, next state."""
    return tuple(tuple(_stuff(state, byte) for byte in range(256)) for state in range(10))


def _stuff(state: int, byte: int) -> tuple[int, int]:
    last, run, stuffed = state // 5, state % 5 + 1, 0
    for shift in range(7, -1, -1):
        bit = byte >> shift & 1
        run = run + 1 if bit == last else 1
        last = bit
        if run == 5:
            stuffed += 1
            last, run = 1 - bit, 1
    return stuffed, _state(last, run)
