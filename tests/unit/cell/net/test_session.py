"""Real sessions over loopback, all in one process: the topology of the cell, calls, tokens and the orderly end."""

import socket
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack

import numpy as np
import pytest
import zenoh

from cell.core import Answer, Ask, AskDone
from cell.messages import (
    AxisStatus,
    Body,
    DriveFeedback,
    Estop,
    Halt,
    ManagerState,
    PlayoutState,
    Presence,
    Reply,
    Run,
    SetpointBlock,
    TokenGone,
    Who,
)
from cell.net.calls import Calls
from cell.net.errors import CallFailed, CallTimedOut, EndpointInUse, NetError, NoAnswer, Unreachable
from cell.net.keys import Alive
from cell.net.session import CellSession, Link, new_call
from tests.ports import free_endpoint

CELL = "test_cell"
DEADLINE_S = 10.0

MAYBE = "If it was, this may have been carried out"


def wait_for(condition: Callable[[], object], each: Callable[[], object] = lambda: None) -> None:
    """Do `each` until `condition` holds; fails at the deadline."""
    deadline = time.monotonic() + DEADLINE_S
    pause = threading.Event()
    while not condition():
        assert time.monotonic() < deadline, "did not happen in time"
        each()
        pause.wait(0.01)


def presence(robot: str, sequence: int = 1) -> Presence:
    return Presence(robot, "b1", 1, sequence, None, "digest", Body(False, (0.0, 0.0, 0.0), 1.0), 0.0)


def feedback(robot: str, sequence: int = 1) -> DriveFeedback:
    zero, axes = np.zeros(1), (AxisStatus.SWITCH_ON_DISABLED,)
    state = PlayoutState.FOLLOWING
    return DriveFeedback(robot, "g1", sequence, 1, 0, 0, state, 0, 0, True, False, zero, zero, zero, axes)


class Cell:
    """A manager, a gateway, an agent and a view, linked as in `docs/architecture.md`, section 3."""

    def __init__(self) -> None:
        self.rendezvous, self.bus = free_endpoint(), free_endpoint()
        self.stack = ExitStack()

    def manager(self) -> CellSession:
        return CellSession(CELL, Link("peer", listen=(self.rendezvous,), gossip=True), "manager", "manager", "m1")

    def gateway(self) -> CellSession:
        link = Link("peer", listen=(self.bus,), connect=(self.rendezvous,))
        return self.stack.enter_context(CellSession(CELL, link, "gateway", "bus", "g1"))

    def agent(self, name: str = "left") -> CellSession:
        link = Link("peer", connect=(self.rendezvous, self.bus), gossip=True)
        return self.stack.enter_context(CellSession(CELL, link, "robot", name, "b1"))

    def view(self) -> CellSession:
        link = Link("client", connect=(self.rendezvous,), open_timeout_s=5.0)
        return self.stack.enter_context(CellSession(CELL, link, "view", "test", "v1"))


@pytest.fixture
def cell() -> Iterator[Cell]:
    cell = Cell()
    with cell.stack:
        yield cell


class Server:
    """Answers calls of one session in a thread until closed."""

    def __init__(self, calls: Calls, text: str) -> None:
        self.calls, self.text = calls, text
        self.requests: list[str] = []
        self.stop = threading.Event()
        self.thread = threading.Thread(target=self._serve)

    def _serve(self) -> None:
        while not self.stop.wait(0.002):
            for request in self.calls.take():
                self.requests.append(request.call.command.verb)  # type: ignore[attr-defined]
                self.calls.answer(Answer(request.request_id, Reply(request.call.id, True, self.text)))  # type: ignore[attr-defined]

    def __enter__(self) -> "Server":
        self.thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.stop.set()
        self.thread.join(DEADLINE_S)


def hears(latest: object, kind: type, send: Callable[[], object]) -> None:
    got: list[object] = []
    wait_for(lambda: any(isinstance(m, kind) for m in got), lambda: (send(), got.extend(latest.take_new())))  # type: ignore[attr-defined]


