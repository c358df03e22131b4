"""A whole robot on the shafts of its motors: a double pendulum against its textbook equations of motion."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from drive_gateway.sim.axis.load import GRAVITY_M_S2, STOP_NM_RAD, stops
from drive_gateway.sim.axis.mechanics import LoadData, Mechanics
from drive_gateway.sim.axis.robot_load import RobotLoad, Shaft

GEARS, DIRECTIONS, OFFSETS = np.array([20.0, 15.0]), np.array([1.0, -1.0]), np.array([0.4, -0.2])
ROTORS = np.array([2e-3, 1e-3])
STEP_S = 1e-4
M1, M2, L1, L2 = 6.0, 4.0, 0.5, 0.4
"""Two point masses at the ends of two rods; angles from straight down, the second against the first."""


def mass_matrix(q2: np.ndarray) -> np.ndarray:
    """`(m,)` -> `(m, 2, 2)`; Spong, Robot Modeling and Control, two-link arm."""
    both = M2 * (L2**2 + L1 * L2 * np.cos(q2))
    first = (M1 + M2) * L1**2 + M2 * (L2**2 + 2 * L1 * L2 * np.cos(q2))
    second = np.full_like(both, M2 * L2**2)
    return np.moveaxis(np.array([[first, both], [both, second]]), -1, 0)


def bias(q: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Centrifugal, Coriolis, gravity: `(m, 2)`."""
    c = M2 * L1 * L2 * np.sin(q[:, 1])
    turned = np.stack([-c * (2 * v[:, 0] * v[:, 1] + v[:, 1] ** 2), c * v[:, 0] ** 2], axis=-1)
    hand = M2 * L2 * np.sin(q.sum(axis=1))
    weight = np.stack([(M1 + M2) * L1 * np.sin(q[:, 0]) + hand, hand], axis=-1)
    return turned + GRAVITY_M_S2 * weight


def torques(q: np.ndarray, v: np.ndarray, a: np.ndarray) -> np.ndarray:
    return np.einsum("mij,mj->mi", mass_matrix(q[:, 1]), a) + bias(q, v)


def test_a_falling_double_pendulum_moves_as_its_equations_say() -> None:
    start, seconds = np.array([1.2, 0.5]), 0.6
    way = DIRECTIONS / GEARS
    shafts = [
        Shaft(Mechanics(rotor, LoadData(1.0), gear, angle, STEP_S), scale, offset)
        for rotor, gear, angle, scale, offset in zip(ROTORS, GEARS, (start - OFFSETS) / way, way, OFFSETS, strict=True)
    ]
    robot = RobotLoad(torques, shafts)
    loads = [robot.of(0), robot.of(1)]
    for step in range(round(seconds / STEP_S)):
        for shaft, load in zip(shafts, loads, strict=True):
            shaft.mechanics.step(0.0, load(step * STEP_S), 0.0)
    moved = OFFSETS + way * np.array([shaft.mechanics.angle for shaft in shafts])

    def slope(_time: float, state: np.ndarray) -> np.ndarray:
        q, v = state[None, :2], state[None, 2:]
        inertia = mass_matrix(q[:, 1])[0] + np.diag(ROTORS * GEARS**2)
        return np.concatenate([v[0], np.linalg.solve(inertia, -bias(q, v)[0])])

    exact = solve_ivp(slope, (0.0, seconds), [*start, 0.0, 0.0], rtol=1e-9, atol=1e-9).y[:2, -1]
    assert abs(exact - start).min() > 0.3
    np.testing.assert_allclose(moved, exact, atol=0.01 * abs(exact - start).max())


def test_a_stop_pushes_back_beyond_it_and_only_there() -> None:
    load = stops(-1.0, 0.5)
    assert load(-1.0) == load(0.0) == load(0.5) == 0.0
    assert load(0.502) == pytest.approx(-0.002 * STOP_NM_RAD)
    assert load(-1.002) == pytest.approx(0.002 * STOP_NM_RAD)
