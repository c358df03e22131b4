"""The programs by which the textbook explains its robot language run: the arm goes their ways and switches in place.

What was played is judged by formulas of its own: turns of the six joints, lines, circles and Newton's steps.
"""

import functools
from dataclasses import replace

import numpy as np
import pytest

from cell.config.points_file import Point, PosePoint, Signal, SignalKind
from cell.config.settings import MountedAtStart
from cell.messages import CellTime, ConveyorCount, Enable, FramePose, Mode, ProgramState, Run
from robot_agent.kinematics import Model
from robot_agent.language import Points
from tests.unit.agent_runs import until
from tests.unit.agent_world import CYCLE_S, AgentWorld
from tests.unit.measured_world import BELT, COUNTS_PER_M
from tests.unit.output_ticks import FIRST_TICK
from tests.unit.played_route import Numbers, arc, assert_follows, joint_line, joints_at, line, polygon
from tests.unit.robot_agent.language.reference_programs import (
    HOME,
    MODEL,
    POINTS,
    STAY,
    SUB,
    TANG,
    at,
    placed,
    taught_with,
    with_tools,
)
from tests.unit.six_axis_arm import arm as textbook_arm
from tests.unit.turned_arm import flange

CURVED_M = 2e-4
"""Where the curvature steps, the TCP may leave the curve by 0.1 mm."""
STRAIGHT_M = 2e-6


class Runs(AgentWorld):
    """A robot with the points of the textbook, a belt, an input `part` and an output `laser`."""

    def __init__(
        self,
        text: str,
        points: dict[str, Point] | None = None,
        model: Model = MODEL,
        frames: tuple[FramePose, ...] = STAY,
        belt_m_s: float = 0.0,
    ) -> None:
        super().__init__(
            text,
            arm=model,
            corrections={"trk1": replace(BELT, name="trk1")},
            points=Points(POINTS if points is None else points),
            signals={"di3": Signal(SignalKind.INPUT, "part", 0.5)},
            mounted_at_start=MountedAtStart.AS_DESCRIBED,
        )
        self.frames, self.outputs, self.inputs = frames, ("laser",), {"part": False}
        self.belt_m_s = belt_m_s
        until(self, lambda: self.states != [] and self.state.mode is Mode.DISABLED)
        self.call(Enable())
        until(self, lambda: self.state.mode is Mode.READY)
        self.call(Run())
        until(self, lambda: self.state.mode is Mode.RUNNING)

    def step(self) -> None:
        counts = round(self.belt_m_s * self.now * COUNTS_PER_M) % 2**32
        self.agent.receive(ConveyorCount("line", CellTime("m", self.now), counts, None), self.now)
        super().step()

    def to_end(self, seconds: float = 120.0) -> "Runs":
        until(self, lambda: self.state.program.state is not ProgramState.RUNNING, seconds)
        assert self.state.program.state is ProgramState.DONE, self.state.program.error
        self.run(0.1)
        return self

    @functools.cached_property
    def joints(self) -> Numbers:
        return np.array(self.played)

    @functools.cached_property
    def places(self) -> Numbers:
        return flange(self.joints)[0]

    @property
    def switched_at(self) -> list[tuple[bool, int]]:
        """On or off, and the sample of what is played at which it was switched, in order."""
        return [(event.value, tick - FIRST_TICK) for tick, event in self.switched]


def home() -> Numbers:
    return np.array(MODEL.home)


def joints_of(name: str, near: Numbers) -> Numbers:
    return joints_at(at(name)[0], HOME[:3, :3], near)


def switches_at(world: Runs, *expected: tuple[bool, str]) -> None:
    """That it switches so, each with the first set point at or after the end of a move at this point."""
    assert [on for on, _ in world.switched_at] == [on for on, _ in expected]
    for (_, sample), (_, name) in zip(world.switched_at, expected, strict=True):
        np.testing.assert_allclose(world.places[sample], at(name)[0], atol=0.7e-3)  # what is passed in a tick
        assert np.linalg.norm(world.places[sample - 1] - at(name)[0]) > 0.0


# 1


