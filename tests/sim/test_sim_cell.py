"""The whole cell on virtual time: programs end on a bad network, and nothing is ever unsafe on a worse one."""

from pathlib import Path

import pytest

from tests.sim.scenario import BAD, WORSE, run_scenario
from tests.unit.config_world import Copy


def test_at_5_percent_loss_all_programs_end() -> None:
    outcome = run_scenario(0, BAD, longest_s=60.0)
    assert outcome.all_done
    assert min(outcome.time_inside_s.values()) > 2.0


@pytest.mark.parametrize("seed", [1, 2])
def test_at_5_percent_loss_programs_without_repeats_end(seed: int, tmp_path: Path) -> None:
    copy = Copy(tmp_path)
    for program in ("left", "right"):
        copy.change(f"two_arms/programs/{program}.prog", "GOTO again 1\n", "")
    outcome = run_scenario(seed, BAD, longest_s=60.0, cell_file=copy.cell)
    assert outcome.all_done
    assert min(outcome.time_inside_s.values()) > 1.0


@pytest.mark.parametrize("seed", [100, 102, 103, 105, 106])
def test_at_20_percent_loss_with_kills_and_restarts_no_invariant_breaks(seed: int) -> None:
    outcome = run_scenario(seed, WORSE, longest_s=15.0, trouble_every_s=1.5)
    assert outcome.kills + outcome.freezes + outcome.drive_faults > 0


@pytest.mark.parametrize("seed", [200])
def test_an_operator_who_changes_the_pace_at_random_breaks_no_invariant(seed: int) -> None:
    outcome = run_scenario(seed, BAD, longest_s=12.0, restless=True)
    assert outcome.samples > 1000


def test_the_same_seed_gives_the_same_run() -> None:
    first, second = (run_scenario(7, WORSE, longest_s=3.0, trouble_every_s=1.0) for _ in range(2))
    assert first.world.clock.now == second.world.clock.now
    assert [event.text for event in first.world.seen.events] == [event.text for event in second.world.seen.events]


@pytest.mark.soak
@pytest.mark.parametrize("seed", [101, 104, *range(1000, 1050)])
def test_soak_with_kills_and_restarts(seed: int) -> None:
    run_scenario(seed, WORSE, longest_s=60.0, trouble_every_s=4.0)


@pytest.mark.soak
@pytest.mark.parametrize("seed", range(2000, 2010))
def test_soak_all_programs_end(seed: int) -> None:
    assert run_scenario(seed, BAD, longest_s=120.0).all_done
