"""What tests of whole cells share."""

import pytest

from cell.commands.checks import CellBundle
from tests.sim.world import load_bundle
from tests.unit.config_world import Copy


@pytest.fixture(scope="session")
def bundle(tmp_path_factory: pytest.TempPathFactory) -> CellBundle:
    """The two arms on slower buses."""
    return load_bundle(Copy(tmp_path_factory.mktemp("arms")).slow_buses().cell)
