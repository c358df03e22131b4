"""Each scene of `tests.sim.scenes` is in order."""

from pathlib import Path

import pytest

from tests.sim.scenes import SCENES

_IN_TEST = ("a robot is pushed too near", "drives that brake unheard", "halted in a zone")
"""`make mutants` plays all scenes in order before it plants anything."""


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=[] if name in _IN_TEST else [pytest.mark.soak]) for name in SCENES]
)
def test_in_order(name: str, tmp_path: Path) -> None:
    SCENES[name](tmp_path)
