"""`docs/commanding.md` names calls, commands and fields that exist, and the parameters as they are declared."""

import dataclasses
import math
import re

import numpy as np
import pytest

from cell import messages
from cell.commands import cell_command
from cell.config.settings import PathWindow
from cell.messages import COMMANDS
from robot_agent.agent.parameters import PARAMETERS, Filed, Parameter
from robot_agent.model.description import PathSpeeds
from robot_agent.trajectory import Limits
from tests.unit.repository import ROOT

TEXT = (ROOT / "docs" / "commanding.md").read_text()
ROLES = {"robot/<r>": "robot", "gateway/<g>": "gateway", "manager": "manager"}

PATH = PathSpeeds(1.234, 1.0, 10.0, math.radians(1234.0), 1.0, 10.0)
FILED = Filed(Limits(np.ones(6), np.ones(6), np.ones(6), PATH, 1.5), PathWindow())


def row(parameter: Parameter) -> str:
    """Its line of the table; what depends on the robot file is named so."""
    lowest, highest = (f"{end(FILED):.6g}" for end in (parameter.lowest, parameter.highest))
    of_file = f"{lowest} {parameter.unit} to that of the robot file"
    reach = of_file if highest == "1234" else f"{lowest} to {highest} {parameter.unit}"
    cells = f"`{parameter.name}`", reach, parameter.does, parameter.counts.value
    return f"| {' | '.join((*cells, parameter.level.value))} |"


def test_every_call_that_it_names_is_one_and_no_call_of_a_robot_is_missing() -> None:
    named = {(ROLES[to], verb) for to, verb in re.findall(r"`([^`\s]+)/cmd/(\w+)`", TEXT)}
    assert [(role, verb) for role, verb in named if verb not in COMMANDS[role]] == []
    assert {verb for role, verb in named if role == "robot"} == set(COMMANDS["robot"]) - {"who"}


def test_every_command_that_it_names_is_one() -> None:
    words = {match.strip() for match in re.findall(r"`cell ((?:[a-z]+ ?)+)", TEXT)}
    assert sorted(word for word in words if word not in cell_command.COMMANDS) == []


def test_every_field_that_it_names_is_one() -> None:
    for name, field in re.findall(r"`([A-Z]\w+)\.(\w+)`", TEXT):
        assert field in {each.name for each in dataclasses.fields(getattr(messages, name))}, f"{name}.{field}"


@pytest.mark.parametrize("parameter", PARAMETERS, ids=lambda each: each.name)
def test_every_parameter_is_listed_as_it_is_declared(parameter: Parameter) -> None:
    assert row(parameter) in TEXT.splitlines()


def test_no_parameter_is_listed_that_is_not_declared() -> None:
    section = TEXT.split("### What may be set")[1].split("\n## ")[0]
    assert re.findall(r"^\| `(\w+)` \|", section, re.M) == [each.name for each in PARAMETERS]
