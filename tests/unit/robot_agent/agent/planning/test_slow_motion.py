"""The slowest motions that the language allows: what they take grows with their way, not with their time."""

import pickle
import tracemalloc
from dataclasses import replace

import numpy as np
import pytest

from cell.messages import ZoneGeometry
from robot_agent.agent.planning.planner import Planner
from robot_agent.agent.planning.plans import Planned, PlanRequest
from robot_agent.language import Interpreter, MotionStep, Names, parse_program
from robot_agent.model.description import ProfileKind, Shaping
from robot_agent.trajectory import Limits
from robot_agent.trajectory.governor.rate_bounds import RateBounds
from robot_agent.trajectory.governor.speed_cap import SpeedCap
from robot_agent.trajectory.governor.travel import Travel
from robot_agent.workspace import PlacedRobot, Spaces, Things
from tests.unit.six_axis_arm import arm

ARM = arm()
LIMITS = Limits.of(ARM.description)
CYCLE_S = 0.004
START = np.radians([0.0, -20.0, 30.0, 0.0, 60.0, 0.0])
MOST_BYTES = 200_000_000
SLOWEST = {
    "joint move": "MJ J1=170 F=0.01",
    "each joint by itself": "MJ J1=170 J4=40 F=0.01 SYNC=0",
    "line": "ML X=500 FC=0.1",
    "turn on the spot": "ML A=180 B=-20 C=0 FA=0.01 F=9999",
    "arc": "MC QY=300 QZ=1800 Y=0 Z=1600 H=360 F=0.1",
    "spline": "MS Y=300 F=0.1\nMS Y=600 Z=1800 F=0.1\nMS Y=300 Z=1600 F=0.1",
    "one slow move among fast ones": "ML Y=300 R=5 F=9999\nML Z=1800 R=5 F=0.1\nML Y=0 R=5\nML Z=1500",
}


def planned(program: str, limits: Limits = LIMITS, zones: tuple[ZoneGeometry, ...] = ()) -> Planned:
    interpreter = Interpreter(parse_program(program, "slow.prog", Names(ARM.joint_names)))
    steps = []
    while isinstance(step := interpreter.next(), MotionStep):
        steps.append(step)
    result = Planner(PlacedRobot(ARM, limits, np.eye(4), Things(ARM), Spaces(ARM)), CYCLE_S).plan(
        PlanRequest(1, tuple(steps), START, zones)
    )
    assert isinstance(result, Planned), result.text
    return result


@pytest.mark.parametrize("program", SLOWEST.values(), ids=SLOWEST.keys())
def test_slowest_motion_takes_little_memory_and_little_to_send(program: str) -> None:
    tracemalloc.start()
    result = planned(program)
    _, most = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert result.motion.duration_s > 900.0
    assert most < MOST_BYTES
    assert len(pickle.dumps(result)) < 16_000_000


@pytest.mark.parametrize(
    ("program", "kind"),
    [
        pytest.param(program, kind, marks=[] if (number + other) % 5 == 0 else [pytest.mark.soak])
        for number, kind in enumerate(ProfileKind)
        for other, program in enumerate(
            ["MJ J1=170 F=0.01", "MJ J1=170 J4=40 F=0.01 SYNC=0", "ML X=500 FC=0.1"],
        )
    ],
)
def test_slowest_motion_of_every_profile_with_a_filter_takes_little_memory(program: str, kind: ProfileKind) -> None:
    tracemalloc.start()
    result = planned(program, replace(LIMITS, shaping=Shaping(kind, filter_s=0.02)))
    _, most = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert result.motion.duration_s > 900.0
    assert most < MOST_BYTES
    assert len(pickle.dumps(result)) < 20_000_000


def test_slow_motion_has_no_more_samples_than_its_way_needs() -> None:
    slow, slower, slowest = (planned(f"MJ J1=120 F={percent}") for percent in (1, 0.1, 0.01))
    assert len(slowest.taus) < 1.01 * len(slower.taus) < 1.1 * len(slow.taus)


@pytest.mark.parametrize("program", SLOWEST.values(), ids=SLOWEST.keys())
def test_slow_motion_stays_between_its_samples_where_its_body_is(program: str) -> None:
    result = planned(program)
    taus, body = result.taus, result.sweep
    assert body.chords.max() < 0.01
    shares = np.linspace(0.0, 1.0, 7)[1:-1]
    between = ARM.capsules(result.motion.q(taus[:-1, None] + np.diff(taus)[:, None] * shares))
    first, chord = body.points[:-1, None], np.diff(body.points, axis=0)[:, None]
    along = ((between - first) * chord).sum(axis=-1) / np.maximum((chord**2).sum(axis=-1), 1e-18)
    nearest = first + np.clip(along, 0.0, 1.0)[..., None] * chord
    away = np.linalg.norm(between - nearest, axis=-1).max(axis=(1, 2, 3))
    assert (away <= body.bulge + 1e-9).all()


def test_what_is_remembered_along_a_slow_motion_does_not_grow_with_time() -> None:
    motion = planned("ML X=500 FC=0.1").motion
    travel = Travel.of(motion, forwards=True)
    bounds, cap = RateBounds(travel, LIMITS), SpeedCap(travel, 0.25)
    tracemalloc.start()
    used = []
    for tau in np.arange(0.0, 200.0, 0.25):
        bounds.row(float(tau))
        cap.rate(float(tau), 1.0)
        used.append(tracemalloc.get_traced_memory()[0])
    tracemalloc.stop()
    assert max(used[400:]) < 1.1 * max(used[:400]) < 50_000_000
    assert bounds.row(3.0) == RateBounds(travel, LIMITS).row(3.0)
    assert cap.rate(3.0, 1.0) == SpeedCap(travel, 0.25).rate(3.0, 1.0)
