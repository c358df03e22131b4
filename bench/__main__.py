"""Prints one line per measurement: its time, and its ratio to a peer library or to the deadline it must keep.

A ratio to a peer is measured in the same run, so that a slow machine does not change it; below 1 is faster.
"""

import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pinocchio as pin
from rich.console import Console
from rich.table import Table
from ruckig import InputParameter, Ruckig, Trajectory

from bench.drives import simulated_drives
from cell.messages import SetpointBlock
from cell.net.codec import decode, encode
from robot_agent.kinematics import Model, load_model
from robot_agent.paths import JointMove, Line, Sequence
from robot_agent.trajectory import Governor, Limits, Motion, plan, s_curve

MODEL = Path(__file__).parents[1] / "cell_configs" / "models" / "six_axis.yaml"
CYCLE_S = 0.004
NOMINAL_S = 0.12
BLOCK_PERIOD_S = 0.02
POSES = 1000
SAMPLES = 500


def median_s(work: Callable[[], object], repeats: int = 15) -> float:
    """Median time of one call [s], after one call that does not count."""
    work()
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        work()
        times.append(time.perf_counter() - start)
    return float(np.median(times))


def pinocchio_model(model: Model) -> pin.Model:
    """The same arm for Pinocchio."""
    g = model.description.geometry
    chain = [
        (pin.JointModelRZ, (0, 0, g["a1z"])),
        (pin.JointModelRY, (g["a2x"], 0, g["a2z"])),
        (pin.JointModelRY, (0, 0, g["a3z"])),
        (pin.JointModelRX, (g["a4x"], 0, g["a4z"])),
        (pin.JointModelRY, (g["a5x"], 0, 0)),
        (pin.JointModelRX, (g["a6x"], 0, 0)),
    ]
    peer, parent = pin.Model(), 0
    for number, (kind, offset) in enumerate(chain, 1):
        parent = peer.addJoint(parent, kind(), pin.SE3(np.eye(3), np.array(offset, dtype=float)), f"J{number}")
    return peer


def kinematics(model: Model, q: np.ndarray) -> list[tuple[str, float, float, str]]:
    """All links of many joint sets against Pinocchio, and all branches of the inverse."""
    peer = pinocchio_model(model)
    data = peer.createData()

    def by_pinocchio() -> list[np.ndarray]:
        out = []
        for joints in q:
            pin.forwardKinematics(peer, data, joints)
            out.append(data.oMi[6].homogeneous)
        return out

    own, theirs = median_s(lambda: model.forward(q)), median_s(by_pinocchio)
    poses = model.forward(q)
    inverse = median_s(lambda: model.inverse(poses))
    return [
        (f"forward kinematics, {POSES} joint sets", own, own / theirs, "of Pinocchio from Python"),
        (f"inverse kinematics, all branches, {POSES} poses", inverse, inverse / POSES / CYCLE_S, "of a cycle per pose"),
    ]


def profile() -> tuple[str, float, float, str]:
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
    return f"S-curve, {SAMPLES} samples", own, own / median_s(by_ruckig, 100), "of Ruckig from Python"


def motions(model: Model, limits: Limits) -> list[tuple[str, float, float, str]]:
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
        ("plan a line of 300 mm", line_s, line_s / motion.duration_s, "of the motion's duration"),
        ("plan a joint move", joint_s, joint_s / motion.duration_s, "of the motion's duration"),
        ("governor: next segment with its ramp", segment, segment / BLOCK_PERIOD_S, "of the 20 ms it has"),
        ("set-point block to bytes and back", codec, codec / BLOCK_PERIOD_S, "of the 20 ms it has"),
    ]


def main() -> None:
    """Measure and print."""
    model = load_model(MODEL)
    lower, upper = model.description.limits.position.T
    q = np.random.default_rng(1).uniform(lower, upper, (POSES, model.n))
    table = Table("what", "median", "ratio", "to")
    measured = [*kinematics(model, q), profile(), *motions(model, Limits.of(model.description)), *simulated_drives()]
    for what, seconds, ratio, to in measured:
        table.add_row(what, f"{1e3 * seconds:.3f} ms", f"{ratio:.3g}", to)
    Console().print(table)


if __name__ == "__main__":
    main()