def test_everybody_hears_whom_the_design_says_and_the_direct_link_outlives_the_manager(cell: Cell) -> None:
    gateway, agent = cell.gateway(), cell.agent()
    drives, setpoints = agent.watch("robot/left/drives"), gateway.watch("robot/*/setpoints")
    manager_state, estop = agent.watch("manager/state"), gateway.queue("estop")
    block = SetpointBlock("left", 1, 1, 0, 1, 0.004, 1, np.zeros((1, 1)), np.zeros((1, 1)))
    with cell.manager() as manager:
        presences = manager.watch("robot/*/presence")
        wait_for(lambda: agent.links() == manager.links() == 2)
        view = cell.view()
        everything = view.watch("**")
        hears(presences, Presence, lambda: agent.publish(presence("left")))
        hears(everything, Presence, lambda: agent.publish(presence("left")))
        hears(everything, DriveFeedback, lambda: gateway.publish(feedback("left")))
        hears(manager_state, ManagerState, lambda: manager.publish(ManagerState(CELL, "m1", 1, 1, 0.0, "d")))
        wait_for(estop.take, lambda: view.publish(Estop("e1", True, "view", "test")))
    wait_for(lambda: agent.links() == 1)
    drives.take_new(), setpoints.take_new()
    hears(drives, DriveFeedback, lambda: gateway.publish(feedback("left")))
    hears(setpoints, SetpointBlock, lambda: agent.publish(block))
    with cell.manager() as manager:
        presences = manager.watch("robot/*/presence")
        hears(presences, Presence, lambda: agent.publish(presence("left")))
        everything.take_new()
        hears(everything, DriveFeedback, lambda: gateway.publish(feedback("left")))
        hears(everything, Presence, lambda: agent.publish(presence("left")))


def test_a_client_of_the_manager_hears_the_large_streams_in_bundles(cell: Cell) -> None:
    with cell.manager():
        view, gateway, agent = cell.view(), cell.gateway(), cell.agent()
        heard: list[tuple[str, bytes, float]] = []
        view.hear_bundles(lambda *message: heard.append(message))
        numbers = iter(range(1, 10_000))

        def publish() -> None:
            number = next(numbers)
            gateway.publish(feedback("left", number))
            agent.publish(presence("left", number))

        keys = {view.keys.of(feedback("left")), view.keys.of(presence("left"))}
        wait_for(lambda: {key for key, _, _ in heard} == keys, publish)
    assert all(isinstance(view.decoder.decode(key, payload), DriveFeedback | Presence) for key, payload, _ in heard)
    assert all(0.0 <= age_s < DEADLINE_S for _, _, age_s in heard)


def test_a_client_of_the_manager_reaches_agents_and_gateways_with_calls(cell: Cell) -> None:
    with ExitStack() as stack:
        manager = stack.enter_context(cell.manager())
        gateway, agent = cell.gateway(), cell.agent()
        wait_for(lambda: manager.links() == 2)
        for session, prefix in ((manager, "manager"), (gateway, "gateway/bus"), (agent, "robot/left")):
            stack.enter_context(Server(session.serve(prefix), f"I am {prefix}"))
        view = cell.view()
        for to in ("manager", "gateway/bus", "robot/left"):
            replies: list[Reply] = []

            def ask(to: str = to, replies: list[Reply] = replies) -> None:
                try:
                    replies.append(view.ask(to, new_call(Who()), 2.0))
                except NoAnswer:
                    return

            wait_for(lambda replies=replies: replies, ask)
            assert replies[0].text == f"I am {to}"


@pytest.fixture
def pair(cell: Cell) -> tuple[CellSession, CellSession]:
    """A listening gateway and an agent that is linked to it."""
    gateway, agent = cell.gateway(), cell.agent()
    wait_for(lambda: agent.links() == 1)
    return gateway, agent


def test_nobody_an_error_and_a_time_out_are_three_outcomes(pair: tuple[CellSession, CellSession]) -> None:
    gateway, agent = pair
    with pytest.raises(NoAnswer, match=r"nobody answers.*may have been carried out"):
        agent.ask("gateway/bus", new_call(Who()), 2.0)
    calls = gateway.serve("gateway/bus")

    def asked(verb_command: object) -> list[object]:
        agent.ask_later(Ask("probe", "gateway/bus", new_call(verb_command), 0.2))  # type: ignore[arg-type]
        return calls.take()

    wait_for(lambda: asked(Who()))
    with pytest.raises(CallTimedOut, match="may have been carried out"):
        agent.ask("gateway/bus", new_call(Who()), 0.1)
    with (
        Server(calls, "hello"),
        pytest.raises(CallFailed, match=r"verb 'run' is unknown to gateway/bus; allowed: .*claim"),
    ):
        agent.ask("gateway/bus", new_call(Run()), 2.0)


def test_a_call_repeated_under_its_id_is_carried_out_once(pair: tuple[CellSession, CellSession]) -> None:
    gateway, agent = pair
    with Server(gateway.serve("gateway/bus"), "done") as server:
        call, replies = new_call(Who()), []

        def ask() -> None:
            try:
                replies.append(agent.ask("gateway/bus", call, 2.0))
            except NoAnswer:
                return

        wait_for(lambda: len(replies) == 3, ask)
        assert server.requests == ["who"]


