"""Sections against an oracle of its own: the motion each millisecond, and quick stops from anywhere along it."""

import os
import subprocess
import sys
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cell.geometry import transform_points
from cell.messages.sections import Sections
from robot_agent.agent.planning.planner import Planner
from robot_agent.agent.planning.plans import Extended, ExtendRequest, Planned, PlanRequest
from robot_agent.kinematics import load_model, model_of
from robot_agent.language import Interpreter, MotionStep, Names, parse_program
from robot_agent.paths import JointMove, Line, Sequence
from robot_agent.trajectory import Limits, Motion, plan
from robot_agent.workspace import Braking, PlacedRobot, sweep
from robot_agent.workspace.sections import BACKING_RATE, FOLLOWING_M, MotionSections, cut, extended, standing
from tests.unit.random_moves import sequence
from tests.unit.repository import ROOT
from tests.unit.six_axis_paths import BASE, joint_path

CYCLE_S = 0.004
MODELS = {path.stem: load_model(path) for path in sorted((ROOT / "cell_configs" / "models").glob("*.yaml"))}
ARM = MODELS["six_axis"]
SHORT_RODS = model_of(
    replace(MODELS["delta"].description, geometry=dict(MODELS["delta"].description.geometry) | {"k": 0.35})
)
"""A delta that cannot be at all joints."""
START = ARM.home + np.radians([0, 0, 0, 20, -25, 0])
SEEDS = 3
ROUNDING_M = 1e-9
ZIGZAG = """ML X=1000 Y=-200 Z=1300 A=0 B=90 C=0 R=30 F=9999
ML Y=200 R=30
ML X=1100 Z=1500 R=30
ML Y=-200 R=30
ML X=1000 Z=1300 R=30
"""


def placed(name: str) -> PlacedRobot:
    return replace(PlacedRobot.at(MODELS[name]), pose_world_base=BASE)


def braking(name: str, harder: float = 1.0) -> Braking:
    """As it is told of drives whose quick stop is `harder` than the ramps are."""
    model, limits = MODELS[name], Limits.of(MODELS[name].description)
    ramp = Braking.of(model, limits, CYCLE_S).acceleration
    return Braking.of(model, limits, CYCLE_S, tuple((harder * ramp).tolist()))


def sampled(motion: Motion) -> tuple:
    """What `cut` takes of a motion."""
    taus = motion.grid
    q = motion.q(taus)
    return sweep(motion.model, BASE, q), taus, q, motion.qd(taus)


@cache
def motion_of(name: str, seed: int) -> Motion:
    """A joint move at full speed; of the arm also moves of all kinds."""
    model = MODELS[name]
    limits = Limits.of(model.description)
    if name == "six_axis" and seed:
        return plan(model, sequence(seed, 6), limits, start=START, cycle_s=CYCLE_S)
    way = 0.3 * np.ptp(model.limits.position, axis=1).clip(max=3.0)
    if name == "delta":
        way = way * [1.0, -0.4, 0.2, 1.0]
    sense = np.array([(1, 1, 1), (1, -1, 1)][seed % 2] * 2)[: model.n]
    target = np.clip(model.home + sense * way, *model.limits.position.T)
    moves = [JointMove(target, 1.0, 1), JointMove(model.home, 1.0, 2)]
    return plan(model, Sequence(moves), limits, start=model.home, cycle_s=CYCLE_S)


@cache
def cut_motion(name: str, seed: int, harder: float = 1.0) -> MotionSections:
    return cut(braking(name, harder), *sampled(motion_of(name, seed)))


def rest_along(motion: Motion, drives: Braking, tau: float, rate: float) -> float:
    """The tau before which no axis can have braked along the path: none has gone what it needs or turned round."""
    taus = np.arange(tau, motion.duration_s, 0.0005)
    if len(taus) == 0:
        return tau
    axes = drives.model.coupling.axes(motion.q(taus))
    speeds = drives.model.coupling.axes(motion.qd(taus))
    needed, sense = (rate * speeds[0]) ** 2 / (2.0 * drives.acceleration), np.sign(speeds[0])
    done = ((axes - axes[0]) * sense >= needed) | (speeds * sense <= 0.0)
    resting = np.logical_or.accumulate(done).all(axis=1)
    return float(taus[resting.argmax()]) if resting.any() else motion.duration_s


