"""Axes that are like a known drive: what they say by it, and what they must say themselves."""

from pathlib import Path

import pytest
from ruamel.yaml import YAML
from typer.testing import CliRunner

from cell.commands import drive_gateway_command
from cell.config.problem import Problem, Severity
from drive_gateway.config import AxisSettings, load_drives
from drive_gateway.config.known_drive import KNOWN_DRIVES, UNITS, known_drive
from drive_gateway.config.load import read_drives
from tests.unit.config_world import DRIVES, Copy
from tests.unit.repository import ROOT

NODE = "{node: 1, gear: 180"
FOLDER = ROOT / "drive_gateway" / "config" / "known_drives"


def like(folder: Path, keys: str) -> Copy:
    """The left arm with more keys at J1."""
    return Copy(folder).change(DRIVES, NODE, f"{{{keys}, {NODE[1:]}")


def j1(copy: Copy) -> AxisSettings:
    return load_drives(copy.drives, "left_bus").robots["left"].axes[0]


def problems(copy: Copy) -> list[Problem]:
    return list(read_drives(copy.drives).problems)


@pytest.mark.parametrize("name", KNOWN_DRIVES)
def test_each_known_drive_is_read_and_has_a_source_for_each_fact(name: str) -> None:
    known = known_drive(name)
    raw = YAML(typ="safe").load((FOLDER / f"{name}.yaml").read_text())
    assert list(raw) == ["drive", "keys", "lacks", "objects", "notes"]
    facts = list(known.facts())
    assert len(facts) == sum(len(raw[part]) for part in ("keys", "lacks", "objects", "notes"))
    assert all(fact.endswith("]") and "[" in fact for fact in facts)


@pytest.mark.parametrize("name", KNOWN_DRIVES)
def test_an_axis_that_is_like_a_known_drive_is_good_once_its_units_are_said(tmp_path: Path, name: str) -> None:
    missing = [unit for unit in UNITS if unit not in known_drive(name).keys]
    said = {"velocity_unit": "rpm", "acceleration_unit": "rpm/s"}
    keys = ", ".join([f"like: {name}", *(f"{unit}: {said[unit]}" for unit in missing)])
    copy = like(tmp_path, keys)
    found = problems(copy)
    assert all(problem.severity is Severity.WARNING for problem in found)
    assert sum("never tried with this program" in problem.found for problem in found) == 1
    assert j1(copy).units.velocity_name == str(known_drive(name).axis_keys().get("velocity_unit", "rpm"))


def test_what_is_known_of_the_drive_counts_as_said_and_what_the_file_says_goes_before(tmp_path: Path) -> None:
    axis = j1(like(tmp_path / "known", "like: festo_cmmp_as"))
    assert (axis.units.velocity_name, axis.interpolated, axis.interpolation) == ("rpm", True, -2)
    axis = j1(like(tmp_path / "own", "like: festo_cmmp_as, velocity_unit: 0.1 rpm"))
    assert (axis.units.velocity_name, axis.units.acceleration_name) == ("0.1 rpm", "rpm/s")


def test_a_drive_that_is_not_known_is_refused_with_those_that_are(tmp_path: Path) -> None:
    [problem] = problems(like(tmp_path, "like: maxon"))
    assert (problem.path, problem.found) == ("robots.left.axes.J1.like", "'maxon'")
    assert problem.allowed == f"one of {', '.join(KNOWN_DRIVES)}"


def test_a_unit_that_no_document_says_must_be_said(tmp_path: Path) -> None:
    """Ramps in counts/s^2 at a drive that takes speeds in rpm would be what nobody meant."""
    errors = [item for item in problems(like(tmp_path, "like: nanotec_pd6c")) if item.severity is Severity.ERROR]
    assert [item.found for item in errors] == ["nanotec_pd6c without acceleration_unit"]


def test_objects_that_a_known_drive_lacks_are_waived_and_told_at_the_key(tmp_path: Path) -> None:
    copy = like(tmp_path, "like: novanta_emcl")
    assert j1(copy).waived == {0x1016, 0x6007, 0x605A}
    told = [problem for problem in problems(copy) if "may lack" in problem.found]
    assert [problem.path for problem in told] == ["robots.left.axes.J1.like"] * 3
    assert j1(like(tmp_path / "own", 'like: novanta_emcl, waive: ["6007"]')).waived == {0x6007}


def test_a_key_that_needs_an_object_which_the_drive_lacks_is_told(tmp_path: Path) -> None:
    homing = "homing: {method: 35, fast: 1, slow: 1, acceleration: 1, position: 0}"
    told = [problem.found for problem in problems(like(tmp_path, f"like: maxon_epos4, {homing}"))]
    assert any(found.startswith("homing, for which 607Ch is written: a drive that has none (EDS") for found in told)


def test_objects_of_its_maker_have_their_types(tmp_path: Path) -> None:
    axis = j1(like(tmp_path, 'like: elmo_gold, objects: {"2F75:00": 10}'))
    assert [(item.index, item.name, item.data) for item in axis.objects] == [
        (0x2F75, "Extrapolation cycles timeout", b"\x0a\x00")
    ]


def test_a_check_of_the_file_shows_each_fact_with_its_source(tmp_path: Path) -> None:
    result = CliRunner().invoke(drive_gateway_command.app, ["check", str(like(tmp_path, "like: elmo_gold").drives)])
    assert result.exit_code == 0, result.output
    assert "like elmo_gold: left.J1; keys of the file go before\n" in result.output
    assert "  velocity_unit: counts/s  [EDS CANeds Gold V002: 6096h is 1/1 and read-only]\n" in result.output


def test_the_tools_know_the_objects_of_its_maker(tmp_path: Path) -> None:
    drives = like(tmp_path, 'like: elmo_gold, objects: {"2F75:00": 10}').drives
    result = CliRunner().invoke(drive_gateway_command.app, ["plan", str(drives), "left.J1"])
    assert "write, check  2F75h:00  Extrapolation cycles timeout = 10 (000Ah)" in result.output