def test_a_later_answer_comes_back_as_ask_done(pair: tuple[CellSession, CellSession]) -> None:
    gateway, agent = pair
    done: list[object] = []
    with Server(gateway.serve("gateway/bus"), "later"):

        def ask() -> None:
            agent.ask_later(Ask("a1", "gateway/bus", new_call(Who()), 2.0))
            done.extend(agent.outcomes())

        wait_for(lambda: any(isinstance(d, AskDone) and d.reply is not None for d in done), ask)
    failed = [d for d in done if isinstance(d, AskDone) and d.reply is None]
    assert all("nobody answers" in d.problem for d in failed)


def test_a_call_to_nobody_comes_back_as_ask_done_with_its_problem(pair: tuple[CellSession, CellSession]) -> None:
    _, agent = pair
    done: list[object] = []
    agent.ask_later(Ask("a1", "robot/right", new_call(Halt()), 2.0))
    wait_for(lambda: done, lambda: done.extend(agent.outcomes()))
    assert done == [AskDone("a1", None, f"halt to robot/right: nobody answers; is it running? {MAYBE}")]


def test_who_waits_when_a_server_closes_is_told_so(pair: tuple[CellSession, CellSession]) -> None:
    gateway, agent = pair
    calls = gateway.serve("gateway/bus")
    taken: list[object] = []

    def ask() -> None:
        agent.ask_later(Ask("a1", "gateway/bus", new_call(Who()), 5.0))
        taken.extend(calls.take())

    wait_for(lambda: taken, ask)
    gateway.close()
    done: list[object] = []
    wait_for(lambda: any("process stops" in d.problem for d in done), lambda: done.extend(agent.outcomes()))  # type: ignore[attr-defined]


def test_a_token_is_seen_and_its_end_is_a_message(pair: tuple[CellSession, CellSession]) -> None:
    gateway, agent = pair
    watch = gateway.token_watch()
    agent.declare_alive()
    wait_for(lambda: Alive("robot", "left", "b1") in watch.alive())
    agent.close()
    gone: list[TokenGone] = []
    wait_for(lambda: gone, lambda: gone.extend(watch.take()))
    assert gone == [TokenGone("robot", "left", "b1")]


def test_a_second_listener_is_told_who_answers_there(cell: Cell) -> None:
    with cell.manager() as manager, Server(manager.serve("manager"), "manager of cell test_cell (boot m1)"):
        with pytest.raises(EndpointInUse) as caught, cell.manager():
            pass
        assert str(caught.value) == (
            f"{cell.rendezvous} is in use; manager of cell test_cell (boot m1) answers there: "
            "stop it or choose another endpoint with -l"
        )


def test_a_program_that_does_not_speak_zenoh_is_named_as_such(cell: Cell) -> None:
    port = int(cell.rendezvous.rsplit(":", 1)[1])
    refused = pytest.raises(EndpointInUse, match="does not speak Zenoh")
    with socket.create_server(("127.0.0.1", port)), refused, cell.manager():
        pass


def test_a_client_without_a_manager_says_what_to_do(cell: Cell) -> None:
    link = Link("client", connect=(cell.rendezvous,), open_timeout_s=0.1)
    with pytest.raises(Unreachable, match="start the cell"), CellSession(CELL, link, "view", "test", "v1"):
        pass


def test_a_session_closes_after_an_exception_and_may_be_closed_again(cell: Cell) -> None:
    threads = set(threading.enumerate())
    session = cell.manager()

    def die() -> None:
        with session:
            session.watch("**")
            session.serve("manager")
            session.declare_alive()
            session.publish(presence("left"))
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        die()
    session.close()
    with pytest.raises(NetError, match="closed"):
        session.publish(presence("right"))
    assert set(threading.enumerate()) == threads


def test_a_session_that_frozen_peers_keep_from_closing_is_reported_and_given_up(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    reports: list[str] = []
    session = CellSession(
        CELL, Link(mode="peer", listen=(free_endpoint(),)), "manager", CELL, "b1", report=reports.append
    )
    closed: list[zenoh.Session] = []
    close = zenoh.Session.close

    def late(opened: zenoh.Session) -> None:
        close(opened)  # type: ignore[no-untyped-call]
        closed.append(opened)
        raise zenoh.ZError("close operation timed out! at /somewhere/close.rs:135.")

    monkeypatch.setattr(zenoh.Session, "close", late)
    with session:
        session.publish(presence("left"))
    assert len(closed) == 1
    assert reports == ["the session did not close in order: close operation timed out!"]


def test_a_session_does_not_hear_itself(pair: tuple[CellSession, CellSession]) -> None:
    gateway, agent = pair
    own, others = agent.watch("**"), gateway.watch("**")
    hears(others, Presence, lambda: agent.publish(presence("left")))
    assert own.take_new() == []
