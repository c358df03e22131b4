"""The serving side of calls: an id is carried out once, for as long as anybody repeats it."""

from types import SimpleNamespace

import pytest

from cell.core import Answer, Request
from cell.messages import Call, Reply, Run
from cell.net.calls import REMEMBER_S, REMEMBERED, WAITING_LIMIT, Calls
from cell.net.codec import decode, encode_call
from cell.net.keys import Keys
from cell.net.session import new_call

KEYS = Keys("line")


class Query:
    """A query as Zenoh hands it over; keeps what it is answered."""

    def __init__(self, call: Call) -> None:
        self.key_expr = KEYS.command("robot/left", call.command.verb)
        self.payload = SimpleNamespace(to_bytes=lambda: encode_call(call))
        self.replies: list[Reply] = []
        self.errors: list[str] = []

    def reply(self, _key: str, data: bytes, **_: object) -> None:
        self.replies.append(decode(Reply, data))

    def reply_err(self, reason: str, **_: object) -> None:
        self.errors.append(reason)

    def drop(self) -> None:
        pass


class Serving:
    """`Calls` on virtual time; the core answers when the test says so."""

    def __init__(self) -> None:
        self.now = 100.0
        self.calls = Calls(KEYS, "robot/left", lambda: self.now)

    def ask(self, call: Call) -> tuple[Query, list[Request]]:
        """One query of this call, and what the core is asked for because of it."""
        query = Query(call)
        self.calls.store(query)  # type: ignore[arg-type]
        return query, self.calls.take()

    def answer(self, request: Request, text: str = "runs") -> None:
        assert isinstance(request.call, Call)
        self.calls.answer(Answer(request.request_id, Reply(request.call.id, True, text)))


@pytest.fixture
def serving() -> Serving:
    return Serving()


def test_a_repeated_run_gets_the_first_outcome_and_is_not_carried_out_again(serving: Serving) -> None:
    call = new_call(Run())
    _, [request] = serving.ask(call)
    serving.answer(request)
    serving.now += REMEMBER_S - 1.0
    again, requests = serving.ask(call)
    assert requests == []
    assert again.replies == [Reply(call.id, True, "runs")]


def test_many_other_calls_do_not_make_it_forget_an_outcome_that_may_be_asked_for(serving: Serving) -> None:
    call = new_call(Run())
    _, [request] = serving.ask(call)
    serving.answer(request)
    for _ in range(REMEMBERED - 1):
        serving.now += 0.01
        _, [other] = serving.ask(new_call(Run()))
        serving.answer(other)
    again, requests = serving.ask(call)
    assert (requests, len(again.replies)) == ([], 1)


def test_what_nobody_can_ask_for_any_more_is_forgotten(serving: Serving) -> None:
    call = new_call(Run())
    _, [request] = serving.ask(call)
    serving.answer(request)
    serving.now += REMEMBER_S + 1.0
    _, requests = serving.ask(call)
    assert len(requests) == 1  # the echo dates it: an agent refuses it as too old


def test_a_call_that_is_repeated_after_its_time_out_joins_what_is_still_under_way(serving: Serving) -> None:
    call = new_call(Run())
    first, [request] = serving.ask(call)
    serving.now += Run.answer_within_s + 0.1
    assert serving.calls.take() == []
    assert ["may still be carried out" in error for error in first.errors] == [True]
    second, requests = serving.ask(call)
    assert requests == []
    serving.answer(request)
    assert second.replies == [Reply(call.id, True, "runs")]
    assert first.replies == []


def test_each_repetition_has_its_own_time_out(serving: Serving) -> None:
    call = new_call(Run())
    first, _ = serving.ask(call)
    serving.now += Run.answer_within_s / 2
    second, _ = serving.ask(call)
    serving.now += Run.answer_within_s / 2 + 0.1
    serving.calls.take()
    assert (len(first.errors), len(second.errors)) == (1, 0)


def test_calls_that_nobody_waits_for_any_more_do_not_keep_new_ones_out(serving: Serving) -> None:
    for _ in range(WAITING_LIMIT):
        serving.ask(new_call(Run()))
    refused, requests = serving.ask(new_call(Run()))
    assert (requests, len(refused.errors)) == ([], 1)
    serving.now += Run.answer_within_s + 0.1
    serving.calls.take()
    _, requests = serving.ask(new_call(Run()))
    assert len(requests) == 1


def test_who_still_waits_is_told_that_the_process_stops(serving: Serving) -> None:
    waiting, _ = serving.ask(new_call(Run()))
    serving.calls.close()
    assert waiting.errors == ["the process stops; this may have been carried out"]
