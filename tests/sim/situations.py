"""The simulation's own tests of what drawn cells hardly ever come to, a file of them as one run.

python -m tests.sim.situations --seeds 0:8
"""

import sys
from pathlib import Path

import pytest

from tests.sim.checker import search

FILES = (
    "test_sim_stops.py",
    "test_sim_outputs.py",
    "test_sim_io_nodes.py",
    "test_sim_setup_in_a_cell.py",
    "test_sim_guarding.py",
    "test_sim_corrections.py",
    "unkind/test_sim_adapter.py",
    "test_sim_apart.py",
)
_OPTIONS = ("-x", "-q", "--no-header", "-m", "not soak", "-p", "no:cacheprovider", "--hypothesis-profile", "ci")


class _FirstFailure:
    """What fails first, by its name."""

    def __init__(self) -> None:
        self.name = ""

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        if report.failed and not self.name:
            self.name = report.nodeid.rpartition("::")[2]


def broken(number: int) -> tuple[str, float]:
    """The first test of a file that fails."""
    first = _FirstFailure()
    code = pytest.main([*_OPTIONS, str(Path(__file__).parent / FILES[number])], plugins=[first])
    return first.name or ("" if code == pytest.ExitCode.OK else f"{FILES[number]} cannot be run"), 0.0


if __name__ == "__main__":
    sys.exit(search("the simulation's tests of single situations", broken))
