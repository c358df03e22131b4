"""Every message survives the way over the wire; bytes that are no message give `CodecError` and nothing else."""

import dataclasses
import itertools
import json
import math
import struct
import time
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cell.messages import (
    COMMANDS,
    STATES,
    Arrival,
    Body,
    Call,
    CellTime,
    Command,
    Correction,
    Deadlock,
    Estop,
    Heard,
    ManagerState,
    MeetingStatus,
    OutputEvent,
    PlannedWay,
    Presence,
    Reply,
    ResetEstop,
    ResetRobot,
    Run,
    Sections,
    SetpointBlock,
    SetupStatus,
    Stay,
    Token,
    Way,
    ZoneGeometry,
    ZoneState,
    ZoneStatus,
)
from cell.messages.estop import LONGEST_WORDS
from cell.net.codec import MOST_BYTES, MOST_URGENT_BYTES, MOST_VALUES, decode, decode_call, encode, encode_call
from cell.net.errors import CodecError
from cell.net.estops import MOST_LISTED
from tests.unit.message_kinds import NAMES, messages, of, same
from tests.unit.plain_body import plain_body


@pytest.mark.parametrize("kind", [*STATES, Reply], ids=lambda kind: kind.__name__)
def test_every_message_comes_back_as_it_was_sent(kind: type) -> None:
    @settings(max_examples=40, deadline=None)
    @given(messages(kind))
    def check(message: object) -> None:
        assert same(decode(kind, encode(message)), message)

    check()


@pytest.mark.parametrize("role", COMMANDS)
def test_every_call_comes_back_as_it_was_sent(role: str) -> None:
    @settings(max_examples=40, deadline=None)
    @given(st.sampled_from(sorted(COMMANDS[role])).flatmap(lambda verb: of(COMMANDS[role][verb])), NAMES)
    def check(command: Command, call_id: str) -> None:
        call = Call(call_id, command, Heard("b", 1))
        assert decode_call(f"{role}/x", command.verb, encode_call(call)) == call

    check()


def test_the_same_verb_is_another_command_for_another_role() -> None:
    assert decode_call("robot/left", "reset", encode_call(Call("1", ResetRobot()))).command == ResetRobot()
    assert decode_call("manager", "reset", encode_call(Call("1", ResetEstop("me", ("e1",))))).command == ResetEstop(
        "me", ("e1",)
    )


@pytest.mark.parametrize("kind", [*STATES, Reply], ids=lambda kind: kind.__name__)
def test_broken_bytes_are_a_codec_error(kind: type) -> None:
    @settings(max_examples=60, deadline=None)
    @given(messages(kind).map(encode), st.data())
    def check(good: bytes, data: st.DataObject) -> None:
        broken = bytearray(good)
        for _ in range(data.draw(st.integers(1, 3))):
            where = data.draw(st.integers(0, len(broken) - 1))
            broken[where] = data.draw(st.integers(0, 255))
        for candidate in (bytes(broken), good[: data.draw(st.integers(0, len(good)))], data.draw(st.binary())):
            try:
                decode(kind, candidate)
            except CodecError:
                continue

    check()


@given(st.sampled_from(["robot/left", "manager", "gateway/g", "", "nobody"]), NAMES | st.just("run"), st.binary())
def test_a_broken_call_is_a_codec_error(to: str, verb: str, data: bytes) -> None:
    with pytest.raises(CodecError):
        decode_call(to, verb, data)


def block(**changes: Any) -> SetpointBlock:
    samples = np.array([[1.0, 2.0], [3.0, 4.0], [5.0, 6.0]])
    return dataclasses.replace(SetpointBlock("left", 1, 2, 1, 10, 0.004, 2, samples, samples), **changes)


