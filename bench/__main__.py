"""Prints one line per measurement: its time, and its ratio to a peer library or to the deadline it must keep.

A ratio to a peer is measured in the same run, so that a slow machine does not change it; below 1 is faster.
`python -m bench GROUP [GROUP ...]` measures these alone.
"""

import argparse
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table
from ruckig import InputParameter, Ruckig, Trajectory

from bench.arms import arms
from bench.clearance import clearances
from bench.corrections import corrections
from bench.distances import distances, itself, trajectories
from bench.drives import simulated_drives
from bench.estop import emergency_stop
from bench.gateway import gateways
from bench.governor import governed
from bench.load import load
from bench.makespan import makespan
from bench.nearness import nearness
from bench.random_moves import random_moves
from bench.rest import rests
from bench.shared_room import shared_room
from bench.short_lines import short_lines
from bench.timing import Row, median_s
from bench.view import view
from bench.workspace import workspace
from cell.messages import SetpointBlock
from cell.net.codec import decode, encode
from robot_agent.kinematics import Model, load_model
from robot_agent.paths import Arc, JointMove, Line, Sequence, Spline
from robot_agent.trajectory import Governor, Limits, Motion, plan, s_curve

MODELS = Path(__file__).parents[1] / "cell_configs" / "models"
MODEL, NUMERIC = MODELS / "six_axis.yaml", MODELS / "painter.yaml"
CYCLE_S = 0.004
NOMINAL_S = 0.12
BLOCK_PERIOD_S = 0.02
POSES = 1000
SAMPLES = 500


def profile() -> Row:
    """One jerk-limited profile from rest to rest, planned and sampled, against Ruckig."""
    request = InputParameter(1)
    request.target_position = [1.2]
    request.max_velocity, request.max_acceleration, request.max_jerk = [1.0], [4.0], [40.0]
    peer, trajectory = Ruckig(1), Trajectory(1)
    times = np.linspace(0.0, s_curve(1.2, 1.0, 4.0, 40.0).duration_s, SAMPLES)

    def by_ruckig() -> list[object]:
        peer.calculate(request, trajectory)
        return [trajectory.at_time(t) for t in times]

    own = median_s(lambda: s_curve(1.2, 1.0, 4.0, 40.0).at(times), 100)
    return Row(f"S-curve, {SAMPLES} samples", own, own / median_s(by_ruckig, 100), "of Ruckig from Python")


def motions(model: Model, limits: Limits) -> list[Row]:
    """Planning, and what the agent does every 20 ms: the next segment and its bytes."""
    start = model.home
    target = model.forward(start).copy()
    target[2, 3] -= 0.3
    line = Sequence([Line(target, None, 1)])
    joint = Sequence([JointMove(start + np.radians([40, 10, 10, 0, -10, 20]), 1.0, 1)])
    motion: Motion = plan(model, line, limits, start=start, cycle_s=CYCLE_S)
    governor = Governor(motion, limits, CYCLE_S, NOMINAL_S)
    resting = governor.rest(0.0)
    moving = governor.next(governor.next(resting, 0, [], []), 5, [], [])
    segment = median_s(lambda: governor.next(moving, 5, [], []))
    block = SetpointBlock("left", 1, 1, 0, 1, CYCLE_S, moving.nominal, moving.q, moving.qd)
    codec = median_s(lambda: decode(SetpointBlock, encode(block)), 200)
    line_s = median_s(lambda: plan(model, line, limits, start=start, cycle_s=CYCLE_S))
    joint_s = median_s(lambda: plan(model, joint, limits, start=start, cycle_s=CYCLE_S))
    return [
        Row("plan a line of 300 mm", line_s, line_s / motion.duration_s, "of the motion's duration"),
        Row("plan a joint move", joint_s, joint_s / motion.duration_s, "of the motion's duration"),
        Row("governor: next segment with its ramp", segment, segment / BLOCK_PERIOD_S, "of the 20 ms it has"),
        Row("set-point block to bytes and back", codec, codec / BLOCK_PERIOD_S, "of the 20 ms it has"),
    ]


