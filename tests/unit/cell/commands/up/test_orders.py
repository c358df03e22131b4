"""An order that is repeated is carried out once, and one that is refused is not given for ever."""

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import pytest

from cell.commands.client.connection import ask_until_answered
from cell.commands.up import orders as module
from cell.commands.up.orders import Orders
from cell.messages import Call, Heard, Mode, ProgramState, ProgramStatus, Reply, RobotState, Run
from cell.net.errors import CallError, CallTimedOut
from cell.net.session import new_call

DEADLINE_S = 20.0


class Agent:
    """Answers calls to one robot as its `answer` says; stands for a session."""

    def __init__(self, answer: Callable[[Call, int], Reply | CallError]) -> None:
        self.calls: list[Call] = []
        self._answer = answer

    def ask(self, _to: str, call: Call, _timeout_s: float) -> Reply:
        self.calls.append(call)
        outcome = self._answer(call, len(self.calls))
        if isinstance(outcome, CallError):
            raise outcome
        return outcome

    @property
    def ids(self) -> set[str]:
        return {call.id for call in self.calls}


def lost(_call: Call, _count: int = 0) -> CallError:
    return CallTimedOut("robot/left", "run", "no answer in time")


def lost_once(call: Call, count: int) -> Reply | CallError:
    return lost(call) if count == 1 else Reply(call.id, True, "runs")


def state(mode: Mode = Mode.READY, boot: str = "b1", sequence: int = 1) -> RobotState:
    status = ProgramStatus("left.prog", ProgramState.LOADED, 1, "")
    return RobotState("left", boot, sequence, mode, status, None, None, None, None, None)


@contextmanager
def given(agent: Agent) -> Iterator[Orders]:
    with Orders(agent, Run()) as orders:  # type: ignore[arg-type]
        yield orders


def give_until(orders: Orders, condition: Callable[[], object], told: Callable[[], RobotState] = state) -> None:
    deadline = time.monotonic() + DEADLINE_S
    pause = threading.Event()
    while not condition():
        assert time.monotonic() < deadline, "did not happen in time"
        orders.give(told())
        pause.wait(0.01)


@pytest.fixture(autouse=True)
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "RETRY_S", 0.02)
    monkeypatch.setattr(module, "PATIENCE_S", 1.0)


def test_an_order_whose_answer_was_lost_is_repeated_under_its_id_and_with_its_echo() -> None:
    agent = Agent(lost_once)
    with given(agent) as orders:
        give_until(orders, lambda: "left" in orders.obeyed)
    assert len(agent.calls) == 2
    assert agent.calls[0] == agent.calls[1]


def test_it_is_repeated_without_waiting_for_the_robot_to_be_ready_again() -> None:
    agent = Agent(lost_once)
    with given(agent) as orders:
        orders.give(state())
        deadline = time.monotonic() + DEADLINE_S
        while len(agent.calls) < 2 and time.monotonic() < deadline:
            threading.Event().wait(0.01)
        give_until(orders, lambda: "left" in orders.obeyed)
    assert len(agent.ids) == 1


def test_an_order_that_nobody_answers_is_given_up_and_told_once() -> None:
    agent = Agent(lost)
    with given(agent) as orders:
        give_until(orders, lambda: orders.given_up)
        told = orders.take_given_up()
        for _ in range(20):
            orders.give(state())
        assert orders.take_given_up() == {}
    assert "no answer in time" in told["left"]
    assert "may have been carried out" in told["left"]
    assert len(agent.ids) == 1


def test_a_refused_order_is_given_anew_for_a_while_and_then_told_with_its_reason() -> None:
    agent = Agent(lambda call, _: Reply(call.id, False, "left has a negative override"))
    with given(agent) as orders:
        give_until(orders, lambda: orders.given_up)
        count = len(agent.calls)
        assert orders.take_given_up() == {"left": "left has a negative override"}
        for _ in range(20):
            orders.give(state())
        assert orders.obeyed == set()
    assert len(agent.calls) == count == len(agent.ids) > 1


def test_an_order_that_was_refused_as_too_old_is_given_anew_in_view_of_the_newest_state() -> None:
    def too_old_once(call: Call, count: int) -> Reply:
        return Reply(call.id, count > 1, "the call is too old to be carried out" if count == 1 else "runs")

    agent, sequences = Agent(too_old_once), iter(range(1, 10_000))
    with given(agent) as orders:
        give_until(orders, lambda: "left" in orders.obeyed, lambda: state(sequence=next(sequences)))
    first, second = agent.calls
    assert first.id != second.id
    assert first.heard is not None
    assert second.heard is not None
    assert second.heard.sequence > first.heard.sequence


def test_a_refusal_by_an_agent_that_was_started_anew_says_nothing_about_the_one_before() -> None:
    agent = Agent(lambda call, _: Reply(call.id, False, "it answers a state that is no longer known"))
    with given(agent) as orders:
        orders.give(state(boot="b1"))
        give_until(orders, lambda: orders.given_up, lambda: state(boot="b2"))
        told = orders.take_given_up()
    assert len(agent.calls) == 1
    assert "started anew" in told["left"]


def test_the_last_reason_is_raised_when_nobody_answers_in_time() -> None:
    agent = Agent(lost)
    with pytest.raises(CallTimedOut):
        ask_until_answered(agent, "robot/left", new_call(Run(), Heard("b1", 1)), 0.3)  # type: ignore[arg-type]
    assert len(agent.ids) == 1


def test_an_operators_order_is_repeated_under_its_id() -> None:
    agent, call = Agent(lost_once), new_call(Run(), Heard("b1", 1))
    assert ask_until_answered(agent, "robot/left", call, 5.0).ok  # type: ignore[arg-type]
    assert agent.calls == [call, call]


def test_an_order_that_nothing_dates_is_not_repeated() -> None:
    agent = Agent(lost_once)
    with pytest.raises(CallTimedOut):
        ask_until_answered(agent, "gateway/bus", new_call(Run()), 5.0)  # type: ignore[arg-type]
    assert len(agent.calls) == 1
