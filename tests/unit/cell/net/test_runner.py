"""The loop around a core, with a real clock but no statement about its speed."""

import gc
import itertools
import os
import sys
import time
from threading import Event, Thread

import pytest

from cell.core import Effect, Frozen, Publish
from cell.net import runner
from cell.net.runner import AHEAD_S, FREEZE_S, Priority, new_boot, run_core, scheduling
from tests.unit.loop_clock import Clock


class Recorder:
    """A core that writes down what happens to it and stops its loop after some steps."""

    def __init__(self, steps: int) -> None:
        self.left = steps
        self.stop = Event()
        self.received: list[object] = []
        self.stepped: list[float] = []

    def receive(self, message: object, now: float) -> None:
        self.received.append(message)
        self.received_at = now

    def step(self, now: float) -> list[Effect]:
        self.stepped.append(now)
        self.left -= 1
        if self.left <= 0:
            self.stop.set()
        return [Publish(len(self.stepped)), Publish("x")]


def test_messages_come_before_the_step_and_effects_go_out_in_order() -> None:
    core, done, inbox = Recorder(2), [], [["a", "b"], []]
    run_core(core, period_s=0.001, inbox=lambda: inbox.pop(0), perform=done.append, stop=core.stop)
    assert core.received == ["a", "b"]
    assert done == [Publish(1), Publish("x"), Publish(2), Publish("x")]


def freeze() -> None:
    frozen_until = time.monotonic() + 2 * FREEZE_S
    while time.monotonic() < frozen_until:
        pass


@pytest.mark.parametrize("where", ["between steps", "while messages are taken"])
def test_a_core_that_was_frozen_learns_it_before_the_old_messages(where: str) -> None:
    core = Recorder(2)
    late: list[float] = []

    def perform(effect: Effect) -> None:
        if where == "between steps" and effect == Publish(1):
            freeze()

    def inbox() -> list[object]:
        if where == "while messages are taken" and not core.stepped:
            freeze()
            return ["old"]
        return ["old"] if core.stepped and where == "between steps" else []

    run_core(core, period_s=0.01, inbox=inbox, perform=perform, stop=core.stop, on_late=late.append)
    frozen, old = core.received
    assert isinstance(frozen, Frozen)
    assert frozen.gap_s > FREEZE_S
    assert old == "old"
    assert late[0] > FREEZE_S


def test_missed_cycles_are_left_out() -> None:
    core = Recorder(4)

    def perform(_: Effect) -> None:
        if len(core.stepped) == 1:
            frozen_until = time.monotonic() + 0.05
            while time.monotonic() < frozen_until:
                pass

    run_core(core, period_s=0.01, inbox=list, perform=perform, stop=core.stop)
    # Had the cycles been caught up, the last step would be right after the freeze, not two cycles later.
    assert core.stepped[-1] - core.stepped[0] > 0.06


def test_what_comes_soon_is_looked_at_before_a_period_is_over() -> None:
    core, came = Recorder(3), Event()

    def perform(_: Effect) -> None:
        came.set()

    began = time.monotonic()
    run_core(core, period_s=600.0, inbox=list, perform=perform, stop=core.stop, soon=came)
    assert len(core.stepped) == 3
    assert time.monotonic() - began < 60.0


def test_a_loop_that_is_asked_all_the_time_works_a_third_of_it() -> None:
    steps, worked_s, period_s = 12, 0.03, 0.1
    core, came = Recorder(steps), Event()
    came.set()

    def perform(effect: Effect) -> None:
        came.set()
        if effect == Publish("x"):
            time.sleep(worked_s)

    run_core(core, period_s=period_s, inbox=list, perform=perform, stop=core.stop, soon=came)
    assert core.stepped[-1] - core.stepped[0] >= (steps - 1) * 3.0 * worked_s - period_s - 0.01


def test_without_anything_new_a_loop_steps_when_a_period_is_over() -> None:
    core = Recorder(3)
    run_core(core, period_s=0.03, inbox=list, perform=lambda _: None, stop=core.stop, soon=Event())
    assert core.stepped[2] - core.stepped[0] >= 0.059


def test_the_interpreter_is_left_as_it_was() -> None:
    before = sys.getswitchinterval()
    core = Recorder(1)
    run_core(core, period_s=0.001, inbox=list, perform=lambda _: None, stop=core.stop, priority=Priority.BUS)
    assert sys.getswitchinterval() == before
    assert gc.get_freeze_count() == 0


