"""The planning process: it never holds up who asks it, can be told to stop, and comes back when it dies."""

import multiprocessing
import os
import signal
import time
from collections.abc import Callable, Iterator

import numpy as np
import pytest

from robot_agent.agent.planning.planner import Planner
from robot_agent.agent.planning.plans import ExtendRequest, PlanFailed, Planned, PlanRequest
from robot_agent.agent.planning.worker import PlanWorker
from robot_agent.language import JointStep
from robot_agent.workspace import PlacedRobot
from tests.unit.six_axis_arm import arm

DEADLINE_S = 60.0
LARGE = 4_000_000
"""Numbers, far more than a pipe holds."""


class Fake(Planner):
    """What a request asks for by its first joint; every answer names the process."""

    def __init__(self) -> None:
        """Without a robot."""

    def plan(self, request: PlanRequest | ExtendRequest) -> Planned | PlanFailed:
        order = request.steps[0].joints[0]
        if order == DIE:
            os.kill(os.getpid(), signal.SIGKILL)
        if order == HANG:
            signal.pause()
        if order == RAISE:
            raise ArithmeticError("planned to fail")
        text = "x" * LARGE if order == ANSWER_MUCH else str(os.getpid())
        return PlanFailed(request.id, request.line, text)


ANSWER, ANSWER_MUCH, DIE, HANG, RAISE = range(5)


def request(id: int, order: int = ANSWER, size: int = 6) -> PlanRequest:
    return PlanRequest(id, (JointStep(7, (float(order),) * 6, 1.0),), np.zeros(size), ())


def results(worker: PlanWorker, count: int = 1) -> list[PlanFailed]:
    """So many answers of a fake planner."""
    taken: list[PlanFailed] = []
    until(lambda: len(taken) >= count, lambda: taken.extend(worker.results()))
    return taken


def until(done: Callable[[], bool], do: Callable[[], object] = lambda: None) -> None:
    deadline = time.monotonic() + DEADLINE_S
    while not done():
        assert time.monotonic() < deadline
        do()
        time.sleep(0.005)


@pytest.fixture
def worker() -> Iterator[PlanWorker]:
    with PlanWorker(Fake()) as started:
        yield started


def test_moves_are_planned_in_another_process() -> None:
    model = arm()
    with PlanWorker(Planner(PlacedRobot.at(model), 0.004)) as worker:
        worker.submit(PlanRequest(1, (JointStep(3, (0.2,) * 6, 1.0),), np.zeros(6), ()))
        (planned,) = results(worker)
    assert isinstance(planned, Planned)
    np.testing.assert_allclose(planned.motion.q(np.array(planned.motion.duration_s)), 0.2)


def test_large_requests_and_large_answers_do_not_wait_for_each_other(worker: PlanWorker) -> None:
    for id in range(1, 6):
        worker.submit(request(id, ANSWER_MUCH, LARGE))
    assert [(each.id, len(each.text)) for each in results(worker, 5)] == [(id, LARGE) for id in range(1, 6)]


def test_who_submits_does_not_wait_for_a_process_that_takes_nothing(worker: PlanWorker) -> None:
    """Whatever it is given more than a pipe holds."""
    worker.submit(request(1))
    pid = int(results(worker)[0].text)
    os.kill(pid, signal.SIGSTOP)
    for id in range(2, 5):
        worker.submit(request(id, ANSWER, LARGE))
    assert worker.results() == []
    os.kill(pid, signal.SIGCONT)
    assert [each.id for each in results(worker, 3)] == [2, 3, 4]


def test_plan_that_is_not_wanted_any_more_is_interrupted_and_the_next_one_begins(worker: PlanWorker) -> None:
    worker.submit(request(1, HANG))
    worker.submit(request(2))
    worker.submit(request(3))
    worker.drop([1, 2])
    assert [each.id for each in results(worker)] == [3]


def test_plan_that_is_dropped_and_comes_at_once_all_the_same_costs_no_new_process(worker: PlanWorker) -> None:
    worker.submit(request(1))
    before = results(worker)[0].text
    worker.submit(request(2, ANSWER_MUCH))
    worker.drop([2])
    worker.submit(request(3))
    assert [(each.id, each.text) for each in results(worker)] == [(3, before)]


def test_death_while_planning_is_told_with_what_to_do_and_the_next_request_is_planned(worker: PlanWorker) -> None:
    worker.submit(request(1, DIE))
    worker.submit(request(2))
    died, planned = results(worker, 2)
    assert (died.id, died.line) == (1, 7)
    assert "line 7: the planning process died (exit code -9)" in died.text
    assert "run the program again" in died.text
    assert (planned.id, int(planned.text) > 0) == (2, True)


def test_a_process_that_cannot_be_started_is_told_and_tried_again(
    worker: PlanWorker, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refused(_process: object) -> None:
        raise BlockingIOError(11, "Resource temporarily unavailable")

    worker.submit(request(1))
    assert results(worker)[0].id == 1
    with monkeypatch.context() as starved:
        starved.setattr(multiprocessing.get_context("spawn").Process, "start", refused)
        worker.submit(request(2, DIE))
        worker.submit(request(3))
        died, failed = results(worker, 2)
    assert (died.id, failed.id) == (2, 3)
    assert "line 7: the planning process could not be started" in failed.text
    worker.submit(request(4))
    assert results(worker)[0].id == 4


def test_death_with_nothing_to_do_is_not_noticed_by_anybody(worker: PlanWorker) -> None:
    worker.submit(request(1))
    before = int(results(worker)[0].text)
    os.kill(before, signal.SIGKILL)
    until(lambda: before not in {process.pid for process in multiprocessing.active_children()})
    worker.submit(request(2))
    (planned,) = results(worker)
    assert planned.id == 2
    assert int(planned.text) != before


def test_bug_in_the_planner_is_a_failed_line(worker: PlanWorker) -> None:
    worker.submit(request(1, RAISE))
    (failed,) = results(worker)
    assert "internal error while planning: ArithmeticError('planned to fail')" in failed.text


def test_closing_ends_a_process_that_hangs() -> None:
    with PlanWorker(Fake()) as worker:
        worker.submit(request(1))
        pid = int(results(worker)[0].text)
        worker.submit(request(2, HANG))
    with pytest.raises(ProcessLookupError):
        os.kill(pid, 0)
