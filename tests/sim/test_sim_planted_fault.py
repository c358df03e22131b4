"""Does the simulated cell find a fault that is planted on purpose? One a day; `make mutants` plants all."""

import datetime

import pytest

from tests.mutants.__main__ import line, search
from tests.mutants.catalog import MUTANTS
from tests.mutants.mutant import Mutant, check_applies

MUST_BE_FOUND = [mutant for mutant in MUTANTS if not mutant.harmless]
TODAY = MUST_BE_FOUND[datetime.datetime.now(tz=datetime.UTC).date().toordinal() % len(MUST_BE_FOUND)]


@pytest.mark.parametrize("mutant", MUTANTS, ids=lambda mutant: mutant.name)
def test_a_planted_fault_still_has_its_place(mutant: Mutant) -> None:
    check_applies(mutant)


@pytest.mark.timeout(600)
def test_the_planted_fault_of_the_day_is_found() -> None:
    found = search(TODAY)
    print(line(TODAY, found))
    assert found.by, line(TODAY, found)