def stopping(motion: Motion, drives: Braking, tau: float, rate: float) -> np.ndarray:
    """The capsules `(30, c, 2, 3)` of a robot each axis of which brakes by itself from `tau` to rest."""
    coupling = drives.model.coupling
    speed = rate * coupling.axes(motion.qd(np.array(tau)))
    braking_s = np.abs(speed) / drives.quick_stop
    at_s = np.minimum(np.linspace(0.0, braking_s.max(), 30)[:, None], braking_s)
    way = speed * at_s - np.sign(speed) * drives.quick_stop * at_s**2 / 2.0
    return transform_points(BASE, drives.model.capsules(motion.q(np.array(tau)) + coupling.joints(way)))


def tight(sections: Sections) -> Sections:
    """Without what is there for following behind, less a little for rounding."""
    return replace(sections, radii=sections.radii.astype(float) - FOLLOWING_M + ROUNDING_M)


def each_within_one(points: np.ndarray, radii: np.ndarray, sections: Sections) -> bool:
    away = np.linalg.norm(points[:, None] - sections.points.astype(float), axis=-1).max(axis=-1)
    return bool((away + radii <= sections.radii).all(axis=-1).any(axis=1).all())


def stop_is_covered(motion: Motion, found: MotionSections, drives: Braking, tau: float, rate: float) -> bool:
    first, last = found.span(tau, rest_along(motion, drives, tau, rate))
    points = stopping(motion, drives, tau, rate)
    return each_within_one(points, drives.model.capsule_radii, tight(found.sections[first : last + 1]))


def covers_the_motion(motion: Motion, found: MotionSections) -> None:
    """Whether each section covers the robot all along, and none is missing."""
    taus = np.arange(0.0, motion.duration_s, 0.001)
    points = transform_points(BASE, motion.model.capsules(motion.q(taus)))
    for index, (begin, end) in enumerate(zip(found.taus, found.taus[1:], strict=False)):
        here = (taus >= begin) & (taus <= end)
        assert each_within_one(points[here], motion.model.capsule_radii, tight(found.sections[index : index + 1]))
    assert len(found.taus) == len(found.sections) + 1 == len(found.stray) + 1
    assert (found.taus[0], found.taus[-1]) == (0.0, motion.duration_s)
    assert (np.diff(found.taus) > 0.0).all()
    assert (found.sections.ids != 0).all()


@pytest.mark.parametrize("name", MODELS)
@pytest.mark.parametrize("seed", range(SEEDS))
def test_a_robot_is_in_its_section_wherever_it_is_on_its_way(name: str, seed: int) -> None:
    covers_the_motion(motion_of(name, seed), cut_motion(name, seed))


@pytest.mark.parametrize("name", MODELS)
@given(seed=st.integers(0, SEEDS - 1), share=st.floats(0.0, 1.0), rate=st.sampled_from([0.3, 0.7, 1.0]))
@settings(max_examples=40, deadline=None)
def test_a_quick_stop_stays_in_the_sections_up_to_where_a_ramp_along_the_path_may_end(
    name: str, seed: int, share: float, rate: float
) -> None:
    motion = motion_of(name, seed)
    assert stop_is_covered(motion, cut_motion(name, seed), braking(name), share * motion.duration_s, rate)


@pytest.mark.parametrize("name", MODELS)
@given(
    seed=st.integers(0, SEEDS - 1),
    share=st.floats(0.0, 1.0),
    rate=st.sampled_from([0.3, 0.7, 1.0]),
    harder=st.sampled_from([1.0, 1.2, 1.5, 2.0, 3.0]),
)
@settings(max_examples=40, deadline=None)
def test_a_quick_stop_of_drives_that_brake_as_told_or_all_of_them_so_many_times_harder_stays_in_the_sections(
    name: str, seed: int, share: float, rate: float, harder: float
) -> None:
    motion, found, drives = motion_of(name, seed), cut_motion(name, seed, 1.5), braking(name, 1.5 * harder)
    assert stop_is_covered(motion, found, drives, share * motion.duration_s, rate)


