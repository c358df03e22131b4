"""What is said of robots that keep each other out of the room that each needs next."""

import pytest

from cell.manager.separation.standoff import StandoffWatch
from cell.messages import Deadlock, Refusal

REFUSED = {"left": Refusal("right", "right's hand is near"), "right": Refusal("left", "left's hand is near")}


def _told(back_m: dict[str, float]) -> Deadlock:
    watch = StandoffWatch(lambda robot, _robots: back_m.get(robot), {"left": (1.7124, -0.05, 1.25)}.get)
    assert watch.look(REFUSED, 0.0) == []
    (standoff,) = watch.look(REFUSED, 2.0)
    return standoff


def test_it_says_who_waits_for_whom_and_where_those_are_of_whom_that_is_known() -> None:
    assert _told({}).text == (
        "left and right wait for each other: right's hand is near; left's hand is near; "
        "the TCP of left is at X 1712, Y -50, Z 1250 mm"
    )


@pytest.mark.parametrize(
    ("back_m", "remedy"),
    [
        ({"right": 0.123}, "let right back, by some 130 mm: `cell override right -50` until left got through, then"),
        (
            {"left": 0.06, "right": 0.1},
            "let left back, by some 60 mm: `cell override left -50` until right got through",
        ),
        ({}, "no way back frees them"),
    ],
)
def test_it_says_who_has_to_go_back_and_how_far(back_m: dict[str, float], remedy: str) -> None:
    assert _told(back_m).remedy.startswith(remedy)
