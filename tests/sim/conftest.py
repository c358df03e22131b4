"""What tests of whole cells share."""

import pytest

from cell.commands.checks import CellBundle
from tests.sim.world import load_bundle
from tests.unit.config_world import Copy

PLANTED_TODAY = "planted fault of the day"
"""The property of a test that says which fault it has planted, and how that was found."""


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Say what was planted, also where the test ran in a process of its own."""
    for report in terminalreporter.getreports("passed"):
        for name, what in report.user_properties:
            if name == PLANTED_TODAY:
                terminalreporter.write_line(f"{name}: {what}")


@pytest.fixture(scope="session")
def bundle(tmp_path_factory: pytest.TempPathFactory) -> CellBundle:
    """The two arms on slower buses."""
    return load_bundle(Copy(tmp_path_factory.mktemp("arms")).slow_buses().cell)
