"""From a plan that fails to few events that do: items are left out as long as the same invariant breaks."""

from collections.abc import Collection

from tests.sim.faults import Item
from tests.sim.judge import Broken
from tests.sim.run import Crashed, Outcome, run_seed

_MOST_RUNS = 60


def shrink(failed: Outcome, seconds: float, only: Collection[str] | None = None) -> Outcome:
    """The outcome of the smallest plan that was found (delta debugging: halves, quarters, single items)."""
    assert failed.broken is not None
    best, runs = failed, 0
    plan = tuple(item for _, item in failed.struck)
    parts = 2
    while plan and runs < _MOST_RUNS:
        size = max(1, len(plan) // parts)
        for first in range(0, len(plan), size):
            smaller: tuple[Item, ...] = plan[:first] + plan[first + size :]
            runs += 1
            outcome = run_seed(failed.seed, seconds, only, smaller)
            if outcome.broken is not None and _alike(outcome.broken, failed.broken):
                plan, best = smaller, outcome
                break
        else:
            if size == 1:
                break
            parts *= 2
    return best


def _alike(one: Broken, other: Broken) -> bool:
    """Whether two runs have failed by one invariant, or by exceptions of one kind."""
    if isinstance(one, Crashed) and one.who != other.who:
        return False
    return one.invariant == other.invariant
