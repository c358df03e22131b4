"""Every message survives the way over the wire; bytes that are no message give `CodecError` and nothing else."""

import dataclasses
import math
from enum import Enum
from typing import Any, get_args, get_origin, get_type_hints

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from cell.messages import (
    AxisStatus,
    Body,
    Call,
    Command,
    DriveFeedback,
    Heard,
    OutputEvent,
    PlayoutState,
    Presence,
    Reply,
    ResetEstop,
    ResetRobot,
    SetpointBlock,
)
from cell.net.codec import COMMANDS, decode, decode_call, encode, encode_call
from cell.net.errors import CodecError
from cell.net.keys import STATE_KINDS

FINITE = st.floats(allow_nan=False, allow_infinity=False)
NAMES = st.text(st.characters(codec="utf-8"), max_size=12)
COUNTS = st.integers(0, 2**63 - 1)
PLAIN: dict[object, st.SearchStrategy[Any]] = {
    float: FINITE,
    int: st.integers(-(2**63), 2**63 - 1),
    str: NAMES,
    bool: st.booleans(),
    type(None): st.none(),
}


def of(kind: Any) -> st.SearchStrategy[Any]:
    """Any value of a message's field type."""
    if kind in PLAIN:
        return PLAIN[kind]
    if dataclasses.is_dataclass(kind):
        hints = get_type_hints(kind)
        return st.builds(kind, **{field.name: of(hints[field.name]) for field in dataclasses.fields(kind)})
    if isinstance(kind, type) and issubclass(kind, Enum):
        return st.sampled_from(kind)
    parts = get_args(kind)
    if get_origin(kind) is dict:
        return st.dictionaries(of(parts[0]), of(parts[1]), max_size=3)
    if get_origin(kind) is tuple and parts[-1] is Ellipsis:
        return st.lists(of(parts[0]), max_size=3).map(tuple)
    if get_origin(kind) is tuple:
        return st.tuples(*map(of, parts))
    return st.one_of(*map(of, parts))


@st.composite
def blocks(draw: st.DrawFn) -> SetpointBlock:
    shape = draw(st.tuples(st.integers(1, 5), st.integers(1, 4)))
    samples = arrays(np.float64, shape, elements=FINITE)
    numbers = [draw(COUNTS) for _ in range(4)]
    dt_s, nominal = draw(st.floats(1e-6, 1e6)), draw(st.integers(0, shape[0]))
    torque = draw(st.none() | samples)
    events = draw(
        st.lists(st.builds(OutputEvent, COUNTS, COUNTS, st.integers(0, 2**16 - 1), st.booleans()), max_size=3)
    )
    last = torque, tuple(events), draw(st.booleans())
    return SetpointBlock(draw(NAMES), *numbers, dt_s, nominal, draw(samples), draw(samples), *last)


@st.composite
def feedbacks(draw: st.DrawFn) -> DriveFeedback:
    axes = draw(st.lists(st.sampled_from(AxisStatus), max_size=5).map(tuple))
    values = arrays(np.float64, len(axes), elements=FINITE)
    numbers = [draw(COUNTS) for _ in range(4)]
    level, flags = draw(st.integers(0, 2**32 - 1)), draw(st.tuples(st.booleans(), st.booleans()))
    state, refused = draw(st.sampled_from(PlayoutState)), draw(COUNTS)
    positions = [draw(values) for _ in range(3)]
    last = draw(st.none() | values), draw(st.integers(0, 2**32 - 1)), draw(COUNTS)
    return DriveFeedback(draw(NAMES), draw(NAMES), *numbers, state, level, refused, *flags, *positions, axes, *last)


def messages(kind: type) -> st.SearchStrategy[Any]:
    special = {SetpointBlock: blocks(), DriveFeedback: feedbacks()}
    return special[kind] if kind in special else of(kind)


def same(a: object, b: object) -> bool:
    """Equality that looks into arrays."""
    pairs = [(getattr(a, f.name), getattr(b, f.name)) for f in dataclasses.fields(a)]  # type: ignore[arg-type]
    return type(a) is type(b) and all(np.array_equal(x, y) if isinstance(x, np.ndarray) else x == y for x, y in pairs)


@pytest.mark.parametrize("kind", [*STATE_KINDS, Reply], ids=lambda kind: kind.__name__)
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


@pytest.mark.parametrize("kind", [*STATE_KINDS, Reply], ids=lambda kind: kind.__name__)
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
    data = encode(block())
    assert data[:4] == b"ZSB3"
    assert data[54:64] == b"\x04\x00\x00\x00\x00\x00left"
    assert np.frombuffer(data[64:112], "<f8").tolist() == [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]
    assert len(data) == 60 + 4 + 2 * 48


def test_the_torque_of_a_block_comes_behind_its_velocity_and_is_announced() -> None:
    torque = np.array([[7.0, 8.0], [9.0, 10.0], [11.0, 12.0]])
    data = encode(block(torque=torque))
    assert data[56:58] == b"\x01\x00"
    assert np.frombuffer(data[-48:], "<f8").tolist() == torque.ravel().tolist()
    assert len(data) == 60 + 4 + 3 * 48


def test_the_events_of_a_block_come_behind_its_name() -> None:
    data = encode(block(events=(OutputEvent(11, 3, 1, True),)))
    assert data[58:60] == b"\x01\x00"
    assert data[64:83] == b"\x0b" + bytes(7) + b"\x03" + bytes(7) + b"\x01\x00\x01"
    with pytest.raises(CodecError, match="an output is 0 or 1"):
        decode(SetpointBlock, data[:82] + b"\x02" + data[83:])


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
    with pytest.raises(CodecError, match="magic b'ZSB2', expected b'ZSB3'"):
        decode(SetpointBlock, b"ZSB2" + encode(block())[4:])


def test_bytes_behind_a_block_are_refused() -> None:
    with pytest.raises(CodecError, match="the header asks for"):
        decode(SetpointBlock, encode(block()) + b"\0")


PRESENCE = Presence("left", "b", 1, None, "d", Body(False, (0.0, 0.0, 0.0), 1.0), 0.5)


@pytest.mark.parametrize("stop_time_s", [math.nan, math.inf, -math.inf])
def test_a_reading_that_is_no_number_is_not_encoded(stop_time_s: float) -> None:
    with pytest.raises(CodecError, match="stop_time_s"):
        encode(dataclasses.replace(PRESENCE, stop_time_s=stop_time_s))


def test_a_number_that_is_none_is_refused_on_arrival_too() -> None:
    data = encode(PRESENCE).replace(b'"stop_time_s":0.5', b'"stop_time_s":NaN')
    with pytest.raises(CodecError, match="finite"):
        decode(Presence, data)


def test_the_word_nan_in_a_text_may_travel() -> None:
    message = dataclasses.replace(PRESENCE, robot="NaN")
    assert decode(Presence, encode(message)) == message


@pytest.mark.parametrize(
    ("old", "new", "where"),
    [
        (b'"digest":"d"', b'"digest":"d","extra":1', "extra"),
        (b'"known":false', b'"known":false,"more":1', "body.more"),
        (b'"sequence":1', b'"sequence":"1"', "sequence"),
        (b'"digest":"d",', b"", "digest"),
    ],
)
def test_a_wrong_field_is_refused_by_its_name(old: bytes, new: bytes, where: str) -> None:
    with pytest.raises(CodecError, match=f"Presence: {where}: "):
        decode(Presence, encode(PRESENCE).replace(old, new))
