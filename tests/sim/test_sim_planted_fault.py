"""Does the simulated cell find a fault that is planted on purpose? One a day; `make mutants` plants all."""

import datetime
from collections.abc import Callable

import pytest

from tests.mutants.__main__ import line, search
from tests.mutants.catalog import MUTANTS
from tests.mutants.mutant import Mutant, check_applies
from tests.sim.conftest import PLANTED_TODAY

QUICK = (
    "agent-ignores-estop", "no-holds-at-zones", "joins-one-sample-on", "age-by-arrival", "grant-not-fenced",
    "any-owner-played", "occupied-is-free", "old-news-accepted", "grants-before-all-reported",
    "block-without-end", "block-from-anywhere", "overtaken-block-taken", "output-stays-on",
    "stop-ended-by-anybody", "stop-ended-at-gateways", "old-order-to-manager",
)  # fmt: skip
"""Those that one run or two find: a search of all its runs is too long for every day."""
OF_DAYS = [mutant for mutant in MUTANTS if mutant.name in QUICK]
TODAY = OF_DAYS[datetime.datetime.now(tz=datetime.UTC).date().toordinal() % len(OF_DAYS)]


@pytest.mark.parametrize("mutant", MUTANTS, ids=lambda mutant: mutant.name)
def test_a_planted_fault_still_has_its_place(mutant: Mutant) -> None:
    check_applies(mutant)


@pytest.mark.timeout(600)
def test_the_planted_fault_of_the_day_is_found(record_property: Callable[[str, object], None]) -> None:
    found = search(TODAY, TODAY.bench)
    record_property(PLANTED_TODAY, line(TODAY, found))
    assert found.by, line(TODAY, found)
