"""In which piece of what it has planned a robot is, where its way comes again exactly as it was."""

from types import SimpleNamespace

import numpy as np
import pytest

from robot_agent.agent.space.outlook import Outlook
from robot_agent.workspace import MotionSections, of_points

ROUND = 10
_AWAY_M = 0.1
"""From one section to the next: each is a piece of its own."""


def rounds(count: int) -> MotionSections:
    """A way that leads `count` times from the first to the last of ten places, all of whose sections differ."""
    places = np.tile(np.arange(ROUND), count) * _AWAY_M
    points = np.zeros((len(places), 1, 2, 3))
    points[:, 0, :, 0] = places[:, None]
    taus = np.arange(len(places) + 1, dtype=float)
    return MotionSections(taus, of_points(points, np.full((len(places), 1), 0.05)), np.zeros(len(places)))


def outlook(*motions: MotionSections) -> Outlook:
    seen = Outlook("r", "boot")
    seen.look(1, [SimpleNamespace(sections=motion) for motion in motions], more=False)
    return seen


def test_it_is_in_the_round_in_which_it_is_and_not_in_the_last_one() -> None:
    way = rounds(3)
    seen = outlook(way)
    for first in range(3 * ROUND - 3):
        assert seen.follow(way.sections[first : first + 3]).tolist() == [first, first + 1, first + 2]


def test_backwards_it_comes_back_to_the_round_before() -> None:
    way = rounds(3)
    seen = outlook(way)
    for first in (*range(15), *range(15, 4, -1)):
        assert seen.follow(way.sections[first : first + 1]).tolist() == [first]


@pytest.mark.parametrize("same", [True, False])
def test_what_comes_later_changes_nothing_and_another_motion_begins_at_its_beginning(same: bool) -> None:
    way, other = rounds(2), rounds(1)
    seen = outlook(way)
    for first in range(ROUND + 2):
        seen.follow(way.sections[first : first + 1])
    first_motion = way if same else other
    seen.look(1, [SimpleNamespace(sections=each) for each in (first_motion, rounds(1))], more=False)
    assert seen.follow(way.sections[ROUND + 2 : ROUND + 3]).tolist() == [ROUND + 2 if same else 2]
