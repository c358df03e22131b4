"""The search counts what counts, and tells a run that ends in an exception as it tells any other."""

import logging
from collections import Counter
from collections.abc import Iterator

import pytest

from tests.sim import search, shrink
from tests.sim.faults import Freeze, Item
from tests.sim.judge import Broken
from tests.sim.run import Crashed, Outcome
from tests.sim.staff import Staff

SEED = 1008


def seeds(contended: int, alone: int) -> Iterator[search.Found]:
    for seed in range(contended + alone):
        yield search.Found(seed, "", "", 0.0, "", 1.0, 2, seed < contended, Counter(), 0.0)


@pytest.mark.parametrize(("contended", "code"), [(1999, 0), (2000, 1)])
def test_only_contended_seeds_count_until_what_is_never_seen_is_a_failure(
    contended: int, code: int, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(search, "_all", lambda *_: seeds(contended, 100))
    assert search.main(["--seeds", f"0:{contended + 100}"]) == code
    assert f"from 2000 contended seeds on; {contended} of these {contended + 100} seeds" in capsys.readouterr().out


@pytest.fixture(autouse=True)
def _logged() -> Iterator[None]:
    """A search switches logging off."""
    yield
    logging.disable(logging.NOTSET)


@pytest.fixture
def _crashes(monkeypatch: pytest.MonkeyPatch) -> None:
    def look(_: Staff) -> None:
        raise KeyError("drawn")

    monkeypatch.setattr(Staff, "_look", look)


@pytest.mark.usefixtures("_crashes")
def test_a_replay_tells_an_exception_as_the_search_does(capsys: pytest.CaptureFixture[str]) -> None:
    found = search._search_one((SEED, 6.5, None))
    assert (found.invariant, found.who, found.ok) == ("no exception", "KeyError", False)
    assert search.main(["--replay", str(SEED), "--seconds", "6.5", "--shrink"]) == 1
    told = capsys.readouterr().out
    assert f"no exception at {found.at_s:.3f} s, KeyError: Traceback" in told
    assert "its plan, and when it struck" in told


def test_an_exception_in_the_world_that_is_built_is_told_too(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def world(*_: object) -> None:
        raise ValueError("no world")

    monkeypatch.setattr("tests.sim.run.World", world)
    assert search._search_one((SEED, 6.5, None)).invariant == "no exception"
    assert search.main(["--replay", str(SEED)]) == 1
    assert "ValueError: no world" in capsys.readouterr().out


def test_a_plan_that_ends_in_an_exception_shrinks_to_what_raises_it(monkeypatch: pytest.MonkeyPatch) -> None:
    plan = tuple(Freeze(float(at_s), None, "manager", 0.1) for at_s in range(8))

    def run(seed: int, _seconds: float, _only: object, items: tuple[Item, ...]) -> Outcome:
        """The sixth raises; without the second, something else does."""
        error = KeyError("sixth") if plan[1] in items else ValueError("other")
        broken: Broken | None = Crashed(error) if plan[5] in items else None
        return Outcome(seed, broken, items, [(item.at_s, item) for item in items], 1.0, (), True, None)  # type: ignore[arg-type]

    monkeypatch.setattr(shrink, "run_seed", run)
    assert shrink.shrink(run(SEED, 1.0, None, plan), 1.0).plan == (plan[1], plan[5])
