"""Forward and inverse kinematics beside Pinocchio and EAIK."""

import numpy as np
import pinocchio as pin
from eaik.IK_HP import HPRobot

from bench.timing import Row, median_s
from robot_agent.kinematics import Model

SINGLE_POSES = 50
REPEATS = 101
"""Of what takes about a millisecond: a median that a busy machine disturbs less."""
AXES = "ZYYXYX"
KINDS = {"X": pin.JointModelRX, "Y": pin.JointModelRY, "Z": pin.JointModelRZ}
CLIK_ITERATIONS = 200
CLIK_DONE = 1e-9
CLIK_DAMPING = 1e-12


def kinematics(model: Model, numeric: Model, q: np.ndarray) -> list[Row]:
    """The six-axis arm `model` at joints `q` `(m, 6)`, and a robot without a closed form at random joints."""
    count, poses = len(q), model.forward(q)
    peer = pinocchio_model(model)
    own = median_s(lambda: model.forward(q), REPEATS)
    forward = Row(f"forward kinematics, {count} joint sets", own, own / forward_by_pinocchio(peer, q), "of Pinocchio")
    eaik = HPRobot(axes(), np.array([*offsets(model), (0.0, 0.0, 0.0)]))
    batched = median_s(lambda: model.inverse(poses), REPEATS) / count
    batched_eaik = median_s(lambda: eaik.IK_batched(poses), REPEATS) / count
    some = poses[:SINGLE_POSES]
    single = median_s(lambda: [model.inverse(pose) for pose in some], REPEATS) / SINGLE_POSES
    single_eaik = median_s(lambda: [eaik.IK(pose) for pose in some], REPEATS) / SINGLE_POSES
    asked = list(zip(some, q[:SINGLE_POSES], strict=True))
    nearest = median_s(lambda: [model.solve(pose, near=near) for pose, near in asked], REPEATS) / SINGLE_POSES
    clik = median_s(lambda: [clik_by_pinocchio(peer, pose, model.home) for pose in some], 5) / SINGLE_POSES
    lower, upper = numeric.limits.position.T
    reachable = numeric.forward(np.random.default_rng(2).uniform(lower, upper, (count, numeric.n)))
    iterated = median_s(lambda: numeric.inverse(reachable), 3) / count
    return [
        forward,
        Row(f"inverse, all branches, per pose of {count}", batched, batched / batched_eaik, "of EAIK, batched"),
        Row("inverse, all branches, one pose", single, single / single_eaik, "of EAIK, one pose"),
        Row("solve: the nearest branch, one pose", nearest, nearest / clik, "of one numeric solution by Pinocchio"),
        Row(f"numeric inverse, 8 starts, per pose of {count}", iterated, iterated / clik, "of one by Pinocchio"),
    ]


def offsets(model: Model) -> list[tuple[float, float, float]]:
    """From each joint of a six-axis arm to the next."""
    g = model.description.geometry
    return [
        (0.0, 0.0, g["a1z"]),
        (g["a2x"], 0.0, g["a2z"]),
        (0.0, 0.0, g["a3z"]),
        (g["a4x"], 0.0, g["a4z"]),
        (g["a5x"], 0.0, 0.0),
        (g["a6x"], 0.0, 0.0),
    ]


def axes() -> np.ndarray:
    """`(6, 3)` axes at joints zero."""
    return np.array([np.eye(3)["XYZ".index(axis)] for axis in AXES])


def pinocchio_model(model: Model) -> pin.Model:
    """The same arm for Pinocchio."""
    peer, parent = pin.Model(), 0
    for number, (axis, offset) in enumerate(zip(AXES, offsets(model), strict=True), 1):
        parent = peer.addJoint(parent, KINDS[axis](), pin.SE3(np.eye(3), np.array(offset)), f"J{number}")
    return peer


def forward_by_pinocchio(peer: pin.Model, q: np.ndarray) -> float:
    data = peer.createData()

    def work() -> list[np.ndarray]:
        out = []
        for joints in q:
            pin.forwardKinematics(peer, data, joints)
            out.append(data.oMi[peer.njoints - 1].homogeneous)
        return out

    return median_s(work)


def clik_by_pinocchio(peer: pin.Model, pose: np.ndarray, start: np.ndarray) -> np.ndarray:
    """One solution by Pinocchio's example of closed-loop inverse kinematics: damped steps, without joint limits."""
    data, q, target = peer.createData(), start.copy(), pin.SE3(pose)
    last = peer.njoints - 1
    for _ in range(CLIK_ITERATIONS):
        pin.forwardKinematics(peer, data, q)
        error_pose = data.oMi[last].actInv(target)
        error = pin.log6(error_pose).vector
        if np.linalg.norm(error) < CLIK_DONE:
            break
        jacobian = -pin.Jlog6(error_pose.inverse()) @ pin.computeJointJacobian(peer, data, q, last)
        step = -jacobian.T @ np.linalg.solve(jacobian @ jacobian.T + CLIK_DAMPING * np.eye(6), error)
        q = q + step
    return q