def test_every_boot_has_its_own_name() -> None:
    assert new_boot() != new_boot()


def test_a_trimmed_loop_puts_its_next_cycle_off() -> None:
    core, told = Recorder(3), []

    def trim() -> float:
        told.append(len(core.stepped))
        return 0.03

    run_core(core, period_s=0.001, inbox=list, perform=lambda _: None, stop=core.stop, trim=trim)
    assert told == [1, 2, 3]
    # Two cycles of 31 ms: the first step may have been late by as much as one of them.
    assert core.stepped[-1] - core.stepped[0] > 0.031


def test_what_comes_ahead_of_a_cycle_is_handed_over_between_the_steps() -> None:
    core, taken = Recorder(3), []

    def ahead() -> list[object]:
        taken.append(time.monotonic())
        return [len(core.stepped)]

    run_core(core, period_s=0.05, inbox=list, perform=lambda _: None, stop=core.stop, ahead=ahead)
    assert core.received == [1, 2, 3]
    assert all(step < at for step, at in zip(core.stepped, taken, strict=True))
    assert all(at < step for at, step in zip(taken, core.stepped[1:], strict=False))


def test_a_loop_without_time_left_takes_nothing_ahead() -> None:
    core = Recorder(3)
    run_core(
        core, period_s=0.5 * AHEAD_S, inbox=list, perform=lambda _: None, stop=core.stop, ahead=lambda: ["too early"]
    )
    assert core.received == []


def test_small_delays_do_not_add_up_and_after_a_long_one_the_schedule_slips_as_a_whole(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    period_s, clock = 0.05, Clock()
    monkeypatch.setattr(runner, "time", clock)
    core, left = Recorder(12), []

    def perform(effect: Effect) -> None:
        if effect != Publish("x"):
            left.append(clock.now)
        elif len(left) == 6:
            clock.sleep(1.9 * period_s)

    def inbox() -> list[object]:
        clock.sleep(0.1 * period_s)
        return []

    run_core(core, period_s=period_s, inbox=inbox, perform=perform, stop=core.stop)
    spacings = [(after - before) / period_s for before, after in itertools.pairwise(left)]
    assert spacings[1:] == pytest.approx([1.0] * 4 + [2.0] + [1.0] * 5, abs=1e-6)
    assert spacings[0] == pytest.approx(1.1), "the first delay of all is where the schedule begins"


def test_threads_that_a_real_time_loop_starts_are_no_real_time_threads() -> None:
    policies: list[int] = []
    with scheduling(Priority.BUS):
        if os.sched_getscheduler(0) & ~os.SCHED_RESET_ON_FORK != os.SCHED_FIFO:
            pytest.skip("this process may not have real-time threads")
        worker = Thread(target=lambda: policies.append(os.sched_getscheduler(0)))
        worker.start()
        worker.join()
    assert policies == [os.SCHED_OTHER]
    assert os.sched_getscheduler(0) & ~os.SCHED_RESET_ON_FORK == os.SCHED_OTHER


@pytest.mark.parametrize("priority", [Priority.MANAGER, Priority.BUS])
def test_a_loop_runs_with_its_priority_and_gives_it_back(priority: Priority) -> None:
    seen: list[int] = []
    core = Recorder(1)

    def inbox() -> list[object]:
        seen.append(os.sched_getparam(0).sched_priority)
        return []

    run_core(core, period_s=0.001, inbox=inbox, perform=lambda _: None, stop=core.stop, priority=priority)
    with scheduling(priority):
        if not os.sched_getparam(0).sched_priority:
            pytest.skip("this process may not have real-time threads")
    assert seen == [priority]
    assert os.sched_getparam(0).sched_priority == 0


def test_what_was_late_while_a_loop_had_too_much_to_do_is_not_made_up_for_afterwards(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    period_s, clock = 0.02, Clock()
    monkeypatch.setattr(runner, "time", clock)
    core, left = Recorder(32), []

    def perform(effect: Effect) -> None:
        if effect != Publish("x"):
            left.append(clock.now)
        elif len(left) <= 20:
            clock.sleep(1.3 * period_s)  # each cycle by clearly more than `SLIP`: none is on its border

    run_core(core, period_s=period_s, inbox=list, perform=perform, stop=core.stop)
    spacings = [(after - before) / period_s for before, after in itertools.pairwise(left)]
    assert spacings[:20] == pytest.approx([1.3] * 20, abs=1e-6)
    assert spacings[20:] == pytest.approx([1.0] * 11, abs=1e-6)