def test_the_layout_of_a_block_is_the_documented_one() -> None:
    data = encode(block(epoch=9))
    assert data[:4] == b"ZSB4"
    assert data[54:60] == b"\x04\x00\x00\x00\x00\x00"
    assert data[60:72] == b"\x09" + bytes(7) + b"left"
    assert np.frombuffer(data[72:120], "<f8").tolist() == [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]
    assert len(data) == 68 + 4 + 2 * 48


def test_the_torque_of_a_block_comes_behind_its_velocity_and_is_announced() -> None:
    torque = np.array([[7.0, 8.0], [9.0, 10.0], [11.0, 12.0]])
    data = encode(block(torque=torque))
    assert data[56:58] == b"\x01\x00"
    assert np.frombuffer(data[-48:], "<f8").tolist() == torque.ravel().tolist()
    assert len(data) == 68 + 4 + 3 * 48


def test_the_events_of_a_block_come_behind_its_name() -> None:
    data = encode(block(events=(OutputEvent(11, 3, 1, True),)))
    assert data[58:60] == b"\x01\x00"
    assert data[72:91] == b"\x0b" + bytes(7) + b"\x03" + bytes(7) + b"\x01\x00\x01"
    with pytest.raises(CodecError, match="an output is 0 or 1"):
        decode(SetpointBlock, data[:90] + b"\x02" + data[91:])


def test_flags_of_a_later_version_are_refused() -> None:
    data = encode(block())
    with pytest.raises(CodecError, match="only bits 0 and 1 are in use"):
        decode(SetpointBlock, data[:56] + b"\x04\x00" + data[58:])


def test_a_block_of_a_program_that_runs_is_announced() -> None:
    assert encode(block(program=True))[56:58] == b"\x02\x00"


@pytest.mark.parametrize(
    "change",
    [
        {"position": np.full((3, 2), math.nan)},
        {"velocity": np.zeros((2, 2))},
        {"torque": np.zeros((2, 2))},
        {"torque": np.full((3, 2), math.inf)},
        {"position": np.zeros((0, 2)), "velocity": np.zeros((0, 2))},
        {"nominal": 4},
        {"owner": -1},
        {"events": (OutputEvent(11, 3, 2**16, True),)},
        {"dt_s": 0.0},
        {"robot": "x" * 70000},
    ],
)
def test_a_block_that_must_not_travel_is_not_encoded(change: dict[str, Any]) -> None:
    with pytest.raises(CodecError):
        encode(block(**change))


def test_another_version_of_a_block_is_refused_by_its_magic() -> None:
    with pytest.raises(CodecError, match="magic b'ZSB3', expected b'ZSB4'"):
        decode(SetpointBlock, b"ZSB3" + encode(block())[4:])


def test_bytes_behind_a_block_are_refused() -> None:
    with pytest.raises(CodecError, match="the header asks for"):
        decode(SetpointBlock, encode(block()) + b"\0")


PRESENCE = Presence("left", "b", 1, 1, None, "d", Body(False, (0.0, 0.0, 0.0), 1.0), 0.5)


@pytest.mark.parametrize("stop_time_s", [math.nan, math.inf, -math.inf])
def test_a_reading_that_is_no_number_is_not_encoded(stop_time_s: float) -> None:
    with pytest.raises(CodecError, match="stop_time_s"):
        encode(dataclasses.replace(PRESENCE, stop_time_s=stop_time_s))


def test_a_number_that_is_none_is_refused_on_arrival_too() -> None:
    data = encode(PRESENCE).replace(b'"stop_time_s":0.5', b'"stop_time_s":NaN')  # as long as before
    with pytest.raises(CodecError, match="finite"):
        decode(Presence, data)


def test_the_word_nan_in_a_text_may_travel() -> None:
    message = dataclasses.replace(PRESENCE, robot="NaN")
    assert same(decode(Presence, encode(message)), message)


def with_head(data: bytes, old: bytes, new: bytes) -> bytes:
    """A presence in whose head `old` stands as `new`."""
    assert old in data
    length = int.from_bytes(data[4:8], "little") + len(new) - len(old)
    return data[:4] + length.to_bytes(4, "little") + data[8:].replace(old, new)


