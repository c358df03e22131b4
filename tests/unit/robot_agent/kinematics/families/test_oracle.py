"""Every serial family against a Pinocchio model that is built from its table, joint by joint."""

import numpy as np
import pinocchio as pin
import pytest

from tests.unit.pinocchio_chains import CHAINS
from tests.unit.robot_families import random_joints, robot


@pytest.mark.parametrize("family", CHAINS)
def test_flange_and_jacobian_agree_with_pinocchio(family: str) -> None:
    model, q = robot(family), random_joints(family, 10_000)
    peer, mixing = CHAINS[family](model.description.geometry)
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
