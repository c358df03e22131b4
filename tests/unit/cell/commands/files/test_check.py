"""`cell check` and `cell schema` as their users see them."""

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from cell.commands.cell_command import app
from robot_agent.model import FAMILIES
from tests.unit.config_world import CELL, CONFIGS, TWO_ARMS, Copy

RUNNER = CliRunner()


def test_a_good_cell_is_summed_up_with_exit_0() -> None:
    result = RUNNER.invoke(app, ["check", str(TWO_ARMS)])
    assert result.exit_code == 0
    for text in ("two_arms is good", "BOOK6", "left_bus", "46 %", "handover"):
        assert text in result.output


def test_robots_that_are_kept_apart_are_told_how_far_they_are_and_whom_a_lost_one_stops() -> None:
    result = RUNNER.invoke(app, ["check", str(CONFIGS / "shared_room" / "cell.yaml")], env={"COLUMNS": "120"})
    assert result.exit_code == 0
    (row,) = [line.split() for line in result.output.splitlines() if line.startswith(" left, right ")]
    assert row == ["left,", "right", "30", "1560", "3600", "4085,", "4085"]
    far = "reaches 4085 mm, their bases are 3600 mm apart."
    assert result.output.splitlines()[-3:] == [
        f"While right does not know where it is, left cannot move: right {far}",
        f"While left does not know where it is, right cannot move: left {far}",
        "Home it, or say where it stays: `cell confine ROBOT`, `cell stands ROBOT`.",
    ]


def test_robots_that_only_zones_keep_apart_are_told(tmp_path: Path) -> None:
    told = "Robots are not kept apart (separation: off): zones alone do that."
    result = RUNNER.invoke(app, ["check", str(Copy(tmp_path).add(CELL, "separation: off").cell)])
    assert result.output.splitlines()[-1] == told
    assert told not in RUNNER.invoke(app, ["check", str(CONFIGS / "belt" / "cell.yaml")]).output


def test_a_bad_cell_is_its_problems_with_exit_1(tmp_path: Path) -> None:
    copy = Copy(tmp_path).add(CELL, "colour: red")
    result = RUNNER.invoke(app, ["check", str(copy.cell)])
    assert result.exit_code == 1
    assert copy.shown(result.output) == (
        f"{copy.place(CELL, '§colour')}: colour: found unknown key 'colour', allowed one of cell, units, manager, "
        "robots, gateways, frames, conveyors, zones, meetings, variables, things, separation, times, "
        "on_manager_return\n1 problem in 1 file\n"
    )


def test_a_missing_file_is_one_line_with_exit_1(tmp_path: Path) -> None:
    result = RUNNER.invoke(app, ["check", str(tmp_path / "none.yaml")])
    assert result.exit_code == 1
    assert f"{tmp_path}/none.yaml:1:1: file: found no such file, allowed a readable file" in result.output


@pytest.mark.parametrize(
    ("subject", "key"),
    [("cell", "manager"), ("drives", "bus"), ("messages", "Presence")],
)
def test_a_schema_is_json_and_names_what_it_describes(subject: str, key: str) -> None:
    result = RUNNER.invoke(app, ["schema", subject])
    assert result.exit_code == 0
    schema = json.loads(result.output)
    assert key in (schema if subject == "messages" else schema["properties"])


def test_the_schema_of_the_robot_file_has_one_choice_per_family() -> None:
    choices = json.loads(RUNNER.invoke(app, ["schema", "robot"]).output)["oneOf"]
    assert [choice["title"] for choice in choices][:2] == ["CobotFile", "DeltaFile"]
    assert len(choices) == len(FAMILIES)
    assert all("geometry" in choice["required"] for choice in choices)


def test_files_and_messages_refuse_unknown_keys_in_their_schemas_too() -> None:
    schemas = json.loads(RUNNER.invoke(app, ["schema"]).output)
    assert set(schemas) == {"cell", "robot", "drives", "simulation", "points", "messages"}
    assert schemas["cell"]["additionalProperties"] is False
    assert schemas["messages"]["manager/estop"]["additionalProperties"] is False
    assert "SetpointBlock" not in schemas["messages"]