BODY = plain_body((0.1,), (((0.0, 0.0, 0.0, 0.1, 0.0, 0.0),),), (0.02,))


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        (b'"digest":"d"', b'"digest":"d","extra":1', "extra"),
        (b'"sequence":1', b'"sequence":"1"', "sequence"),
        (b'"digest":"d",', b"", "digest"),
        (b'"reach_m":1.0', b'"reach_m":1e300', "reach_m"),
        (b'"stop_time_s":0.5', b'"stop_time_s":-0.5', "stop_time_s"),
        (b'"sequence":1', b'"sequence":-1', "sequence"),
        (b'"robot":"left"', b'"robot":"%s"' % (b"x" * 200), "robot"),
    ],
)
def test_a_wrong_field_is_refused_by_its_name(old: bytes, new: bytes, says: str) -> None:
    data = with_head(encode(dataclasses.replace(PRESENCE, body=BODY)), old, new)
    with pytest.raises(CodecError, match=f"Presence: {says}: "):
        decode(Presence, data)


def test_the_layout_of_a_presence_is_the_documented_one() -> None:
    data = encode(dataclasses.replace(PRESENCE, body=BODY))
    end = 18 + int.from_bytes(data[4:8], "little")
    assert data[:4] == b"ZPR3"
    assert data[8:18] == b"\x01\x00\x01\x00" + bytes(6)
    assert json.loads(data[18:end])["known"] is True
    assert np.frombuffer(data[end:], "<f4").tolist() == np.float32([0.1, 0.02, 0, 0, 0, 0.1, 0, 0, 0.1, 0, 0]).tolist()


SECTION = Sections(np.uint64([7]), np.float32([[[[1, 2, 3], [4, 5, 6]]]]), np.float32([[0.25]]))


def test_the_layout_of_a_way_is_the_documented_one() -> None:
    way = Way(SECTION, 1, 1, ("hand",), plan=3, pieces=np.uint32([5]))
    data = encode(dataclasses.replace(PRESENCE, way=way))
    end = 18 + int.from_bytes(data[4:8], "little")
    assert data[8:18] == bytes(4) + b"\x01\x00\x01\x00\x01\x00"
    head = json.loads(data[18:end])
    assert (head["committed"], head["owned"], head["links"]) == (1, 1, ["hand"])
    assert data[end : end + 8] == b"\x07" + bytes(7)
    assert data[end + 8 : end + 12] == b"\x05" + bytes(3)
    assert np.frombuffer(data[end + 12 :], "<f4").tolist() == [0.25, 1, 2, 3, 4, 5, 6]


def test_the_layout_of_a_planned_way_is_the_documented_one() -> None:
    data = encode(PlannedWay("left", "b", 1, 2, more=True, pieces=SECTION, stays=(Stay("press", 0, 0),)))
    end = 12 + int.from_bytes(data[4:8], "little")
    assert (data[:4], data[8:12]) == (b"ZPW2", b"\x01\x00\x01\x00")
    assert json.loads(data[12:end]) == {
        "robot": "left", "boot": "b", "owner": 1, "number": 2, "more": True,
        "stays": [{"zone": "press", "first": 0, "last": 0}],
    }  # fmt: skip
    assert data[end : end + 8] == b"\x07" + bytes(7)
    assert np.frombuffer(data[end + 8 :], "<f4").tolist() == [0.25, 1, 2, 3, 4, 5, 6]


@pytest.mark.parametrize(
    ("way", "says"),
    [
        (Way(dataclasses.replace(SECTION, radii=np.float32([[-0.1]]))), "below zero"),
        (Way(dataclasses.replace(SECTION, points=np.full((1, 1, 2, 3), np.inf, np.float32))), "infinite"),
        (Way(dataclasses.replace(SECTION, ids=np.uint64([7, 8]))), "allowed are"),
        (Way(SECTION, pieces=np.uint32([1, 2])), "none or one of each"),
        (Way(Sections(np.uint64([7]), np.zeros((1, 0, 2, 3), np.float32), np.zeros((1, 0), np.float32))), "at least"),
    ],
)
def test_a_way_of_another_shape_does_not_travel(way: Way, says: str) -> None:
    with pytest.raises(CodecError, match=says):
        encode(dataclasses.replace(PRESENCE, way=way))


