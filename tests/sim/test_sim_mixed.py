"""A palletizer, whose axes are coupled, and a SCARA, one of whose joints slides, in one cell on virtual time."""

from pathlib import Path

from tests.sim.scenario import BAD, run_scenario
from tests.unit.config_world import Copy


def test_a_palletizer_and_a_scara_share_a_zone_and_end_their_programs(tmp_path: Path) -> None:
    copy = Copy(tmp_path)
    for program, again in (("stacker", "GOTO again 1\n"), ("placer", "GOTO again 2\n")):
        copy.change(f"mixed/programs/{program}.prog", again, "")
    outcome = run_scenario(1, BAD, longest_s=30.0, cell_file=copy.folder / "mixed" / "cell.yaml")
    assert outcome.all_done
    assert min(outcome.time_inside_s.values()) > 0.5
