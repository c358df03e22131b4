"""Each scene of `tests.sim.scenes` is in order."""

from pathlib import Path

import pytest

from tests.sim.scenes import SCENES

_IN_SOAK = ("drives that sag", "drives a little behind", "processes that stand still", "wanted while it was stopped")
"""The first two differ from "drives far behind" only in what planted faults they show. `make mutants` plays all scenes
in order before it plants anything."""


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=[pytest.mark.soak] if name in _IN_SOAK else []) for name in SCENES]
)
def test_in_order(name: str, tmp_path: Path) -> None:
    SCENES[name](tmp_path)