@pytest.mark.parametrize(("plan", "pieces"), [(0, [5]), (3, [])])
def test_pieces_without_a_plan_and_a_plan_without_pieces_are_refused(plan: int, pieces: list[int]) -> None:
    way = Way(SECTION, plan=plan, pieces=np.array(pieces, np.uint32))
    with pytest.raises(CodecError, match="one of each with a plan, none without"):
        decode(Presence, encode(dataclasses.replace(PRESENCE, way=way)))


def test_a_known_body_without_poses_is_refused() -> None:
    body = Body(True, (0.0, 0.0, 0.0), 1.0)
    with pytest.raises(CodecError, match="a body that is known, without poses"):
        decode(Presence, encode(dataclasses.replace(PRESENCE, body=body)))
    unknown = dataclasses.replace(PRESENCE, body=dataclasses.replace(body, known=False))
    assert not decode(Presence, encode(unknown)).body.known


@pytest.mark.parametrize(("first", "last"), [(0, 1), (1, 0), (1, 1)])
def test_a_stay_in_pieces_that_a_planned_way_does_not_have_is_refused(first: int, last: int) -> None:
    way = PlannedWay("left", "b", 1, 2, more=True, pieces=SECTION, stays=(Stay("press", first, last),))
    with pytest.raises(CodecError, match=f"a stay in zone press from piece {first} to {last} of 1"):
        decode(PlannedWay, encode(way))


@pytest.mark.parametrize(("committed", "owned"), [(1, 0), (0, 2), (2, 2)])
def test_a_way_of_which_more_is_owned_than_there_is_is_refused(committed: int, owned: int) -> None:
    with pytest.raises(CodecError, match="no more committed than owned"):
        decode(Presence, encode(dataclasses.replace(PRESENCE, way=Way(SECTION, committed, owned))))


@pytest.mark.parametrize(
    ("body", "says"),
    [
        ({"radii_m": np.float32([0.1, 0.1])}, "allowed are"),
        ({"growth_m": np.float32([0.02, 0.02])}, "allowed are"),
        ({"tcp_m": np.empty((0, 3), np.float32)}, "allowed are"),
        ({"tcp_m": np.full((1, 3), np.inf, np.float32)}, "infinite"),
        ({"radii_m": np.float32([-0.1])}, "below zero"),
        ({"growth_m": np.float32([-0.02])}, "below zero"),
        ({"poses": np.full((1, 1, 2, 3), np.nan, np.float32)}, "NaN"),
        ({"poses": np.full((1, 1, 2, 3), 2e6, np.float32)}, "beyond 1e\\+06 m"),
        ({"radii_m": np.zeros(51, np.float32), "poses": np.zeros((1, 51, 2, 3), np.float32)}, "up to 50 capsules"),
        ({"radii_m": np.zeros(0, np.float32), "poses": np.zeros((1, 0, 2, 3), np.float32)}, "at least one capsule"),
    ],
)
def test_a_body_of_another_shape_does_not_travel(body: dict[str, Any], says: str) -> None:
    with pytest.raises(CodecError, match=says):
        encode(dataclasses.replace(PRESENCE, body=dataclasses.replace(BODY, **body)))


