"""Each scene of `tests.sim.scenes` is in order."""

from pathlib import Path

import pytest

from tests.sim.scenes import SCENES

_IN_SOAK = ("drives that sag", "drives a little behind")
"""These differ from "drives far behind" only in what planted faults they show."""


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=[pytest.mark.soak] if name in _IN_SOAK else []) for name in SCENES]
)
def test_in_order(name: str, tmp_path: Path) -> None:
    SCENES[name](tmp_path)
