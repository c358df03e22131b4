"""What operators say of where robots stay: what others may use by it, when it is refused, and when it ends."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cell.manager.records import Assured
from cell.manager.separation.assurances import Ended, Sighting
from cell.manager.separation.separation import Separation, SpaceNews
from cell.messages import Confinement, ConfineRobot, Heard, Presence, RobotStands, Sections, Way
from tests.unit.cell.manager.separation.sections_on_a_line import RADIUS_M, place
from tests.unit.manager_world import settings
from tests.unit.plain_body import plain_body

FORWARD = (0.0, 0.0, 0.0, 1.0)
REACH_M, SILENT_S = 0.5, settings().times.moves_alone_s
ABOUT_RIGHT = Confinement((0.4, 0.4, 0.4), (1.0, 0.0, 0.0), FORWARD)
CONFINE = ConfineRobot("right", ABOUT_RIGHT, "me")
STANDS = RobotStands("right", "me")
SAY = "where it stays: `cell stands right` or `cell confine right`"


def about(x: float) -> object:
    """Sections are 10 mm apart."""
    return pytest.approx(x, abs=0.011)


class Line:
    """Two balls on a line; left asks for the way to the right, 10 mm after 10 mm."""

    def __init__(self, stored: tuple[Assured, ...] = (), epoch: int = 5) -> None:
        self.separation = Separation(settings(), "m", epoch, stored)
        self.epoch = epoch
        self.now = 0.0
        self.told: list[SpaceNews] = []
        self.right: Presence | None = None
        self.powered: bool | None = False
        self.in_setup = False
        self._sequence = 0

    def says(self, robot: str, x: float, known: bool = True, asks: tuple[float, ...] = ()) -> None:
        """It stands at `x`, or does not know where."""
        self._sequence += 1
        end = (x, 0.0, 0.0)
        body = plain_body((RADIUS_M,), ((end + end,),), (0.0,), known=known, base=(1.0, 0.0, 0.0), reach_m=REACH_M)
        owned = place(x) if known else Sections()
        way = Way(owned.joined(place(*asks)), len(owned), len(owned), ("hand",))
        presence = Presence(
            robot, robot, 1, self._sequence, Heard("m", 1), "digest", body, 0.0, epoch=self.epoch, way=way
        )
        if robot == "right":
            self.right = presence
        self.told += self.separation.hear(presence)

    @property
    def sighting(self) -> Sighting:
        return Sighting(self.right, self.powered, self.in_setup)

    def say(self, command: ConfineRobot | RobotStands) -> tuple[Assured | None, str]:
        return self.separation.assurances.give(command, self.sighting)

    def follow(self, seconds: float = 0.01) -> list[Ended]:
        self.now += seconds
        return self.separation.follow({"left": Sighting(None, False, False), "right": self.sighting}, self.now)

    def may_go_to(self) -> float:
        """How far left is cleared from 0 on, of 2 m [m]; and what stands against the rest."""
        asks = tuple(np.arange(0.01, 2.0, 0.01).round(2).tolist())
        self.says("left", 0.0, asks=asks)
        (clearance,), _ = self.separation.clear(0.0)
        self.refused = "" if clearance.refused is None else clearance.refused.text
        return asks[clearance.cleared - 1] if clearance.cleared else 0.0


def test_a_robot_that_was_never_heard_keeps_others_only_out_of_its_box() -> None:
    line = Line()
    assert line.may_go_to() == 0.0
    assert line.refused == "right not heard yet: start its agent, or say where it stays: `cell confine right`"
    _, text = line.say(CONFINE)
    assert text == (
        "right stays in the box of 400 x 400 x 400 mm about X 1000 Y 0 Z 0 mm. All others keep away from there "
        "until it says itself where it is. You are answerable for it; it replaces no hard-wired protection"
    )
    assert line.may_go_to() == about(0.64)  # 0.8 - 0.12 - 0.03
    assert line.refused.endswith("the box to which right is confined; 30 mm are kept")


def test_a_box_takes_the_place_of_the_whole_reach_and_of_all_that_the_robot_had() -> None:
    line = Line()
    line.says("right", 1.6)
    line.says("right", 1.6, known=False)
    assert line.may_go_to() == about(0.34)  # 1.0 - 0.5 - 0.12 - 0.03
    assert line.refused.endswith(
        f"what right can reach, and right does not know where it is: `cell drives` says how it finds out, or say {SAY}"
    )
    line.say(replace(CONFINE, box=replace(ABOUT_RIGHT, position_m=(0.9, 0.0, 0.0))))
    assert line.may_go_to() == about(0.54)
    line.says("right", 1.6, known=False)
    assert line.may_go_to() == about(0.54), "it still does not know"


def test_a_robot_that_stands_where_it_was_last_known_keeps_others_only_out_of_there() -> None:
    line = Line()
    line.says("right", 1.0)
    line.says("right", 1.0, known=False)
    _, text = line.say(STANDS)
    assert text.startswith("right stands where it was last known: X 880 to 1120, Y -120 to 120, Z -120 to 120 mm. All ")
    assert line.may_go_to() == about(0.73)  # 1.0 - 0.24 - 0.03


def test_who_was_never_known_stands_nowhere() -> None:
    line = Line()
    word, text = line.say(STANDS)
    assert word is None
    assert text == "this manager does not know where right was: say in which box it stays: `cell confine right`"


def test_a_robot_that_was_moved_by_set_up_does_not_stand_where_it_was_last_known() -> None:
    line = Line()
    line.says("right", 1.0)
    line.says("right", 1.0, known=False)
    line.in_setup = True
    line.follow()
    line.in_setup = False
    assert "`cell confine right`" in line.say(STANDS)[1]


@pytest.mark.parametrize("command", [CONFINE, STANDS])
def test_nothing_is_said_of_one_that_says_it_itself(command: ConfineRobot | RobotStands) -> None:
    line = Line()
    line.says("right", 1.0)
    assert line.say(command) == (
        None,
        "right says itself where it is, and others keep away from there: nothing is to be said of it",
    )


def test_one_that_can_move_may_stay_in_a_box_and_does_not_stand() -> None:
    line = Line()
    line.says("right", 1.0)
    line.says("right", 1.0, known=False)
    line.powered = True
    assert line.say(STANDS)[1] == "the drives of right are on: `cell disable right`, then say it again"
    line.right = None
    assert "take its power" in line.say(STANDS)[1]
    line.powered = None
    word, text = line.say(STANDS)
    assert word is not None
    assert text.endswith("its gateway is silent: see to it that right has no power")
    line.powered = True
    word, _ = line.say(CONFINE)
    assert word is not None


@pytest.mark.parametrize("command", [CONFINE, STANDS])
def test_it_ends_when_the_robot_says_where_it_is(command: ConfineRobot | RobotStands) -> None:
    line = Line()
    line.says("right", 1.0)
    line.says("right", 1.0, known=False)
    line.say(command)
    assert line.follow() == []
    assert list(line.separation.assurances.present) == ["right"]
    line.says("right", 1.05)
    (ended,) = line.follow()
    assert ended == Ended("right", "right says itself where it is: what was said of it counts no more")
    assert line.separation.assurances.present == {}
    assert line.may_go_to() == about(0.78)
    assert [each.code for each in line.told] == (["space_forced"] if command is STANDS else [])


def test_a_word_that_was_wrong_is_told_and_stops_all_where_it_matters() -> None:
    line = Line()
    line.say(CONFINE)
    line.may_go_to()
    line.says("right", 0.4)
    assert [(each.code, each.stops) for each in line.told] == [("space_breach", True)]


def test_that_it_stands_ends_when_its_drives_come_on_a_box_does_not() -> None:
    line = Line()
    line.says("right", 1.0)
    line.says("right", 1.0, known=False)
    line.say(CONFINE)
    line.powered = True
    assert line.follow() == []
    line.powered = False
    line.separation.assurances.end("right")
    line.says("right", 1.0)
    line.says("right", 1.0, known=False)
    line.say(STANDS)
    line.powered = True
    (ended,) = line.follow()
    assert ended.remedy == "home it, or say where it stays: `cell confine right`"
    assert line.may_go_to() == about(0.34)


def test_taken_back_all_is_as_it_was_before() -> None:
    line = Line()
    line.say(CONFINE)
    assert line.separation.assurances.end("right")
    assert line.may_go_to() == 0.0
    line.says("right", 1.0)
    line.right = None
    line.say(CONFINE)
    assert line.separation.assurances.end("right")
    assert line.may_go_to() == 0.0, "nobody knows what it may use: what it had was given up for the box"
    assert not line.separation.assurances.end("right")


@pytest.mark.parametrize("command", [CONFINE, STANDS])
def test_it_counts_for_the_next_manager_once_the_robot_is_silent_for_long_or_says_that_it_is_lost(
    command: ConfineRobot | RobotStands,
) -> None:
    line = Line()
    line.says("right", 1.0)
    line.says("right", 1.0, known=False)
    word, _ = line.say(command)
    assert word is not None
    free = line.may_go_to()
    silent, lost = Line((word,), 6), Line((word,), 7)
    silent.follow()
    silent.follow(SILENT_S - 0.1)
    assert silent.may_go_to() == 0.0, "its agent may live, and move"
    silent.follow(0.2)
    assert silent.may_go_to() == free
    lost.says("right", 1.0, known=False)
    lost.follow()
    assert lost.may_go_to() == free


def test_what_was_said_of_one_that_knows_where_it_is_never_counts_again() -> None:
    line = Line()
    word, _ = line.say(CONFINE)
    assert word is not None
    after = Line((word, replace(word, robot="stranger")), 6)
    after.says("right", 1.2)
    assert [each.robot for each in after.follow(10.0)] == ["right"]
    assert after.separation.assurances.present == {}
    assert after.may_go_to() == about(0.93)


def test_nobody_gets_more_room_within_the_reach_of_a_robot_in_set_up() -> None:
    line = Line()
    line.says("right", 1.0)
    line.in_setup = True
    line.follow()
    assert line.may_go_to() == about(0.34)
    assert line.refused.endswith("what right can reach, and right is in set-up")
    line.in_setup = False
    line.follow()
    assert line.may_go_to() == about(0.73)


COORDINATE = st.floats(-1.5, 1.5)


@given(st.tuples(COORDINATE, COORDINATE, COORDINATE), st.tuples(*[st.floats(0.05, 2.0)] * 3), st.floats(0.0, 6.0))
def test_a_ball_is_in_the_box_where_all_points_of_its_surface_are(
    middle: tuple[float, float, float], size: tuple[float, float, float], turn: float
) -> None:
    """By 200 points on the ball."""
    line = Line()
    quaternion = (0.0, 0.0, float(np.sin(turn / 2.0)), float(np.cos(turn / 2.0)))
    line.say(replace(CONFINE, box=Confinement(size, middle, quaternion)))
    line.says("right", 1.0)
    rng = np.random.default_rng(3)
    points = rng.normal(size=(200, 3))
    points = np.array([1.0, 0.0, 0.0]) + RADIUS_M * points / np.linalg.norm(points, axis=1, keepdims=True) - middle
    c, s = np.cos(turn), np.sin(turn)
    beyond = np.abs(points @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])) - np.array(size) / 2.0
    inside = line.told == []
    if inside:
        assert beyond.max() <= 1e-6
    else:
        assert beyond.max() > -0.005
