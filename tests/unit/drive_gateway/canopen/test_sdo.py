"""One SDO request per node at a time, in order."""

import threading
from contextlib import nullcontext
from queue import SimpleQueue

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drive_gateway.canopen.abort_text import abort_text
from drive_gateway.canopen.frame import CanFrame
from drive_gateway.canopen.sdo import Dialogue, Sdo, SdoChannel, SdoDone, SdoRead, SdoWrite
from drive_gateway.gateway.bus.sdo_workers import SdoWorkers
from tests.unit.repository import vectors

WRITES = vectors("canopen_frames.json")["sdo"]


def reading(index: int, answers: list[SdoDone]) -> Dialogue:
    answers.append((yield SdoRead(index, 0)))


def test_a_dialogue_goes_on_with_each_answer_until_it_ends_or_is_closed() -> None:
    channel, answers = SdoChannel(3), list[bytes]()

    def write_and_read_back() -> Dialogue:
        yield SdoWrite(0x6060, 0, b"\x08")
        while True:
            answers.append((yield SdoRead(0x6061, 0)).data)

    dialogue = write_and_read_back()
    channel.follow(dialogue, axis=2)
    sent = []
    for answer in (b"", b"\x01", b"\x08"):
        request = channel.poll()
        assert request is not None
        sent.append((request.index, request.data))
        channel.done(SdoDone(request.request_id, answer))
    assert sent == [(0x6860, b"\x08"), (0x6861, None), (0x6861, None)]
    assert answers == [b"\x01", b"\x08"]
    dialogue.close()
    assert channel.poll() is None


def test_the_answer_to_a_dialogue_that_was_closed_frees_the_node_for_the_next_one() -> None:
    channel, answers = SdoChannel(3), list[SdoDone]()
    first, second = reading(0x6041, answers), reading(0x6064, answers)
    channel.follow(first)
    channel.follow(second)
    request = channel.poll()
    assert request is not None
    first.close()
    assert channel.poll() is None
    channel.done(SdoDone(request.request_id, b"\x01"))
    following = channel.poll()
    assert following is not None
    assert (following.index, answers) == (0x6064, [])


def test_dialogues_of_one_node_take_turns() -> None:
    channel = SdoChannel(3)

    def both(index: int) -> Dialogue:
        yield SdoRead(index, 1)
        yield SdoRead(index, 2)

    for index in (0x2001, 0x2002):
        channel.follow(both(index))
    order = []
    while (request := channel.poll()) is not None:
        order.append((request.index, request.sub))
        channel.done(SdoDone(request.request_id, b""))
    assert order == [(0x2001, 1), (0x2002, 1), (0x2001, 2), (0x2002, 2)]


def test_a_second_request_waits_for_the_answer_to_the_first() -> None:
    channel, answers = SdoChannel(3), list[SdoDone]()
    channel.follow(reading(0x6040, answers))
    channel.follow(reading(0x6041, answers))
    first = channel.poll()
    assert first is not None
    assert channel.poll() is None
    channel.done(SdoDone(first.request_id, b"\1"))
    second = channel.poll()
    assert second is not None
    assert (first.index, second.index, len(answers)) == (0x6040, 0x6041, 1)


def test_the_outcome_of_a_forgotten_request_interests_nobody_but_frees_the_node() -> None:
    channel, answers = SdoChannel(3), list[SdoDone]()
    channel.follow(reading(0x6040, answers))
    first = channel.poll()
    assert first is not None
    channel.forget()
    channel.follow(reading(0x6041, answers))
    assert channel.poll() is None
    channel.done(SdoDone(first.request_id, b""))
    assert answers == []
    assert channel.poll() is not None


def test_what_an_operator_asked_is_answered_although_the_node_is_brought_up_anew() -> None:
    channel, answers = SdoChannel(3), list[SdoDone]()
    channel.follow(reading(0x6040, answers), asked=True)
    channel.follow(reading(0x6041, answers))
    channel.follow(reading(0x6042, answers), asked=True)
    for index in (0x6040, 0x6042):
        request = channel.poll()
        assert request is not None
        assert request.index == index
        channel.forget()
        channel.done(SdoDone(request.request_id, b"", problem="no answer"))
    assert len(answers) == 2
    assert channel.poll() is None


def test_an_abort_is_told_by_number_and_name() -> None:
    assert abort_text(0x06020000) == "abort 06020000h, object does not exist"


class _Node:
    """Answers requests as bytes, in the thread that sends them."""

    def __init__(self, *answers: str | bytes, timeout_s: float = 0.5) -> None:
        self.answers = [bytes.fromhex(answer) if isinstance(answer, str) else answer for answer in answers]
        self.requests: list[bytes] = []
        self.outcomes: SimpleQueue[SdoDone] = SimpleQueue()
        self.workers = SdoWorkers([1], self.send, nullcontext, self.outcomes.put, timeout_s)

    def send(self, frame: CanFrame) -> None:
        self.requests.append(frame.data)
        if self.answers:
            self.workers.take(CanFrame(0x581, self.answers.pop(0)))

    def ask(self, index: int, sub: int, data: bytes | None) -> SdoDone:
        with self.workers:
            self.workers.submit(Sdo("1/1", 1, index, sub, data))
            return self.outcomes.get(timeout=5.0)