@pytest.mark.parametrize("name", MODELS)
def test_the_harder_drives_are_told_to_brake_the_less_sections_grow_for_quick_stops(name: str) -> None:
    as_ramps, half_more, twice = (cut_motion(name, 0, harder).stray.max() for harder in (1.0, 1.5, 2.0))
    assert twice < 0.8 * half_more < 0.8 * 0.8 * as_ramps


@pytest.mark.parametrize("name", MODELS)
@given(seed=st.integers(0, SEEDS - 1), share=st.floats(0.0, 1.0), harder=st.sampled_from([1.0, 1.5]))
@settings(max_examples=40, deadline=None)
def test_a_quick_stop_on_the_way_back_at_the_rate_for_that_stays_in_the_sections_behind(
    name: str, seed: int, share: float, harder: float
) -> None:
    motion, found, drives = motion_of(name, seed), cut_motion(name, seed, harder), braking(name, harder)
    tau = share * motion.duration_s
    points = stopping(motion, drives, tau, -BACKING_RATE)
    assert each_within_one(points, drives.model.capsule_radii, tight(found.sections[: found.index(tau) + 1]))


@given(seed=st.integers(0, 10_000))
@settings(max_examples=30, deadline=None)
def test_what_is_between_two_samples_that_are_far_apart_is_in_their_section(seed: int) -> None:
    """Also where the robot turns round between them. Without speeds nothing is there for quick stops."""
    taus, fine = 0.02 * np.arange(61), 0.002 * np.arange(601)
    q = joint_path(seed, taus)
    found = cut(braking("six_axis"), sweep(ARM, BASE, q), taus, q, np.zeros_like(q))
    points = transform_points(BASE, ARM.capsules(joint_path(seed, fine)))
    for tau, pose in zip(fine, points, strict=True):
        index = found.index(float(tau))
        assert each_within_one(pose[None], ARM.capsule_radii, tight(found.sections[index : index + 1]))


def test_a_section_is_10_ms_or_what_10_mm_take() -> None:
    motion, found = motion_of("six_axis", 0), cut_motion("six_axis", 0)
    taus = np.linspace(0.0, motion.duration_s, 20001)
    points = transform_points(BASE, ARM.capsules(motion.q(taus)))
    way = np.append(0.0, np.linalg.norm(np.diff(points, axis=0), axis=-1).max(axis=(1, 2)).cumsum())
    lasting, length = np.diff(found.taus), np.diff(np.interp(found.taus, taus, way))
    assert ((lasting <= 0.010 + 1e-9) | (length <= 0.010 + 1e-4)).all()
    again = found.taus[2:] - found.taus[:-2]
    assert (again > 0.010).all()


def test_a_link_that_stands_grows_by_what_it_may_follow_behind_and_a_fast_one_by_its_way_and_stray_besides() -> None:
    found = cut_motion("six_axis", 0)
    growth = found.sections.radii - ARM.capsule_radii
    assert (growth[:, 0] < FOLLOWING_M + 0.001).all()
    assert (growth >= FOLLOWING_M + found.stray).all()
    assert (growth <= FOLLOWING_M + found.stray + 0.02).all()
    assert 0.05 < found.stray.max() < 0.2


def test_slow_motion_hardly_strays() -> None:
    pose = ARM.forward(START)
    pose[1, 3] += 0.2
    line = plan(ARM, Sequence([Line(pose, 0.1, 1)]), Limits.of(ARM.description), start=START, cycle_s=CYCLE_S)
    found = cut(braking("six_axis"), *sampled(line))
    assert found.stray.max() < 0.002
    assert len(found.sections) < 60


def test_ten_minutes_of_slow_motion_are_few_sections() -> None:
    pose = ARM.forward(START)
    pose[1, 3] += 0.3
    line = plan(ARM, Sequence([Line(pose, 0.0005, 1)]), Limits.of(ARM.description), start=START, cycle_s=CYCLE_S)
    found = cut(braking("six_axis"), *sampled(line))
    assert line.duration_s > 600.0
    assert len(found.sections) < 60
    assert (found.taus[0], found.taus[-1]) == (0.0, line.duration_s)


