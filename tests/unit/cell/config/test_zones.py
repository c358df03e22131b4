"""Zones in the cell file: their shapes, their priorities, and their mistakes."""

from pathlib import Path

import pytest

from cell.commands.checks import check_cell
from cell.config import load_cell
from cell.config.settings import ZoneSettings
from cell.geometry import SpaceOf
from tests.unit.config_world import CELL, Copy

BOX = "size: [900, 2600, 2600]"


def zone(folder: Path, new: str) -> ZoneSettings:
    return load_cell(Copy(folder).change(CELL, BOX, new).cell).zones["handover"]


@pytest.mark.parametrize(
    ("said", "shape", "size_m"),
    [
        (BOX, "box", (0.9, 2.6, 2.6)),
        ("box: [900, 2600, 2600]", "box", (0.9, 2.6, 2.6)),
        ("sphere: 450", "sphere", (0.45,)),
        ("cylinder: {radius: 450, length: 2600}", "cylinder", (0.45, 2.6)),
    ],
)
def test_a_zone_names_its_shape_as_a_thing_does(
    said: str, shape: str, size_m: tuple[float, ...], tmp_path: Path
) -> None:
    found = zone(tmp_path, said)
    assert (found.shape, found.size_m, found.pose.position_m) == (shape, size_m, (0.0, 0.0, 1.4))


def test_robots_have_no_priority_unless_one_is_given(tmp_path: Path) -> None:
    assert zone(tmp_path / "a", BOX).priority == {}
    assert zone(tmp_path / "b", f"{BOX}\n    priority: {{left: 2}}").priority == {"left": 2}


def test_a_zone_is_of_the_body_unless_it_is_said_to_be_of_the_tcp(tmp_path: Path) -> None:
    assert zone(tmp_path / "a", BOX).of is SpaceOf.BODY
    assert zone(tmp_path / "b", f"{BOX}\n    of: tcp").of is SpaceOf.TCP


@pytest.mark.parametrize(
    ("said", "says"),
    [
        ("frame: null", "zones.handover: found no shape, allowed exactly one of box, size, sphere, cylinder"),
        (f"{BOX}\n    sphere: 4", "zones.handover: found size and sphere, allowed exactly one of"),
        ("sphere: 0", "zones.handover.sphere: found 0, allowed more than 0"),
        ("cylinder: {radius: 4}", "zones.handover.cylinder.length: found nothing"),
        ("half_space: true", "zones.handover.half_space: found unknown key 'half_space'"),
        (f"{BOX}\n    of: flange", "zones.handover.of: found 'flange', allowed"),
        (f"{BOX}\n    margin: 5", "zones.handover.margin: found unknown key 'margin'"),
        (
            f"{BOX}\n    priority: {{middle: 2}}",
            "a priority of middle, which may not ask for the zone, allowed",
        ),
        (f"{BOX}\n    priority: {{left: -1}}", "zones.handover.priority.left: found -1, allowed 0 or more"),
        (f"{BOX}\n    priority: {{left: 1.5}}", "zones.handover.priority.left: found 1.5, allowed"),
    ],
)
def test_what_is_wrong_with_a_zone_is_told_at_its_place(said: str, says: str, tmp_path: Path) -> None:
    bundle, problems = check_cell(Copy(tmp_path).change(CELL, BOX, said).cell)
    assert bundle is None
    assert [problem for problem in problems if says in str(problem)], problems
