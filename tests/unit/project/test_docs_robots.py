"""What docs/robots.md shows must run as it is."""

import re
from typing import Any

import pytest

from robot_agent.kinematics import BareUrdf, load_model
from robot_agent.model import FAMILIES
from tests.unit.repository import ROOT

TEXT = (ROOT / "docs" / "robots.md").read_text()


def test_the_examples_run_one_after_the_other(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)
    names: dict[str, Any] = {}
    exec("".join(re.findall(r"```python\n(.*?)```", TEXT, re.S)), names)
    assert names["q"] is not None
    assert names["holding"].shape == names["moving"].shape == (1, 6)


@pytest.mark.parametrize("family", FAMILIES)
def test_every_family_is_in_the_table_with_a_robot_of_it(family: str) -> None:
    (example,) = re.findall(rf"^\| `{family}` \|.*`(\w+\.yaml)` \|$", TEXT, re.M)
    assert load_model(ROOT / "cell_configs" / "models" / example).description.family == family


def test_every_branch_is_named() -> None:
    for path in (ROOT / "cell_configs" / "models").glob("*.yaml"):
        model = load_model(path)
        assert not isinstance(model, BareUrdf)
        for part in {part for branch in model.branches for part in branch.split("/")} if model.closed_form else {"S8"}:
            assert part in TEXT