@pytest.mark.parametrize(
    ("at", "new", "says"),
    [
        (8, b"\x02\x00", "the header asks for"),
        (8, b"\x00\x00", "the header asks for"),
        (10, b"\xff\xff", "the header asks for"),
        (-8, b"\x00\x00\xc0\x7f", "NaN"),
        (-44, b"\x00\x00\x80\xbf", "below zero"),
    ],
)
def test_a_presence_of_another_shape_is_refused_where_it_is_read(at: int, new: bytes, says: str) -> None:
    data = bytearray(encode(dataclasses.replace(PRESENCE, body=BODY)))
    data[at : at + len(new) if at > 0 else len(data) + at + len(new)] = new
    with pytest.raises(CodecError, match=says):
        decode(Presence, bytes(data))


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        (b'"size_m":[1.0,', b'"size_m":[0.0,', "size_m.0"),
        (b"0.0,1.0]", b"0.5,1.0]", "quaternion_xyzw has length 1.118"),
        (b'"box"', b'"cone"', "found 'cone', allowed one of box, sphere, cylinder"),
        (b'"box"', b'"cylinder"', "cylinder: found 3 lengths, allowed radius, length"),
        (b'"size_m":[1.0,', b'"size_m":[', "box: found 2 lengths, allowed x, y, z"),
    ],
)
def test_a_zone_that_is_no_solid_is_refused_where_it_is_read(old: bytes, new: bytes, says: str) -> None:
    data = encode(ZoneGeometry("middle", 1, (1.0, 1.0, 1.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0), ()))
    assert old in data
    with pytest.raises(CodecError, match=says):
        decode(ZoneGeometry, data.replace(old, new))


def test_a_time_beyond_every_clock_is_refused_where_it_is_read() -> None:
    late = CellTime("m", 1e300)
    with pytest.raises(CodecError, match=r"at\.seconds"):
        decode_call("robot/left", "run", encode_call(Call("1", Run(late))))
    with pytest.raises(CodecError, match=r"at\.seconds"):
        decode(Correction, encode(Correction("left", "seam", late, (0.0, 0.0, 0.0))))


def test_what_is_longer_than_any_message_is_refused_unread() -> None:
    with pytest.raises(CodecError, match="allowed are up to"):
        decode(Presence, b" " * (MOST_BYTES + 1))


def full_cell() -> ManagerState:
    """Sixteen robots, a zone for every two, for which eight wait, an emergency stop of each with a long reason.

    And sixteen meetings of all of them.
    """
    robots = [f"robot_number_{number}" for number in range(16)]
    long = "a reason, as a person gives it; " * 8
    zones = {
        f"between_{one}_and_{other}": ZoneStatus(ZoneState.OCCUPIED, one, Token(2, 7), tuple(robots[:8]), 3, 12.5, long)
        for one, other in itertools.combinations(robots, 2)
    }
    heard = {robot: Heard("0123456789abcdef", 123456) for robot in robots}
    texts = dict.fromkeys(robots, long)
    stops = tuple(Estop(robot, True, robot, long) for robot in robots)
    arrivals = {robot: Arrival("0123456789abcdef", 123456) for robot in robots}
    missing = dict.fromkeys(robots[8:], "which is there, but does not know cell time well enough")
    meetings = {f"meeting_{n}": MeetingStatus(tuple(robots[:8]), missing, arrivals, 12.5) for n in range(16)}
    return ManagerState(
        "cell", "boot", 2, 99, 12.5, "digest", heard, zones, texts, stops, SetupStatus("robot_number_0", False, long),
        texts, heard, (Deadlock(tuple(robots), tuple(robots), 1.0, long, long),), {f"f{n}": n for n in range(50)},
        meetings,
    )  # fmt: skip


def test_the_manager_of_a_full_cell_and_the_longest_reason_of_a_stop_are_read() -> None:
    state = full_cell()
    assert decode(ManagerState, encode(state)) == state
    longest = Estop("e" * 128, True, "\x01" * LONGEST_WORDS, "," * LONGEST_WORDS)
    assert decode(Estop, encode(longest)) == longest
    many = dataclasses.replace(state, estops=(longest,) * MOST_LISTED)
    assert decode(ManagerState, encode(many)) == many


