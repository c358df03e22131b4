"""The spacing of SYNC around stalls: the real loop and the gateway's phase lock on a clock that only they move.

Every cycle length that is usual, every stall of 1 to 50 ms, at each place where a loop can be held up.
"""

import random
from collections.abc import Iterator, Sequence
from functools import partial
from itertools import pairwise
from threading import Event

import pytest

from cell.core import Effect, Publish
from cell.messages import ManagerState
from cell.net import runner
from cell.net.runner import CLOSEST, run_core
from drive_gateway.gateway.cycle.phase_lock import CATCH_UP_RATE, MOST_RATE, PhaseLock
from tests.unit.loop_clock import Clock

CYCLES_S = (0.001, 0.002, 0.004, 0.01, 0.02)
STALLS_S = [ms / 1000.0 for ms in range(1, 51)]
PLACES = ("ahead", "while it sleeps", "inbox", "in front of SYNC", "sending SYNC", "after SYNC")
BACK_S = 2.0
ROUNDING_S = 1e-9
STATE_PERIOD_S = 0.2
AHEAD_S = 50.0
"""The cell clock is ahead by so much."""


class Gateway:
    """A core with a phase lock; it is held up as `stalls` says, by the cycle: where, and for how long."""

    def __init__(self, clock: Clock, cycle_s: float, stalls: dict[int, tuple[str, float]], cycles: int) -> None:
        self.clock, self.cycle_s, self.stalls, self.cycles = clock, cycle_s, stalls, cycles
        self.lock = PhaseLock(cycle_s)
        self.stop = Event()
        self.syncs: list[float] = []
        self.trims: list[float] = []
        self._heard_at = -1.0
        self._sequence = 0

    def run(self) -> None:
        run_core(
            self,
            period_s=self.cycle_s,
            inbox=lambda: self._held("inbox"),
            perform=self._perform,
            stop=self.stop,
            trim=lambda: self.trims[-1],
            ahead=lambda: self._held("ahead"),
        )

    def receive(self, _message: object, _now: float) -> None:
        """Nothing comes."""

    def step(self, now: float) -> Iterator[Effect]:
        self._held("in front of SYNC")
        yield Publish("SYNC")
        self._held("after SYNC")
        if now - self._heard_at >= STATE_PERIOD_S:
            self._heard_at, self._sequence = now, self._sequence + 1
            self.lock.heard(ManagerState("c", "m", 1, self._sequence, now + AHEAD_S, "digest"), now)
        self.trims.append(self.lock.trim(now))
        if len(self.syncs) == self.cycles:
            self.stop.set()

    def _perform(self, _effect: Effect) -> None:
        self.syncs.append(self.clock.now)
        place, stall_s = self.stalls.get(len(self.syncs), ("", 0.0))
        if place == "while it sleeps":
            self.clock.sleeps_longer_s = stall_s
        self._held("sending SYNC")

    def _held(self, place: str) -> list[object]:
        # What is held up before SYNC belongs to the one that comes next.
        where, stall_s = self.stalls.get(len(self.syncs), ("", 0.0))
        if where == place:
            self.clock.now += stall_s
        return []


def stalled(clock: Clock, cycle_s: float, stalls: Sequence[tuple[str, float]], every: int) -> Gateway:
    """After a run with one stall after the other, so many cycles apart."""
    by_cycle = {every * number: stall for number, stall in enumerate(stalls, start=1)}
    gateway = Gateway(clock, cycle_s, by_cycle, every * (len(stalls) + 1))
    gateway.run()
    return gateway


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    clock = Clock()
    monkeypatch.setattr(runner, "time", clock)
    monkeypatch.setattr(runner, "Turns", partial(runner.Turns, now=clock.monotonic))
    return clock


@pytest.mark.parametrize("cycle_s", CYCLES_S)
def test_no_two_syncs_leave_closer_than_eight_tenths_of_a_cycle_whatever_stalls_where(
    clock: Clock, cycle_s: float
) -> None:
    every = 12
    stalls = [(place, stall_s) for place in PLACES for stall_s in STALLS_S]
    gateway = stalled(clock, cycle_s, stalls, every)
    spacings = [(after - before) / cycle_s for before, after in pairwise(gateway.syncs)]
    assert min(spacings) * cycle_s >= CLOSEST * cycle_s - ROUNDING_S
    longest = [max(spacings[every * n - 2 : every * n + 2]) for n in range(1, len(stalls) + 1)]
    for (place, stall_s), found in zip(stalls, longest, strict=True):
        assert found * cycle_s >= stall_s - ROUNDING_S or stall_s < cycle_s, f"nothing stalled {place} for {stall_s} s"


@pytest.mark.parametrize("cycle_s", CYCLES_S)
def test_nor_do_they_where_every_cycle_is_held_up_in_another_way(clock: Clock, cycle_s: float) -> None:
    rng = random.Random(4)
    stalls = [(rng.choice(PLACES), rng.uniform(0.0, 0.05) * rng.random()) for _ in range(500)]
    gateway = stalled(clock, cycle_s, stalls, 1)
    assert min(after - before for before, after in pairwise(gateway.syncs)) >= CLOSEST * cycle_s - ROUNDING_S


@pytest.mark.parametrize("cycle_s", CYCLES_S)
def test_after_a_stall_cycles_differ_by_half_a_percent_for_2_s_at_most_and_otherwise_by_100_ppm(
    clock: Clock, cycle_s: float
) -> None:
    apart = round((BACK_S + 0.2) / cycle_s)
    # No multiples of any cycle, so that every phase comes.
    stalls = [(PLACES[n % len(PLACES)], 0.001 + 0.049 * (0.618034 * n % 1.0)) for n in range(25)]
    gateway = stalled(clock, cycle_s, stalls, apart)
    slow, gentle = CATCH_UP_RATE * cycle_s + ROUNDING_S, MOST_RATE * cycle_s + ROUNDING_S
    for number, stall in enumerate(stalls, start=1):
        begins, back, ends = apart * number + 3, apart * number + round(BACK_S / cycle_s), apart * (number + 1)
        changes = [abs(after - before - cycle_s) for before, after in pairwise(gateway.syncs[begins:ends])]
        assert max(changes) <= slow, stall
        assert max(changes[back - begins :]) <= gentle, stall
        phase = (gateway.syncs[back] + AHEAD_S) / cycle_s
        assert abs(phase - round(phase)) * cycle_s <= slow, stall
