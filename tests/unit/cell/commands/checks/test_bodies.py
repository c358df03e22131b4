"""Links of one robot that are in each other at home."""

from pathlib import Path

import numpy as np
import pytest

from cell.commands.checks import check_cell
from robot_agent.kinematics import load_model
from tests.unit.config_world import CONFIGS, ROBOT, Copy

HOME = "home: {J1: 0, J2: -35, J3: 35, J4: 0, J5: 90, J6: 0}"


FOLDED = "home: {J1: 0, J2: -90, J3: 75, J4: 0, J5: 100, J6: 0}"


def test_a_hand_in_the_robots_own_body_is_told_once(tmp_path: Path) -> None:
    copy = Copy(tmp_path).change(ROBOT, HOME, FOLDED)
    bundle, problems = check_cell(copy.cell)
    assert bundle is None
    (told,) = {copy.shown(problem) for problem in problems}
    assert told.startswith(
        f"{copy.place(ROBOT, '§home: {J1')}: home: found links too near to each other (margin 0 mm): "
    )
    assert told.endswith(
        "link flange to link 1 183 mm, link flange to link 2 133 mm, allowed a home position at which they are apart, "
        "slimmer capsules where the robot is slimmer, or pairs that may touch under self_collision"
    )


def test_pairs_that_may_touch_are_no_finding(tmp_path: Path) -> None:
    pairs = "[[1, flange], [2, flange], [flange, base], [1, 5], [2, 5], [1, 4], [base, 5], [base, 4]]"
    copy = Copy(tmp_path).change(ROBOT, HOME, f"{FOLDED}\nself_collision: {{may_touch: {pairs}}}")
    assert not any("too near to each other" in str(problem) for problem in check_cell(copy.cell)[1])


def test_a_name_that_is_no_link_is_told_with_those_that_there_are(tmp_path: Path) -> None:
    copy = Copy(tmp_path).change(ROBOT, HOME, f"{HOME}\nself_collision: {{margin: 5, may_touch: [[2, hand]]}}")
    (told,) = {copy.shown(problem) for problem in check_cell(copy.cell)[1]}
    assert told.endswith(
        "self_collision.may_touch[0][1]: found 'hand', allowed one of base, 1, 2, 3, 4, 5, flange, tool"
    )


def test_links_that_always_touch_are_no_finding() -> None:
    # The hand of this arm overlaps with the turning part of its forearm, two links away, in every pose.
    model = load_model(CONFIGS / ROBOT)
    four, flange = (next(i for i, c in enumerate(model.body) if model.link_names[c.link] == n) for n in ("4", "flange"))
    q = np.random.default_rng(2).uniform(*model.limits.position.T, (500, 6))
    ends = model.capsules(q)
    near = np.linalg.norm(ends[:, four, 1] - ends[:, flange, 0], axis=-1)
    assert (near < model.capsule_radii[[four, flange]].sum()).all()
    assert check_cell(CONFIGS / "two_arms" / "cell.yaml")[1] == []


@pytest.mark.parametrize(("name", "pairs"), [("delta", 9), ("six_axis", 6), ("palletizer", 5)])
def test_every_link_is_joined_to_the_next_or_to_its_arm(name: str, pairs: int) -> None:
    model = load_model(CONFIGS / "models" / f"{name}.yaml")
    joined = model.joined_links()
    assert len(joined) == pairs
    assert all(one < other < len(model.link_names) for one, other in joined)