def mixed(model: Model) -> Sequence:
    """About ten seconds of joint moves, lines, an arc and a spline, most of them joined."""
    start = model.home
    here = model.forward(start)

    def at(*offset_m: float) -> np.ndarray:
        pose = here.copy()
        pose[:3, 3] += offset_m
        return pose

    return Sequence(
        [
            Line(at(0, 0.3, 0), 0.4, 1, round_m=0.05),
            Line(at(0, 0.3, -0.3), 0.4, 2, round_m=0.05),
            Line(at(-0.2, 0, -0.3), 0.4, 3, round_m=0.05),
            Arc(at(-0.1, -0.1, -0.3), at(0, 0, -0.3), 4, speed_m_s=0.4),
            JointMove(start + np.radians([30, 10, 10, 0, -10, 20]), 0.6, 5, round_m=0.05),
            JointMove(start + np.radians([-10, -5, 5, 20, -10, 20]), 0.6, 6),
            Line(here, 0.4, 7),
            Spline(np.array([at(0.1, 0.2, 0.1), at(0, 0.4, -0.1), at(-0.2, 0.2, 0)]), 8, speed_m_s=0.4),
            Line(here, 0.3, 9),
        ]
    )


def mixed_motion(model: Model, limits: Limits) -> list[Row]:
    """Planning ten seconds of mixed moves, and the governor's segments on them."""
    moves = mixed(model)
    motion = plan(model, moves, limits, start=model.home, cycle_s=CYCLE_S)
    per_s = median_s(lambda: plan(model, moves, limits, start=model.home, cycle_s=CYCLE_S), 7) / motion.duration_s
    return [
        Row("plan 10 s of a mixed sequence", 10.0 * per_s, 10.0 * per_s / 0.03, "of 30 ms"),
        *governed(motion, limits),
        *itself(model, motion),
        *workspace(model, motion),
    ]


def _inverse(model: Model, iterating: Model) -> list[Row]:
    """Joints all over the range of the model; only here a peer is needed that the tests do without."""
    from bench.kinematics import kinematics

    lower, upper = model.description.limits.position.T
    return kinematics(model, iterating, np.random.default_rng(1).uniform(lower, upper, (POSES, model.n)))


def groups() -> dict[str, Callable[[], list[Row]]]:
    """By name, in the order of the table."""
    model, iterating = load_model(MODEL), load_model(NUMERIC)
    limits = Limits.of(model.description)
    return {
        "kinematics": lambda: _inverse(model, iterating),
        "distances": distances,
        "trajectories": lambda: trajectories(model),
        "nearness": nearness,
        "clearance": clearances,
        "shared_room": shared_room,
        "makespan": makespan,
        "short_lines": short_lines,
        "profile": lambda: [profile()],
        "motions": lambda: motions(model, limits),
        "mixed_motion": lambda: mixed_motion(model, limits),
        "random_moves": random_moves,
        "corrections": lambda: corrections(model, iterating),
        "estop": emergency_stop,
        "drives": simulated_drives,
        "gateways": gateways,
        "load": load,
        "view": view,
        "arms": arms,
        "rest": rests,
    }


def main() -> int:
    """Measure and print. A group that cannot be measured is told after the others, and the exit code is 1."""
    known = groups()
    parser = argparse.ArgumentParser(prog="python -m bench", description="print the numbers that the project promises")
    parser.add_argument("names", nargs="*", metavar="GROUP", help=f"these alone, of: {', '.join(known)}")
    names = parser.parse_args().names or list(known)
    if unknown := [name for name in names if name not in known]:
        parser.error(f"no group {', '.join(unknown)}; there are: {', '.join(known)}")
    table = Table("what", "median", "ratio", "to")
    failed = []
    for name in names:
        try:
            for row in known[name]():
                table.add_row(*row.cells())
        except Exception as why:  # the other numbers took minutes: they are printed all the same
            failed.append(f"{name}: not measured, {type(why).__name__}: {why}")
    Console().print(table)
    for line in failed:
        print(line, file=sys.stderr)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
