"""Each scene of `tests.sim.scenes` is in order."""

from pathlib import Path

import pytest

from tests.sim.scenes import SCENES


@pytest.mark.parametrize("name", SCENES)
def test_in_order(name: str, tmp_path: Path) -> None:
    SCENES[name](tmp_path)