@pytest.mark.soak
def test_1_rounds_its_corners_without_a_stop_and_switches_half_way_in_them() -> None:
    text = "ML P1 R100 FC100\nSET DO laser\nML P2 R50\nML P3 R100\nRESET DO laser\nMC P5 Q4 R100\nMC P7 Q6"
    world = Runs(text).to_end()
    moved = np.flatnonzero(np.linalg.norm(np.diff(world.places, axis=0), axis=1) > 1e-9)
    path = world.places[moved[0] : moved[-1] + 2]
    p0, p1, p2, p3 = at("P0", "P1", "P2", "P3")
    curves = [*polygon(p0, p1, p2, p3), arc(*at("P3", "P4", "P5")), arc(*at("P5", "P6", "P7"))]
    known = np.concatenate(curves)
    away = np.array([np.linalg.norm(known - each, axis=1).min() for each in path])
    inside = np.zeros(len(path), dtype=bool)
    for name, most_mm in {"P1": 50.0, "P2": 50.0, "P3": 80.0, "P5": 100.0}.items():
        to_corner = np.linalg.norm(path - at(name), axis=1)
        inside |= to_corner <= most_mm / 1000.0 + CURVED_M
        assert 0.0005 < to_corner.min() < most_mm / 2000.0, name
    assert away[~inside].max() < 6e-4  # half a step of the places that are known, and the stepping curvature
    speed = np.linalg.norm(np.diff(path, axis=0), axis=1) / CYCLE_S
    assert speed[50:-50].min() > 0.001
    assert speed.max() < 0.1 + 1e-6
    np.testing.assert_allclose(path[-1], at("P7")[0], atol=STRAIGHT_M)
    (on, first), (off, last) = world.switched_at
    assert (on, off) == (True, False)
    for sample, name in ((first, "P1"), (last, "P3")):
        to_corner = np.linalg.norm(world.places - at(name), axis=1)
        nearest = int(to_corner.argmin())
        assert abs(sample - nearest) < 0.12 / CYCLE_S
        assert to_corner[sample] < 1.3 * to_corner[nearest] + 1e-3


# 2


def test_2_turns_twice_and_switches_where_it_began() -> None:
    world = Runs("ML P1 F200\nSET DO laser\nMC P2 Q3 H-720\nRESET DO laser").to_end()
    p0, p1, p2, p3 = at("P0", "P1", "P2", "P3")
    assert_follows(world.places, [line(p0, p1), arc(p1, p3, p2, -4.0 * np.pi)], CURVED_M)
    switches_at(world, (True, "P1"), (False, "P1"))


# 3


def test_3_passes_the_points_of_a_spline_in_the_direction_of_the_chords_and_switches_there() -> None:
    world = Runs("MS P1 F100\nSET DO laser\nMS P2\nRESET DO laser\nMS P3").to_end()
    switches_at(world, (True, "P1"), (False, "P2"))
    corners = at("P0", "P1", "P2", "P3")
    for before, here, after in zip(corners, corners[1:], corners[2:], strict=False):
        nearest = int(np.linalg.norm(world.places - here, axis=1).argmin())
        way, chord = world.places[nearest + 1] - world.places[nearest - 1], after - before
        assert way @ chord / np.linalg.norm(way) / np.linalg.norm(chord) > np.cos(np.radians(2.5))  # blended
        assert np.linalg.norm(way) / (2 * CYCLE_S) > 0.02
    np.testing.assert_allclose(world.places[-1], at("P3")[0], atol=STRAIGHT_M)


# 4


def test_4_goes_with_the_belt_from_trk_1_to_trk_0_and_switches_on_it() -> None:
    text = """MJ P0 F100
TRK 1 //synchronize with Conveyor #1
ML P1 F100
SET DO laser
ML P2 F100
RESET DO laser
TRK 0 //desynchronize from Conveyor #1
ML P3 F100
"""
    world = Runs(text, belt_m_s=0.02)
    until(world, lambda: world.state.program.line == 5, 60.0)
    tracked = len(world.played)
    until(world, lambda: world.state.program.line == 8, 60.0)
    left = len(world.played)
    world.to_end()
    p1, p2, p3 = at("P1", "P2", "P3")
    began = int(np.flatnonzero(np.linalg.norm(np.diff(world.places, axis=0), axis=1) > 1e-9)[0])
    seconds = CYCLE_S * (np.arange(len(world.places)) - began)
    on_it = np.arange(tracked + 50, left - 150)
    lag = world.places[on_it, 0] - p1[0] - world.belt_m_s * seconds[on_it]
    assert np.ptp(lag) < 3e-4  # what is counted has steps of 0.1 mm
    assert abs(lag.mean()) < 0.1 * world.belt_m_s + 1e-3
    y = world.places[tracked:left, 1]
    assert np.diff(y).min() > -1e-6
    assert (y.min(), y.max()) == pytest.approx((p1[1], p2[1]), abs=2e-3)
    assert [on for on, _ in world.switched_at] == [True, False]
    (_, first), (_, last) = world.switched_at
    assert world.places[first, 1] == pytest.approx(p1[1], abs=1e-3)
    assert world.places[last, 1] == pytest.approx(p2[1], abs=1e-3)
    np.testing.assert_allclose(world.places[-1], p3, atol=STRAIGHT_M)