@pytest.mark.parametrize("text", ["x" * 2**20, "," * 2**20, '\\",' * 2**18, "\\\\," * 2**18])
def test_a_stop_is_read_whatever_its_reason(text: str) -> None:
    data = b'{"id":"e1","active":true,"by":"me","reason":"' + text.encode() + b'"}'
    assert decode(Estop, data) == Estop("e1", True, "me", json.loads(f'"{text}"')[:LONGEST_WORDS])


_SHARED = b'"cell":"c","boot":"b","epoch":1,"sequence":1,"cell_time":1.0,"digest":"d"'


@pytest.mark.parametrize("count", [MOST_VALUES - 20, 20_000, 400_000], ids=["all that is read", "64 kB", "1 MB"])
@pytest.mark.parametrize(
    ("kind", "begins", "value", "ends"),
    [
        (ManagerState, b"{" + _SHARED + b',"deadlocks":[', b"{}", b"]}"),
        (ManagerState, b"{" + _SHARED + b',"estops":[', b"{}", b"]}"),
        (ManagerState, b"{" + _SHARED + b',"zones":{', b'"%d":{}', b"}}"),
        (ManagerState, b"{", b'"%d":0', b"}"),
        (Estop, b'{"id":"a","active":true,"by":"b","reason":"r",', b'"%d":0', b"}"),
    ],
    ids=["deadlocks", "stops", "zones", "unknown fields", "unknown fields of a stop"],
)
def test_nothing_that_anybody_sends_in_place_of_a_stop_takes_long_to_refuse(
    kind: type, begins: bytes, value: bytes, ends: bytes, count: int
) -> None:
    values = b",".join(value.replace(b"%d", b"%d" % number) for number in range(count))
    data = begins + values + ends

    def spent() -> float:
        before = time.process_time()
        with pytest.raises(CodecError):
            decode(kind, data)
        return time.process_time() - before

    assert min(spent() for _ in range(5)) < 0.06, "8 to 13 ms on a quiet machine; 230 where all of it is read"


@pytest.mark.parametrize("kind", [Estop, ManagerState])
def test_a_message_without_many_values_is_refused_by_its_length(kind: type) -> None:
    with pytest.raises(CodecError, match=f"allowed are up to {MOST_URGENT_BYTES}"):
        decode(kind, b" " * (MOST_URGENT_BYTES + 1))


def test_samples_whose_squares_overflow_are_refused_where_they_are_read() -> None:
    with pytest.raises(CodecError, match="beyond 1e\\+12"):
        decode(SetpointBlock, encode(block(position=np.full((3, 2), 1e200))))


def test_a_count_that_leaves_no_room_for_what_is_computed_from_it_is_refused() -> None:
    with pytest.raises(CodecError, match="a count of"):
        decode(SetpointBlock, encode(block(first_tick=2**64 - 1)))


@pytest.mark.parametrize(
    ("at", "layout", "value", "found"),
    [(58, "<H", 65_535, "65535 events"), (48, "<I", 2**31, "samples"), (48, "<IH", (10_000, 64), "numbers")],
)
def test_a_block_that_says_of_itself_that_it_is_too_large_is_refused_by_its_header(
    at: int, layout: str, value: int | tuple[int, int], found: str
) -> None:
    data = bytearray(encode(block(events=(OutputEvent(11, 3, 1, True),))) + bytes(65_535 * 19))
    struct.pack_into(layout, data, at, *(value if isinstance(value, tuple) else (value,)))
    with pytest.raises(CodecError, match=found):
        decode(SetpointBlock, bytes(data))


def test_a_block_whose_size_is_not_that_of_its_header_is_refused_before_it_is_read() -> None:
    data = encode(block(events=(OutputEvent(11, 3, 7, True),)))
    broken = bytearray(data[:-8])
    broken[60 + 4 + 18] = 7
    with pytest.raises(CodecError, match="bytes, the header asks for"):
        decode(SetpointBlock, bytes(broken))
