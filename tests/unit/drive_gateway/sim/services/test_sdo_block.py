"""Block transfers of the SDO server: the `canopen` library's client as the other side, and bytes for refusals."""

from binascii import crc_hqx
from collections.abc import Callable
from typing import Any

import canopen
import pytest
from canopen.sdo.client import SdoClient
from hypothesis import given, settings
from hypothesis import strategies as st

from drive_gateway.gateway.bus.sdo_transfer import read_object, write_object
from drive_gateway.sim.services.abort import Abort
from drive_gateway.sim.services.dictionary import LONGEST_DOMAIN, STORE_EDS, key_of, load_dictionary
from drive_gateway.sim.services.objects import Objects
from drive_gateway.sim.services.sdo_server import SdoServer

MEMORY = 0x2001
EDS = load_dictionary().entries[key_of(STORE_EDS)].text
LARGE = bytes(number * 37 % 251 for number in range(1500))


class Line:
    """A client and a server; `lost` says which frames the wire swallows, by their count from 0 and their bytes."""

    def __init__(
        self,
        lost: Callable[[int, bytes], bool] = lambda _count, _data: False,
        answered: Callable[[bytes], list[bytes]] | None = None,
    ) -> None:
        self.objects = Objects(load_dictionary(), 1)
        self._answered = answered or SdoServer(self.objects).answer
        self._lost = lost
        self.requests: list[bytes] = []
        self.answers: list[bytes] = []
        self.count = 0
        client: Any = SdoClient(0x601, 0x581, canopen.ObjectDictionary())  # type: ignore[no-untyped-call]
        client.network = self
        client.RESPONSE_TIMEOUT = 0.2
        self.client = client

    def send_message(self, _can_id: int, data: bytes) -> None:
        self.requests.append(bytes(data))
        if self._swallowed(data):
            return
        for answer in self._answered(bytes(data)):
            self.answers.append(answer)
            if not self._swallowed(answer):
                self.client.on_response(0x581, answer, 0.0)

    def _swallowed(self, data: bytes) -> bool:
        self.count += 1
        return self._lost(self.count - 1, bytes(data))

    def upload(self, index: int) -> bytes:
        with self.client.open(index, 0, "rb", buffering=0, block_transfer=True) as stream:
            return bytes(stream.read())

    def download(self, index: int, data: bytes) -> None:
        with self.client.open(index, 0, "wb", size=len(data), block_transfer=True) as stream:
            stream.write(data)


def once(*counts: int) -> Callable[[int, bytes], bool]:
    return lambda count, _data: count in counts


def test_the_library_uploads_the_eds_of_the_drive_in_blocks() -> None:
    line = Line()
    assert line.upload(STORE_EDS) == EDS
    assert len(EDS) > 20_000
    assert max(answer[0] & 0x7F for answer in line.answers[1:-1]) == 127


@settings(max_examples=15)
@given(st.binary(max_size=LONGEST_DOMAIN).filter(len))
def test_what_the_library_downloads_in_blocks_it_uploads_again(data: bytes) -> None:
    line = Line()
    line.download(MEMORY, data)
    assert line.objects.read(key_of(MEMORY)) == data
    assert line.upload(MEMORY) == data