# 5


@pytest.mark.soak
@pytest.mark.parametrize(("offset", "angle_deg"), [("", 0.0), (" H45", 45.0)])
def test_5_keeps_the_angle_of_the_tool_to_its_path_between_tang_1_and_tang_0(offset: str, angle_deg: float) -> None:
    text = TANG.format(offset).replace("MS P3\n", "MS P3\nSET DO laser\n").replace("MS P6\n", "MS P6\nRESET DO laser\n")
    world = Runs(text).to_end()
    switches_at(world, (True, "P3"), (False, "P6"))
    (_, first), (_, last) = world.switched_at
    path, rotation = flange(world.joints[first - 1 : last + 2])
    ways = path[2:, :2] - path[:-2, :2]
    turned = np.angle((rotation[1:-1, 0, 1] + 1j * rotation[1:-1, 1, 1]) / (ways[:, 0] + 1j * ways[:, 1]))
    assert len(ways) > 100
    assert np.abs(np.degrees(turned) - angle_deg).max() < 0.5
    assert np.linalg.norm(ways, axis=1).min() / (2 * CYCLE_S) > 0.02
    place, rotation = flange(world.joints[-1:])
    np.testing.assert_allclose(place, at("P8"), atol=STRAIGHT_M)
    np.testing.assert_allclose(rotation[0], HOME[:3, :3], atol=1e-5)


# 6


ROUND = """HOME F30
MJ P1 T0 F100 //move to starting point
LOOP:
ML P2 T1 Z1 F100
SET DO laser
ML P3 T1 Z1
"""


@pytest.mark.soak
def test_6_goes_round_and_round_and_is_at_rest_for_two_seconds_in_each() -> None:
    text = ROUND + "ML P4 T1 Z1\nRESET DO laser\nWAIT 2\nMC P2 Q5 T1 Z1\nGOTO LOOP //jump back to label"
    rounds = 2  # and the beginning of a third
    world = Runs(text, taught_with("t1", "P2", "P3", "P4", "P5"), with_tools())
    until(world, lambda: len(world.switched) == 2 * rounds and world.state.program.line == 10, 90.0)
    until(world, lambda: world.state.program.line == 6, 30.0)
    p1, p2, p3, p4, p5 = at("P1", "P2", "P3", "P4", "P5")
    way = [joint_line(home(), joints_of("P1", home())), line(p1, p2)]
    way += rounds * [line(p2, p3), line(p3, p4), arc(p4, p5, p2)]
    assert_follows(_up_to(world.places, p2, rounds + 1), way, CURVED_M)
    switches_at(world, *rounds * ((True, "P2"), (False, "P4")), (True, "P2"))
    still = np.linalg.norm(world.places - p4, axis=1) < 1e-7
    assert still.sum() * CYCLE_S == pytest.approx(2.0 * rounds, abs=0.2 * rounds)


def _up_to(places: Numbers, corner: Numbers, times: int) -> Numbers:
    """What was played until a place was come to so often."""
    near = np.linalg.norm(places - corner, axis=1) < 1e-5
    came = np.flatnonzero(near & ~np.append(False, near[:-1]))
    return places[: came[times - 1] + 1]


