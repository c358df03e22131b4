"""The example cell does what it shows: both programs can be planned, meet in the zone, and else keep away from it."""

from dataclasses import dataclass

import numpy as np
import pytest

from cell.commands.checks import check_cell
from cell.geometry import Box, capsule_box_distance, transform_points
from cell.messages import ZoneGeometry
from robot_agent.agent.planning.planner import Planner
from robot_agent.agent.planning.plans import Planned, PlanRequest
from robot_agent.kinematics import Model
from robot_agent.language import Finished, Interpreter, JointStep, LineStep, Names, Pause, parse_program
from robot_agent.workspace import PlacedRobot
from tests.unit.config_world import TWO_ARMS

ROBOTS = ("left", "right")
REST_DISTANCE_M = 0.1
SAMPLE_S = 0.02


@dataclass(frozen=True)
class Rehearsal:
    """One robot's program, planned to its end: joints every 20 ms `(m, 6)`, and what follows from them `(m,)`."""

    model: Model
    q: np.ndarray
    duration_s: float
    zone_distance_m: np.ndarray
    """Of the body from the zone; negative inside."""
    forward_m: np.ndarray
    """How far the body comes forward, along the base's X."""


@pytest.fixture(scope="module", params=ROBOTS)
def rehearsal(request: pytest.FixtureRequest) -> Rehearsal:
    bundle, _ = check_cell(TWO_ARMS)
    assert bundle is not None
    placed = bundle.robots[request.param]
    model = placed.model
    q, duration_s = _play(placed, bundle.cell.robots[request.param].program.read_text())
    zone = bundle.cell.zones["handover"]
    box = Box.at(zone.size_m, zone.pose.position_m, zone.pose.quaternion_xyzw)
    body = model.capsules(q)
    in_world = transform_points(placed.pose_world_base, body)
    distance = capsule_box_distance(in_world, model.capsule_radii, box).min(axis=-1)
    forward = (body[..., 0].max(axis=-1) + model.capsule_radii).max(axis=-1)
    return Rehearsal(model, q, duration_s, distance, forward)


def _play(placed: PlacedRobot, text: str) -> tuple[np.ndarray, float]:
    """Joints along the whole program, from home, and its duration without waiting for anyone."""
    planner, model = Planner(placed, cycle_s=0.004), placed.model
    interpreter = Interpreter(parse_program(text, "program", Names(model.joint_names)))
    no_zones: tuple[ZoneGeometry, ...] = ()
    samples, at, duration_s = [model.home[None]], model.home, 0.0
    while not isinstance(step := interpreter.next(), Finished):
        if isinstance(step, Pause):
            duration_s += step.duration_s
            continue
        assert isinstance(step, JointStep | LineStep)
        planned = planner.plan(PlanRequest(0, (step,), at, no_zones))
        assert isinstance(planned, Planned), planned
        motion = planned.motion
        samples.append(motion.q(np.append(np.arange(0, motion.duration_s, SAMPLE_S), motion.duration_s)))
        at = samples[-1][-1]
        duration_s += motion.duration_s
    return np.concatenate(samples), duration_s


def test_a_program_takes_10_to_14_seconds(rehearsal: Rehearsal) -> None:
    assert 10 < rehearsal.duration_s < 14


def test_it_visits_the_zone_twice(rehearsal: Rehearsal) -> None:
    inside = rehearsal.zone_distance_m < 0
    assert np.count_nonzero(np.diff(inside.astype(int)) == 1) == 2


def test_it_starts_and_ends_at_home_well_outside_the_zone(rehearsal: Rehearsal) -> None:
    assert rehearsal.q[-1] == pytest.approx(rehearsal.model.home)
    assert rehearsal.zone_distance_m[[0, -1]].min() > REST_DISTANCE_M


def test_simulated_drives_start_at_home() -> None:
    bundle, _ = check_cell(TWO_ARMS)
    assert bundle is not None
    for name, placed in bundle.robots.items():
        gateway = bundle.cell.robots[name].gateway
        axes = bundle.gateways[gateway].robots[name].axes
        starts = [bundle.simulations[gateway].start(name, axis) for axis in axes]
        assert starts == pytest.approx(placed.model.home)


def test_outside_the_zone_each_arm_stays_on_its_own_side(rehearsal: Rehearsal) -> None:
    outside = rehearsal.zone_distance_m > 0
    assert rehearsal.forward_m[outside].max() < 1.35
    assert rehearsal.forward_m.max() < 2.25


def test_the_wrist_stays_away_from_its_singularity(rehearsal: Rehearsal) -> None:
    assert np.degrees(rehearsal.q[:, 4]).min() > 20
