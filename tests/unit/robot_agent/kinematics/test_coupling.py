import numpy as np

from robot_agent.kinematics import Coupling
from tests.unit.six_axis_arm import arm

RNG = np.random.default_rng(4)
MATRIX = np.tril(RNG.uniform(-0.5, 0.5, (6, 6)), -1) + np.diag([1, -1, 2, 1, 0.5, 1])
COUPLING = Coupling.of(MATRIX, 6)


def test_the_textbooks_motors_are_its_joints() -> None:
    matrix = np.eye(6)
    matrix[4, 3], matrix[5, 3] = 0.02, -0.013
    coupling = Coupling.of(matrix, 6)
    motors, joints = np.array([10, 20, 30, 90, 50, 60]), np.array([10, 20, 30, 90, 51.8, 58.83])
    np.testing.assert_allclose(coupling.joints(motors), joints, atol=1e-12)
    np.testing.assert_allclose(coupling.axes(joints), motors, atol=1e-12)


def test_a_coupled_joint_stands_when_its_motor_turns_against_the_coupling() -> None:
    coupling = Coupling.of(np.array([[1.0, 0], [-1, 1]]), 2)
    np.testing.assert_allclose(coupling.joints(np.array([0.3, 0])), [0.3, -0.3])
    np.testing.assert_allclose(coupling.axes(np.array([0.3, 0])), [0.3, 0.3])


def test_joints_become_axes_and_axes_joints() -> None:
    q = RNG.uniform(-3, 3, (50, 4, 6))
    np.testing.assert_allclose(COUPLING.joints(COUPLING.axes(q)), q, atol=1e-12)


def test_torques_do_the_same_work_on_either_side() -> None:
    axis_speeds, joint_torques = RNG.uniform(-1, 1, (2, 50, 6))
    work = (COUPLING.joints(axis_speeds) * joint_torques).sum(axis=-1)
    axis_torques = COUPLING.axis_torques(joint_torques)
    np.testing.assert_allclose((axis_speeds * axis_torques).sum(axis=-1), work, atol=1e-12)
    np.testing.assert_allclose(COUPLING.joint_torques(axis_torques), joint_torques, atol=1e-12)


def test_without_coupling_each_joint_is_its_axis() -> None:
    q = RNG.uniform(-3, 3, (5, 6))
    np.testing.assert_array_equal(arm().coupling.axes(q), q)
    np.testing.assert_array_equal(arm().coupling.joints(q), q)