@pytest.mark.parametrize("segment", [1, 2, 60, 126])
def test_a_lost_segment_of_a_download_is_sent_again(segment: int) -> None:
    line = Line(once(1 + segment))
    line.download(MEMORY, LARGE)
    assert line.objects.read(key_of(MEMORY)) == LARGE
    repeated = 127 - (segment - 1)
    segments = -(-len(LARGE) // 7)
    assert len(line.requests) == 2 + segments + repeated


@pytest.mark.parametrize("segment", [1, 2, 60, 126, 129, 300])
def test_a_lost_segment_of_an_upload_is_sent_again(segment: int) -> None:
    line = Line(once(2 + segment))
    assert line.upload(STORE_EDS) == EDS
    assert not any(request[0] == 0x80 for request in line.requests)


def test_an_upload_may_change_the_size_of_its_sub_blocks() -> None:
    server = SdoServer(Objects(load_dictionary(), 1))
    assert server.answer(bytes.fromhex("A4 21 10 00 02 00 00 00"))[0][:4] == bytes.fromhex("C6 21 10 00")
    first = server.answer(bytes.fromhex("A3 00 00 00 00 00 00 00"))
    second = server.answer(bytes.fromhex("A2 01 03 00 00 00 00 00"))
    numbers = [[frame[0] for frame in frames] for frames in (first, second)]
    assert numbers == [[1, 2], [1, 2, 3]]
    assert first[1][1:] == second[0][1:] == EDS[7:14]


def test_an_object_as_short_as_the_client_says_goes_the_ordinary_way() -> None:
    assert answers("A4 17 10 00 7F 04 00 00") == ["4B 17 10 00 00 00 00 00"]


def test_the_crc_is_the_one_of_the_standard() -> None:
    # CiA 301 gives 31C3h as the CRC of the text 123456789.
    line = Line()
    line.download(MEMORY, b"123456789")
    assert line.requests[-1][:3] == bytes.fromhex("D5 C3 31")
    assert line.upload(MEMORY) == b"123456789"
    assert line.answers[-1][:3] == bytes.fromhex("D5 C3 31")


def test_without_a_crc_both_ways_work_too() -> None:
    opened = answers("C2 01 20 00 03 00 00 00", "81 61 62 63 00 00 00 00", "D1 00 00 00 00 00 00 00")
    assert opened == ["A4 01 20 00 7F 00 00 00", "A2 01 7F 00 00 00 00 00", "A1 00 00 00 00 00 00 00"]


def test_user_memory_outlives_a_reset_only_when_it_was_stored() -> None:
    line = Line()
    line.download(MEMORY, b"stored text")
    line.objects.save()
    line.download(MEMORY, b"another one")
    line.objects.restore(range(0x10000))
    assert line.objects.read(key_of(MEMORY)) == b"stored text"


def answers(*requests: str) -> list[str]:
    server = SdoServer(Objects(load_dictionary(), 1))
    server_answers = [server.answer(bytes.fromhex(request)) for request in requests]
    return [frame.hex(" ").upper() for frames in server_answers for frame in frames]


OPEN_DOWNLOAD = "C6 01 20 00 03 00 00 00"
OPEN_UPLOAD = "A4 21 10 00 7F 00 00 00"
START = "A3 00 00 00 00 00 00 00"
LAST_ABC = "81 61 62 63 00 00 00 00"


@pytest.mark.parametrize(
    ("requests", "code", "address"),
    [
        (["A4 21 10 00 00 00 00 00"], Abort.BLOCK_SIZE, "21 10 00"),
        (["A4 21 10 00 80 00 00 00"], Abort.BLOCK_SIZE, "21 10 00"),
        ([OPEN_UPLOAD, START, "A2 7F 00 00 00 00 00 00"], Abort.BLOCK_SIZE, "21 10 00"),
        (["A4 21 10 00 02 00 00 00", START, "A2 03 7F 00 00 00 00 00"], Abort.SEQUENCE, "21 10 00"),
        ([OPEN_DOWNLOAD, "00 61 62 63 00 00 00 00"], Abort.SEQUENCE, "01 20 00"),
        ([OPEN_DOWNLOAD, LAST_ABC, "D1 01 00 00 00 00 00 00"], Abort.CRC, "01 20 00"),
        ([OPEN_DOWNLOAD, LAST_ABC, "CD 00 00 00 00 00 00 00"], Abort.LENGTH, "01 20 00"),
        ([OPEN_DOWNLOAD, "01 61 62 63 64 65 66 67"], Abort.TOO_LONG, "01 20 00"),
        (["C6 01 20 00 01 10 00 00"], Abort.TOO_LONG, "01 20 00"),
        (["C6 81 60 00 03 00 00 00"], Abort.TOO_SHORT, "81 60 00"),
        (["C6 21 10 00 03 00 00 00"], Abort.READ_ONLY, "21 10 00"),
        (["C6 00 30 00 03 00 00 00"], Abort.NO_OBJECT, "00 30 00"),
        (["A4 18 10 09 7F 00 00 00"], Abort.NO_SUB_INDEX, "18 10 09"),
        ([START], Abort.UNKNOWN_COMMAND, "00 00 00"),
        ([OPEN_UPLOAD, START, START], Abort.UNKNOWN_COMMAND, "21 10 00"),
        ([OPEN_UPLOAD, "A2 00 7F 00 00 00 00 00"], Abort.UNKNOWN_COMMAND, "21 10 00"),
        ([OPEN_UPLOAD, START, "A1 00 00 00 00 00 00 00"], Abort.UNKNOWN_COMMAND, "21 10 00"),
        (["C1 00 00 00 00 00 00 00"], Abort.UNKNOWN_COMMAND, "00 00 00"),
    ],
)
def test_a_refusal_has_its_code_and_its_object(requests: list[str], code: Abort, address: str) -> None:
    assert answers(*requests)[-1] == f"80 {address} {int(code).to_bytes(4, 'little').hex(' ').upper()}"
    assert code in canopen.SdoAbortedError.CODES


def test_after_an_abort_within_the_segments_the_next_transfer_works() -> None:
    last = answers(OPEN_DOWNLOAD, "80 01 20 00 00 00 00 08", "40 17 10 00 00 00 00 00")[-1]
    assert last == "4B 17 10 00 00 00 00 00"


def test_a_wrong_value_in_a_block_is_refused_like_any_other() -> None:
    crc = crc_hqx(b"\4\0", 0).to_bytes(2, "little").hex(" ")
    frames = answers("C6 07 60 00 02 00 00 00", "81 04 00 00 00 00 00 00", f"D5 {crc} 00 00 00 00 00")
    assert frames[-1] == "80 07 60 00 31 00 09 06"


# The gateway's own use of the library


def test_the_gateway_takes_blocks_for_large_objects_only() -> None:
    line = Line()
    write_object(line.client, MEMORY, 0, LARGE)
    assert read_object(line.client, MEMORY, 0) == LARGE
    assert [request[0] for request in line.requests if request[1:4] == bytes.fromhex("01 20 00")] == [
        0xC6,
        0x40,
        0x80,
        0xA4,
    ]
    assert read_object(line.client, 0x1008, 0) == b"zencell simulated drive"
    assert line.requests[-1][0] in (0x60, 0x70)


@pytest.mark.parametrize("from_end", [1, 2, 3])
def test_what_the_library_cannot_repeat_in_blocks_is_written_in_segments(from_end: int) -> None:
    """The last segments, where the server's answer or the client's memory of them is missing."""
    segments = -(-len(LARGE) // 7)
    answered = (segments - 1) // 127  # answers to full sub-blocks come between
    line = Line(once(1 + 1 + segments + answered - from_end))
    write_object(line.client, MEMORY, 0, LARGE)
    assert line.objects.read(key_of(MEMORY)) == LARGE
    assert read_object(line.client, MEMORY, 0) == LARGE


@pytest.mark.parametrize("with_crc", [True, False])
@pytest.mark.parametrize("frame", [127, 128], ids=["last segment of a sub-block", "answer to a sub-block"])
def test_what_the_library_reads_wrongly_after_a_time_out_is_read_again_in_segments(frame: int, with_crc: bool) -> None:
    server = SdoServer(objects := Objects(load_dictionary(), 1))
    objects.write(key_of(MEMORY), LARGE)

    def node(request: bytes) -> list[bytes]:
        without = request[0] == 0xA4 and not with_crc
        frames = server.answer(b"\xa0" + request[1:] if without else request)
        return [bytes((frame[0] & ~0x04,)) + frame[1:] for frame in frames] if without else frames

    line = Line(once(2 + 1 + 2 + frame), node)  # read_object asks for the size and aborts before it begins in blocks
    assert read_object(line.client, MEMORY, 0) == LARGE
    assert any(request[0] == 0x60 for request in line.requests)


def test_a_lost_end_of_an_upload_is_made_good_in_segments() -> None:
    lost: list[bytes] = []

    def first_end(_count: int, data: bytes) -> bool:
        ended = not lost and data[0] & 0xE3 == 0xC1 and data[3:] == bytes(5)
        lost.extend([data] if ended else [])
        return ended

    line = Line(first_end)
    line.objects.write(key_of(MEMORY), LARGE)
    assert read_object(line.client, MEMORY, 0) == LARGE
    assert len(lost) == 1


def test_a_node_without_block_transfers_is_served_in_segments() -> None:
    objects = Objects(load_dictionary(), 1)
    server = SdoServer(objects)

    def old_node(request: bytes) -> list[bytes]:
        if request[0] >> 5 in (5, 6):
            return [b"\x80" + request[1:4] + int(Abort.UNKNOWN_COMMAND).to_bytes(4, "little")]
        return server.answer(request)

    line = Line(answered=old_node)
    write_object(line.client, MEMORY, 0, LARGE)
    assert read_object(line.client, MEMORY, 0) == LARGE
    assert objects.read(key_of(MEMORY)) == LARGE


def test_a_refusal_of_a_large_object_is_not_tried_again() -> None:
    line = Line()
    with pytest.raises(canopen.SdoAbortedError) as refusal:
        write_object(line.client, STORE_EDS, 0, LARGE)
    assert refusal.value.code == Abort.READ_ONLY
    assert len(line.requests) == 1


@settings(max_examples=10, deadline=None)
@given(st.sets(st.integers(0, 300), max_size=4))
def test_whatever_is_lost_the_object_is_whole_or_the_transfer_fails(lost: set[int]) -> None:
    line = Line(once(*lost))
    line.client.RESPONSE_TIMEOUT = 0.005
    try:
        write_object(line.client, MEMORY, 0, LARGE[:1000])
        assert line.objects.read(key_of(MEMORY)) == LARGE[:1000]
        assert read_object(line.client, MEMORY, 0) == LARGE[:1000]
    except (canopen.SdoAbortedError, canopen.SdoCommunicationError):
        assert line.objects.read(key_of(MEMORY)) in (b"", LARGE[:1000])
