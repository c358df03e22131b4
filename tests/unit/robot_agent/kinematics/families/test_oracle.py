"""Every serial family against a Pinocchio model that is built from its table, joint by joint."""

import numpy as np
import pinocchio as pin
import pytest

from tests.unit.robot_families import VECTORS, random_joints, robot


def lengths(family: str) -> dict[str, float]:
    return {name: value / 1000 for name, value in VECTORS[family]["model"].items()}


def chain(*joints: tuple[object, tuple[float, float, float] | pin.SE3]) -> pin.Model:
    model, parent = pin.Model(), 0
    for i, (kind, offset) in enumerate(joints):
        placement = offset if isinstance(offset, pin.SE3) else pin.SE3(np.eye(3), np.array(offset, dtype=float))
        parent = model.addJoint(parent, kind(), placement, f"j{i}")  # type: ignore[operator]
    return model


def cobot() -> tuple[pin.Model, np.ndarray]:
    g = lengths("cobot")
    y, z = pin.JointModelRY, pin.JointModelRZ
    offsets = [(0, 0, 0), (0, g["a1y"], g["a1z"]), (g["a2x"], g["a2y"], 0), (g["a3x"], g["a3y"], 0)]
    offsets += [(0, 0, g["a4z"]), (0, g["a5y"], 0)]
    return chain(*zip((z, y, y, y, z, y), offsets, strict=True)), np.eye(6)


def scara() -> tuple[pin.Model, np.ndarray]:
    """The spindle as two slides, one of which is driven by J4."""
    g = lengths("scara")
    z, slide = pin.JointModelRZ, pin.JointModelPZ
    model = chain(
        (z, (0, 0, 0)),
        (z, (g["a1x"], 0, g["a1z"])),
        (slide, (g["a2x"], 0, g["a2z"])),
        (z, (0, 0, 0)),
        (slide, (0, 0, 0)),
    )
    mixing = np.zeros((5, 4))
    mixing[:4] = np.eye(4)
    mixing[4, 3] = g["a4z"] / (2 * np.pi)
    return model, mixing


def palletizer() -> tuple[pin.Model, np.ndarray]:
    g = lengths("palletizer")
    y, z = pin.JointModelRY, pin.JointModelRZ
    offsets = [(0, 0, 0), (g["a1x"], 0, g["a1z"]), (0, 0, g["a2z"]), (g["a3x"], 0, 0), (g["a4x"], 0, g["a4z"])]
    mixing = np.array([[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, -1, -1, 0], [0, 0, 0, 1]])
    return chain(*zip((z, y, y, y, z), offsets, strict=True)), mixing


def gantry() -> tuple[pin.Model, np.ndarray]:
    """The thesis' table, modified Denavit-Hartenberg: Rx(alpha) Rz(theta), then the joint along or about Z."""
    table = [(90, 90), (90, 90), (90, 0), (0, None), (-90, None), (90, None)]
    joints = []
    for alpha, theta in table:
        rotation = pin.utils.rotate("x", np.radians(alpha)) @ pin.utils.rotate("z", np.radians(theta or 0))
        kind = pin.JointModelRZ if theta is None else pin.JointModelPZ
        joints.append((kind, pin.SE3(rotation, np.zeros(3))))
    return chain(*joints), np.eye(6)


MODELS = {"cobot": cobot, "scara": scara, "palletizer": palletizer, "gantry": gantry}


@pytest.mark.parametrize("family", MODELS)
def test_flange_and_jacobian_agree_with_pinocchio(family: str) -> None:
    model, q = robot(family), random_joints(family, 10_000)
    peer, mixing = MODELS[family]()
    data, last = peer.createData(), peer.njoints - 1
    poses, jacobians = model.forward(q), model.jacobian(q)
    rates = np.random.default_rng(1).uniform(-1, 1, q.shape)
    changes = model.jacobian_derivative(q, rates)
    frame = pin.LOCAL_WORLD_ALIGNED
    for i, coordinates in enumerate(q @ mixing.T):
        pin.forwardKinematics(peer, data, coordinates)
        assert abs(poses[i] - data.oMi[last].homogeneous).max() < 1e-9
        if i >= 1000:
            continue
        pin.computeJointJacobiansTimeVariation(peer, data, coordinates, mixing @ rates[i])
        expected = pin.getJointJacobian(peer, data, last, frame) @ mixing
        assert abs(jacobians[i] - expected).max() < 1e-9
        change = pin.getJointJacobianTimeVariation(peer, data, last, frame) @ mixing
        assert abs(changes[i] - change).max() < 1e-9
