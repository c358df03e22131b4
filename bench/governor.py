"""The governor on its way through a motion: the processor time of its slow segments, since every one has a deadline."""

import gc
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import numpy as np

from bench.timing import Row
from robot_agent.trajectory import Governor, Hold, Limits, Motion, RateRequest

NOMINAL_S = 0.12
STEP = 5
"""Ticks from one segment to the next: 20 ms."""
DEADLINE_S = 0.0005
PASSES = 7
WISHES = 150


def governed(motion: Motion, limits: Limits) -> list[Row]:
    """The slowest one of a hundred segments, undisturbed and where other wishes come all the time.

    The passes are the same, so of each segment the best one counts: what other processes do is not measured.
    """

    def row(what: str, one_pass: Callable[[Governor, Motion], list[float]]) -> Row:
        passes = [one_pass(Governor(motion, limits, motion.cycle_s, NOMINAL_S), motion) for _ in range(PASSES)]
        slow = float(np.quantile(np.min(passes, axis=0), 0.99))
        return Row(what, slow, slow / DEADLINE_S, "of 0.5 ms")

    with _as_in_the_agent():
        return [
            row("governor on the way through it, p99", _undisturbed),
            row("governor under random wishes, p99", _wished),
        ]


def _undisturbed(governor: Governor, motion: Motion) -> list[float]:
    segment, times = governor.rest(0.0), []
    while segment.stop_tau < motion.duration_s:
        start = time.process_time()
        segment = governor.next(segment, STEP, [], [])
        times.append(time.process_time() - start)
    return times


def _wished(governor: Governor, motion: Motion) -> list[float]:
    """Overrides of either sign, halts, stops and holds close ahead, in full motion; some segments are lost."""
    rng = np.random.default_rng(1)
    segment, times = governor.rest(0.0), []
    for _ in range(WISHES):
        requests = [RateRequest(float(rng.choice([1.0, 1.0, 0.0, -1.0, rng.uniform(0.05, 1.0)])), "override")]
        near, held, stop = segment.stop_tau + float(rng.uniform(0.0, 0.3)), rng.random() < 0.2, rng.random() < 0.05
        holds = [Hold(near, "zone", near + 0.3)] if held else []
        for _ in range(int(rng.integers(1, 15))):
            index = STEP if rng.random() < 0.95 else int(rng.integers(1, 60))
            start = time.process_time()
            segment = governor.next(segment, index, requests, holds, stop)
            times.append(time.process_time() - start)
        if segment.stop_tau >= motion.duration_s:
            segment = governor.rest(0.0)
    return times


@contextmanager
def _as_in_the_agent() -> Iterator[None]:
    """What was loaded is not looked at by garbage collections in between (`cell.net.runner`)."""
    gc.collect()
    gc.freeze()
    try:
        yield
    finally:
        gc.unfreeze()