@pytest.mark.soak
def test_6_with_a_count_of_five_goes_to_and_fro_six_times_and_then_on() -> None:
    text = ROUND + "RESET DO laser\nGOTO LOOP 5 //repeat this loop 5 times\nMJ P1 T0 F100\nEND"
    world = Runs(text, taught_with("t1", "P2", "P3"), with_tools()).to_end()
    p1, p2, p3 = at("P1", "P2", "P3")
    begins = joints_of("P1", home())
    way = [joint_line(home(), begins), line(p1, p2), *5 * polygon(p2, p3, p2), line(p2, p3)]
    assert_follows(world.places, [*way, joint_line(joints_of("P3", begins), begins)], STRAIGHT_M)
    switches_at(world, *6 * ((True, "P2"), (False, "P3")))


# 7


def test_7_cuts_once_and_then_three_times_with_the_laser_on() -> None:
    text = SUB.replace("ML P5 T2 Z2", "ML P5 T2 Z2 F1000\n  SET DO laser").replace("ML P2", "ML P2 T0")
    text = text.replace("ML P6 T2 Z2", "ML P6 T2 Z2\n  RESET DO laser")
    world = Runs(text, taught_with("t2", "P5", "P6"), with_tools()).to_end()
    p1, p2, p5, p6 = at("P1", "P2", "P5", "P6")
    way = [joint_line(home(), joints_of("P1", home())), *polygon(p1, p5, p6, p2, p5, p6, p5, p6, p5, p6)]
    assert_follows(world.places, way, STRAIGHT_M)
    switches_at(world, *4 * ((True, "P5"), (False, "P6")))


# 8


@pytest.mark.parametrize(("part", "target"), [(True, "P2"), (False, "P3")])
def test_8_goes_by_the_input_that_is_measured_where_it_asks(part: bool, target: str) -> None:
    world = Runs("ML P1 F100\nIF DI3\n  ML P2\nSET DO laser\nELSE\n  ML P3\nENDIF")
    world.inputs = {"part": not part}
    until(world, lambda: bool(np.linalg.norm(flange(world.commanded[None])[0][0] - at("P1")[0]) < 1e-6))
    world.inputs = {"part": part}
    world.to_end()
    assert_follows(world.places, polygon(*at("P0", "P1", target)), STRAIGHT_M)
    assert [on for on, _ in world.switched_at] == ([True] if part else [])


# 9


@pytest.mark.parametrize(("move", "first_joint_deg"), [("MJ P2", -108.7), ("MJ P2 J1=0", 71.3)])
def test_9_goes_straight_in_joints_to_the_branch_of_the_vectors(move: str, first_joint_deg: float) -> None:
    abc = tuple(float(each) for each in np.radians([0.0, -10.0, -108.7]))
    there = PosePoint((-0.3562732, -1.0525639, 3.1607179), (abc[0], abc[1], abc[2]))
    world = Runs(f"MJ J1=-100\nSET DO laser\n{move}\nRESET DO laser", {"P2": there}, textbook_arm()).to_end()
    (_, first), (_, last) = world.switched_at
    q = world.joints[first : last + 1]
    way = q[-1] - q[0]
    share = (q - q[0]) @ way / (way @ way)
    np.testing.assert_allclose(q, q[0] + share[:, None] * way, atol=1e-9)
    assert np.diff(share).min() >= -1e-12
    assert np.degrees(q[0, 0]) == pytest.approx(-100.0, abs=1e-3)
    assert np.degrees(q[-1, 0]) == pytest.approx(first_joint_deg, abs=0.1)
    np.testing.assert_allclose(flange(q[-1:])[0][0], there.position_m, atol=1e-5)


# 10


def test_10_comes_to_the_origin_of_each_frame() -> None:
    x, y, z = 1000.0 * HOME[:3, 3]
    frames = tuple(placed(name, x - 100, y + dy, z) for name, dy in (("z1", -200.0), ("z2", 0.0), ("z3", 200.0)))
    text = "MJ P0 Z1 F100\nSET DO laser\nMJ P0 Z2\nRESET DO laser\nMJ P0 Z3"
    world = Runs(text, {"P0": PosePoint((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))}, frames=frames).to_end()
    (_, first), (_, second) = world.switched_at
    q, way = home(), list[Numbers]()
    for frame, sample in zip(frames, (first, second, -1), strict=True):
        there = joints_at(np.array(frame.position_m), np.eye(3), world.joints[sample])
        way, q = [*way, joint_line(q, there)], there
    assert_follows(world.places, way, STRAIGHT_M)
    places = world.places[[first, second]]
    np.testing.assert_allclose(places, [each.position_m for each in frames[:2]], atol=0.7e-3)