def test_a_robot_that_stands_has_one_section_which_is_that_of_standing() -> None:
    planner = Planner(placed("six_axis"), CYCLE_S)
    rest = planner.standstill(START, ())
    q = rest.motion.q(rest.taus)
    found = cut(braking("six_axis"), rest.sweep, rest.taus, q, rest.motion.qd(rest.taus))
    here = standing(ARM, BASE, START)
    assert len(found.sections) == 1
    assert found.sections.ids == here.ids
    assert found.index(0.0) == found.index(5.0) == 0
    assert found.span(0.0, 0.0) == (0, 0)


def test_one_sample_is_one_section() -> None:
    q = START[None]
    found = cut(braking("six_axis"), sweep(ARM, BASE, q), np.zeros(1), q, np.zeros((1, 6)))
    assert found.sections.ids == standing(ARM, BASE, START).ids


@given(q=st.lists(st.floats(-2.0, 2.0), min_size=6, max_size=6), reserve_m=st.sampled_from([0.0, 0.005]))
@settings(max_examples=30, deadline=None)
def test_a_standing_robot_is_within_its_section_as_far_as_it_may_follow_and_no_farther(
    q: list[float], reserve_m: float
) -> None:
    here, radii = standing(ARM, BASE, np.array(q), reserve_m), ARM.capsule_radii
    points = transform_points(BASE, ARM.capsules(np.array(q)))
    aside = np.array([0.6, 0.0, 0.8]) * (FOLLOWING_M + reserve_m)
    assert each_within_one(points[None] + aside, radii, here)
    assert not each_within_one(np.stack([points, points + 1.001 * aside]), radii, here)


def test_a_delta_whose_rods_do_not_meet_may_be_anywhere_in_its_reach() -> None:
    here = standing(SHORT_RODS, BASE, np.radians([50.0, -50.0, -50.0, 0.0]))
    assert here.radii.min() >= SHORT_RODS.reach_m
    assert (here.points == BASE[:3, 3].astype(np.float32)).all()


def test_a_quick_stop_that_no_mechanism_can_follow_takes_the_reach_where_it_begins() -> None:
    taus, speed = CYCLE_S * np.arange(10), np.radians([-600.0, 600.0, 600.0, 0.0])
    q = np.radians([84.0, -84.0, -84.0, 0.0]) + taus[:, None] * speed
    drives = Braking.of(SHORT_RODS, Limits.of(SHORT_RODS.description), CYCLE_S)
    slow, fast = (
        cut(drives, sweep(SHORT_RODS, BASE, q), taus, q, np.tile(qd, (10, 1))) for qd in (0.05 * speed, speed)
    )
    assert slow.sections.radii.max() < 0.5
    assert fast.sections.radii[-1].min() >= 2.0 * SHORT_RODS.reach_m


def test_a_border_belongs_to_the_earlier_section_and_a_span_takes_no_more_than_it_needs() -> None:
    found = cut_motion("six_axis", 0)
    border = float(found.taus[3])
    assert [found.index(tau) for tau in (border - 1e-6, border, border + 5e-10, border + 1e-6)] == [2, 2, 2, 3]
    assert found.span(border, found.taus[5]) == (3, 4)
    assert found.span(border - 5e-10, found.taus[5] + 5e-10) == (3, 4)
    assert found.span(border, border) == (2, 2)
    assert found.span(border - 1e-6, border + 1e-6) == (2, 3)
    last = len(found.sections) - 1
    assert found.span(-1.0, 1e6) == (0, last)


def test_equal_space_has_an_equal_id_in_another_process_too() -> None:
    program = (
        "import numpy as np; from pathlib import Path; from robot_agent.kinematics import load_model;"
        "from robot_agent.workspace.sections import standing;"
        f"arm = load_model(Path({str(ROOT / 'cell_configs' / 'models' / 'six_axis.yaml')!r}));"
        "print(*standing(arm, np.eye(4), arm.home).ids)"
    )
    environment = os.environ | {"PYTHONPATH": str(ROOT), "PYTHONHASHSEED": "7"}
    said = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, env=environment, timeout=60, check=True
    ).stdout
    assert int(said) == int(standing(ARM, np.eye(4), ARM.home).ids[0])


