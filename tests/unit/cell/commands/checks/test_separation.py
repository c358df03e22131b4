"""Robots that are kept apart: whether both can stand at home, and what a lost one leaves to the other."""

from pathlib import Path

import pytest

from cell.commands.checks import check_cell
from cell.commands.checks.separation import robots_apart
from cell.config.settings import PairMargin, PoseSettings, SeparationSettings
from robot_agent.workspace import PlacedRobot
from tests.unit.config_world import Copy
from tests.unit.six_axis_arm import arm

SHARED = "shared_room/cell.yaml"
MARGIN = "separation: {margin: 30}"
STRAIGHT = (0.0, 0.0, 0.0, 1.0)


def _told(copy: Copy) -> list[str]:
    bundle, problems = check_cell(copy.folder / SHARED)
    assert bundle is not None, "warnings refuse no cell"
    return [copy.shown(problem) for problem in problems]


def _nearer(folder: Path, separation: str) -> Copy:
    """With 60 mm between the arms at home, instead of 1560."""
    copy = Copy(folder).change(SHARED, MARGIN, separation)
    return copy.change(SHARED, "X: -1800", "X: -1050").change(SHARED, "X: 1800", "X: 1050")


def test_homes_nearer_than_the_margin_and_what_is_kept_around_each_are_told(tmp_path: Path) -> None:
    copy = _nearer(tmp_path, MARGIN)
    (told,) = _told(copy)
    assert told == (
        f"{copy.place(SHARED, '§separation:')}: warning: separation: found left and right 60 mm apart at home "
        "(link 4 of left, link 4 of right): they cannot both stand there, allowed 70 mm or more, the margin "
        "and 20 mm around each: bases or homes farther apart, or a smaller margin of these two under separation.pairs"
    )


def test_a_margin_of_the_two_themselves_is_where_it_is_told(tmp_path: Path) -> None:
    copy = _nearer(tmp_path, "separation:\n  margin: 10\n  pairs:\n    - {robots: [right, left], margin: 25}")
    (told,) = _told(copy)
    assert told.startswith(f"{copy.place(SHARED, '§margin: 25')}: warning: separation.pairs[0].margin: found left and ")
    assert "allowed 65 mm or more" in told


@pytest.mark.parametrize("separation", ["separation: {margin: 19}", "separation: off"])
def test_homes_that_are_far_enough_apart_and_cells_without_separation_are_no_finding(
    tmp_path: Path, separation: str
) -> None:
    assert not any("apart at home" in told for told in _told(_nearer(tmp_path, separation)))


def test_homes_in_each_other_are_told_once(tmp_path: Path) -> None:
    copy = Copy(tmp_path).change(SHARED, "X: 1800", "X: -600")
    _, problems = check_cell(copy.folder / SHARED)
    assert [problem.path for problem in problems] == ["robots.right.base"]


def test_a_lost_robot_leaves_another_one_what_is_outside_its_reach() -> None:
    model = arm()
    reach_m = model.reach_m

    def notes(x_m: float) -> list[str]:
        robots = {"a": PlacedRobot.at(model), "b": PlacedRobot.at(model, PoseSettings((x_m, 0.0, 0.0), STRAIGHT))}
        (pair,) = robots_apart(SeparationSettings(1.0, (PairMargin(("b", "a"), 0.05),)), robots)
        return pair.notes

    (base_m,) = (radius for capsule, radius in zip(model.body, model.capsule_radii, strict=True) if capsule.link == 0)
    for x_m, expected in (
        (reach_m, "cannot move"),
        (reach_m + base_m + 0.04, "cannot move"),
        (reach_m + base_m + 0.1, "moves only outside its reach"),
        (2.0 * reach_m + 0.04, "moves only outside its reach"),
    ):
        far = f"their bases are {1000 * x_m:.0f} mm apart."
        assert notes(x_m) == [
            f"While b does not know where it is, a {expected}: b reaches {1000 * reach_m:.0f} mm, {far}",
            f"While a does not know where it is, b {expected}: a reaches {1000 * reach_m:.0f} mm, {far}",
        ]
    assert notes(2.0 * reach_m + 0.06) == []
