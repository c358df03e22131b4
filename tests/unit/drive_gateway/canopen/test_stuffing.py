"""The exact length of frames, against a checksum and a stuffing that go bit by bit."""

from hypothesis import given
from hypothesis import strategies as st

from drive_gateway.canopen.bus_load import frame_bits
from drive_gateway.canopen.frame import CanFrame
from drive_gateway.canopen.stuffing import exact_bits

FRAMES = st.builds(CanFrame, st.integers(0, 0x7FF), st.binary(max_size=8), st.booleans())


def bits_of(value: int, count: int) -> list[int]:
    return [value >> shift & 1 for shift in range(count - 1, -1, -1)]


def bit_by_bit(frame: CanFrame) -> int:
    stream = [0, *bits_of(frame.id, 11), int(frame.remote), 0, 0, *bits_of(len(frame.data), 4)]
    for byte in frame.data:
        stream += bits_of(byte, 8)
    crc = 0
    for bit in stream:
        turn = bit ^ (crc >> 14 & 1)
        crc = (crc << 1 & 0x7FFF) ^ (0x4599 if turn else 0)
    sent: list[int] = []
    for bit in stream + bits_of(crc, 15):
        sent.append(bit)
        if len(sent) >= 5 and len(set(sent[-5:])) == 1:
            sent.append(1 - bit)
    return len(sent) + 1 + 2 + 7 + 3


@given(FRAMES)
def test_length_equals_the_one_counted_bit_by_bit(frame: CanFrame) -> None:
    assert exact_bits(frame) == bit_by_bit(frame)


@given(FRAMES)
def test_length_is_between_no_stuffing_and_the_worst(frame: CanFrame) -> None:
    length = len(frame.data)
    assert 47 + 8 * length <= exact_bits(frame) <= frame_bits(length)


def test_sync_is_short() -> None:
    assert exact_bits(CanFrame(0x080, b"")) == bit_by_bit(CanFrame(0x080, b"")) <= 55