def test_other_space_has_another_id() -> None:
    here, wider = standing(ARM, BASE, ARM.home), standing(ARM, BASE, ARM.home, 1e-6)
    there = standing(ARM, BASE, ARM.home + 1e-6)
    assert len({int(each.ids[0]) for each in (here, wider, there)}) == 3
    assert here.ids.dtype == np.uint64


def steps(program: str) -> tuple[MotionStep, ...]:
    interpreter = Interpreter(parse_program(program + "END", "way.prog", Names(ARM.joint_names)))
    found = []
    while isinstance(step := interpreter.next(), MotionStep):
        found.append(step)
    return tuple(found)


@cache
def extension(splice_share: float, behind_s: float) -> tuple[Planned, Extended]:
    """A motion at full speed around a rectangle, and what goes on from it elsewhere."""
    planner = Planner(placed("six_axis"), CYCLE_S)
    start = ARM.solve(ARM.forward(START))
    old = planner.plan(PlanRequest(1, steps(ZIGZAG), start, ()))
    assert isinstance(old, Planned)
    splice = splice_share * old.motion.duration_s
    onward = steps(ZIGZAG + "ML X=1250 Y=100 R=30 F=9999\nML Y=-300 Z=1400 R=30\n")[-2:]
    asked = ExtendRequest(
        2, onward, old.motion, old.lines, old.switches, splice, max(splice - behind_s, 0.0), 0.0, ()
    )  # fmt: skip
    new = planner.plan(asked)
    assert isinstance(new, Extended), new
    return old, new


SPLICES = [(0.5, 10.0), (0.9, 0.5), (0.97, 0.2), (0.95, 3.0)]


@pytest.mark.parametrize(("share", "behind_s"), SPLICES)
def test_a_motion_that_is_extended_keeps_the_sections_in_front_of_the_splice(share: float, behind_s: float) -> None:
    old, new = extension(share, behind_s)
    before = cut(braking("six_axis"), *sampled(old.motion))
    after = extended(before, new.cut_s, new.splice_s, braking("six_axis"), *sampled(new.motion))
    covers_the_motion(new.motion, after)
    shifted = before.taus - new.cut_s
    kept = (shifted[1:] > 1e-9) & (shifted[:-1] < new.splice_s - 1e-9)
    count = int(kept.sum())
    assert np.array_equal(after.sections.ids[:count], before.sections.ids[kept])
    assert not set(after.sections.ids[count:].tolist()) & set(before.sections.ids.tolist())
    assert after.taus[1:count] == pytest.approx(shifted[1:][kept][:-1], abs=1e-12)
    assert after.taus[count] == new.splice_s


@pytest.mark.parametrize("roomless", [False, True])
@pytest.mark.parametrize(("share", "behind_s"), SPLICES)
def test_quick_stops_that_begin_before_the_splice_and_end_beyond_it_stay_in_the_sections(
    share: float, behind_s: float, roomless: bool
) -> None:
    """Also where the sections that are kept have no room for them: the next one takes them."""
    old, new = extension(share, behind_s)
    drives = braking("six_axis")
    before = cut(drives, *sampled(old.motion))
    if roomless:
        bare = replace(before.sections, radii=(before.sections.radii - before.stray).astype(np.float32))
        before = replace(before, sections=bare, stray=np.zeros_like(before.stray))
    after = extended(before, new.cut_s, new.splice_s, drives, *sampled(new.motion))
    taus = np.linspace(max(new.splice_s - 0.4, 0.0), new.splice_s + 0.1, 41)
    looked_at = 0
    for tau in taus:
        for rate in (0.3, 0.7, 1.0):
            if not roomless or rest_along(new.motion, drives, tau, rate) > new.splice_s + CYCLE_S:
                assert stop_is_covered(new.motion, after, drives, float(tau), rate), (tau, rate)
                looked_at += 1
    assert looked_at > 20