@pytest.mark.parametrize("vector", WRITES, ids=lambda vector: vector["what"])
def test_a_write_is_the_printed_request(vector: dict[str, str]) -> None:
    node = _Node("60 " + vector["request"][3:11] + " 00 00 00 00")
    outcome = node.ask(int(vector["index"], 16), int(vector["sub"]), bytes.fromhex(vector["data"]))
    assert (outcome.problem, node.requests) == ("", [bytes.fromhex(vector["request"])])


def test_a_read_gives_the_bytes_of_the_answer() -> None:
    node = _Node("43 64 60 00 70 FE FF FF")
    outcome = node.ask(0x6064, 0, None)
    assert int.from_bytes(outcome.data, "little", signed=True) == -400
    assert node.requests[0] == bytes.fromhex("40 64 60 00 00 00 00 00")


def test_a_refused_write_comes_back_with_its_abort_code() -> None:
    outcome = _Node("80 41 60 00 02 00 01 06").ask(0x6041, 0, b"\0\0")
    assert outcome.abort_code == 0x06010002
    assert "read only" in outcome.problem


@pytest.mark.parametrize("data", [None, b"\1\0"], ids=["read", "write"])
@pytest.mark.parametrize("answer", ["", "80", "60", "80 41 60 00", "80 41 60 00 02 00 01", "4b 41 60 00"])
def test_an_answer_that_is_too_short_is_told_with_its_length(answer: str, data: bytes | None) -> None:
    outcome = _Node(answer, timeout_s=0.005).ask(0x6041, 0, data)
    assert outcome.abort_code is None
    assert f"an answer had {len(bytes.fromhex(answer))} bytes, allowed are 8" in outcome.problem


def test_an_answer_to_nobody_who_waits_is_left_to_others() -> None:
    """The gateway reads some objects by frames of its own."""
    node = _Node("43 64 60 00 70 FE FF FF")
    answer = CanFrame(0x581, bytes.fromhex("4B 78 60 00 FA 00 00 00"))
    assert not node.workers.take(answer)
    node.ask(0x6064, 0, None)
    assert not node.workers.take(answer)


def test_a_short_segment_is_told_too() -> None:
    node = _Node("41 08 10 00 20 00 00 00", "00 43 4D", timeout_s=0.005)
    assert "an answer had 3 bytes" in node.ask(0x1008, 0, None).problem


ANSWERS = st.builds(
    lambda command, rest: bytes([command, *rest]),
    st.sampled_from(bytes.fromhex("00 01 0f 10 20 30 41 43 4f 60 80 81 a0 a1 a2 a4 c0 c1 c2 c6 ff")),
    st.binary(max_size=7) | st.binary(min_size=7, max_size=7),
)


@given(
    answers=st.lists(ANSWERS, max_size=5),
    data=st.sampled_from([None, b"\1\0", bytes(9), bytes(70)]),
)
@settings(max_examples=12, deadline=None)
def test_whatever_a_node_answers_the_request_has_an_outcome(answers: list[bytes], data: bytes | None) -> None:
    node = _Node(*answers, timeout_s=0.002)
    outcome = node.ask(0x6041, 0, data)
    assert outcome.request_id == "1/1"
    assert node.outcomes.empty()


def test_a_failure_that_nobody_foresaw_is_an_outcome_too() -> None:
    node = _Node()
    node.workers = SdoWorkers([1], lambda frame: {}[frame.id], nullcontext, node.outcomes.put, 0.5)
    assert node.ask(0x6041, 0, None).problem == "the SDO transfer failed (KeyError: 1537)"


def test_the_late_answer_to_a_request_whose_time_was_over_confirms_no_other() -> None:
    node = _Node("60 83 60 00 00 00 00 00")
    refusal = CanFrame(0x581, bytes.fromhex("80 84 60 00 22 00 00 08"))
    answer = threading.Timer(0.05, lambda: node.workers.take(refusal))
    answer.start()
    outcome = node.ask(0x6084, 0, bytes(4))
    answer.join()
    assert outcome.abort_code == 0x08000022


def test_segments_of_a_block_upload_are_taken_whatever_they_begin_with() -> None:
    text = bytes(number % 251 for number in range(7 * 70))
    opened = "C2 08 10 00 " + len(text).to_bytes(4, "little").hex()
    node = _Node("41 08 10 00 " + len(text).to_bytes(4, "little").hex())
    sent = node.send

    def send(frame: CanFrame) -> None:
        if frame.data[0] >> 5 == 5 and frame.data[0] & 3 == 0:
            node.answers = [bytes.fromhex(opened)]
        sent(frame)
        if frame.data[0] == 0xA3:
            for number in range(70):
                last = 0x80 if number == 69 else 0
                node.workers.take(CanFrame(0x581, bytes([number + 1 | last]) + text[7 * number : 7 * number + 7]))
        if frame.data[0] == 0xA2:
            node.workers.take(CanFrame(0x581, bytes([0xC1, 0, 0]) + bytes(5)))

    node.workers = SdoWorkers([1], send, nullcontext, node.outcomes.put, 0.5)
    outcome = node.ask(0x1008, 0, None)
    assert (outcome.problem, outcome.data) == ("", text)
