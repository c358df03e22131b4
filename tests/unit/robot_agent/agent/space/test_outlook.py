"""In which piece of what it has planned a robot is, where its way comes again exactly as it was."""

from types import SimpleNamespace

import numpy as np
import pytest

from cell.messages import PlannedWay, Stay
from cell.net.codec import decode, encode
from robot_agent.agent.space.outlook import Outlook
from robot_agent.workspace import Crossing, MotionSections, of_points

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
    seen.look(1, [SimpleNamespace(sections=motion, crossings=()) for motion in motions], more=False)
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
    seen.look(1, [SimpleNamespace(sections=each, crossings=()) for each in (first_motion, rounds(1))], more=False)
    assert seen.follow(way.sections[ROUND + 2 : ROUND + 3]).tolist() == [ROUND + 2 if same else 2]


def test_a_zone_that_a_motion_is_in_to_its_end_and_the_next_one_from_its_beginning_is_one_stay() -> None:
    """Sections of one second each, which are pieces, too."""
    motions = [
        SimpleNamespace(sections=rounds(1), crossings=(Crossing("press", 6.5, 10.0), Crossing("door", 1.0, 3.0))),
        SimpleNamespace(sections=rounds(1), crossings=(Crossing("press", 0.0, 2.5), Crossing("press", 7.5, 8.0))),
    ]
    seen = Outlook("r", "boot")
    seen.look(1, motions, more=False)
    way = seen.news(0.0)
    assert way is not None
    assert way.stays == (Stay("door", 1, 2), Stay("press", 6, 12), Stay("press", 17, 17))


def test_zones_that_a_robot_takes_together_begin_together() -> None:
    """It cannot stop between them, and waits for both in front of the first one."""
    crossings = (Crossing("press", 2.5, 6.0), Crossing("door", 5.0, 8.0), Crossing("hatch", 9.2, 9.8))
    seen = Outlook("r", "boot")
    seen.look(1, [SimpleNamespace(sections=rounds(1), crossings=crossings)], more=False)
    way = seen.news(0.0)
    assert way is not None
    assert sorted((stay.zone, stay.first) for stay in way.stays) == [("door", 2), ("hatch", 9), ("press", 2)]


@pytest.mark.parametrize(
    ("motions", "count", "more"), [(1, 10, False), (1, 300, False), (3, 20, False), (9, 300, True), (40, 6, True)]
)
def test_a_plan_of_hundreds_of_metres_is_told_as_far_as_one_message_can(motions: int, count: int, more: bool) -> None:
    """In each section there is a stay, too."""
    ways = [rounds(count) for _ in range(motions)]
    crossings = tuple(Crossing("press", at + 0.2, at + 0.4) for at in range(0, 10 * count, 2))
    seen = Outlook("r", "boot")
    seen.look(1, [SimpleNamespace(sections=way, crossings=crossings) for way in ways], more=False)
    told = seen.news(0.0)
    assert told is not None
    again = decode(PlannedWay, encode(told))
    assert again.more is more
    assert len(again.pieces) >= min(motions * count, 500)
    assert again.stays == told.stays
    assert seen.follow(ways[0].sections[:3]).tolist()[0] == 0
