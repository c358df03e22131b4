"""The checks of things, spaces and the robot itself against brute force: random robots, things and motions.

`make mutants` plants faults in the checks and finds them by the same worlds (`tests/mutants/body.py`).
"""

from dataclasses import replace

import numpy as np
import pytest

from cell.geometry import Sphere
from robot_agent.kinematics import load_model
from robot_agent.workspace import sweep
from robot_agent.workspace.things import Barrier, first_near
from tests.unit.repository import ROOT
from tests.unit.robot_agent.workspace.drawn_worlds import verdict

FINE_S = 1e-4


def judge(seed: int, every_s: float = np.inf) -> bool:
    """Whether there was something to judge."""
    found = verdict(seed, every_s)
    assert found is None or found.right, f"world {seed}: {found}"
    return found is not None


@pytest.mark.parametrize("seed", range(12))
def test_what_brute_force_sees_is_refused_and_nothing_else(seed: int) -> None:
    judge(seed)


def test_what_lies_between_two_samples_far_apart_is_seen_by_the_bulge() -> None:
    """A joint turns evenly by a radian in two steps; a speck is on the arc of the hand, beside both chords."""
    model = load_model(ROOT / "cell_configs" / "models" / "six_axis.yaml")
    q = np.repeat(model.home[None], 3, axis=0)
    q[:, 0] = [-0.5, 0.0, 0.5]
    body = sweep(model, np.eye(4), q)
    hand = len(model.body) - 1

    def points_at(taus: np.ndarray) -> np.ndarray:
        between = model.home + np.outer(taus - 1.0, np.eye(model.n)[0] * 0.5)
        return np.asarray(model.capsules(between))

    body = replace(body, radii=np.zeros(len(body.radii)))
    speck = points_at(np.array([0.5]))[0, hand, 1]
    barrier = Barrier(Sphere(speck, 1e-5), 0.0, np.array([hand]))
    taus = np.array([0.0, 1.0, 2.0])
    assert first_near(barrier, body, taus, points_at) is not None
    assert first_near(barrier, replace(body, bulge=np.zeros(2)), taus, points_at) is None


@pytest.mark.soak
@pytest.mark.parametrize("first", range(1000, 5000, 100))
def test_soak_what_brute_force_sees_is_refused_and_nothing_else(first: int) -> None:
    assert sum(judge(seed) for seed in range(first, first + 100)) > 40


@pytest.mark.soak
@pytest.mark.timeout(900)
@pytest.mark.parametrize("first", range(5000, 5400, 40))
def test_soak_a_look_at_every_tenth_of_a_millisecond_sees_no_more(first: int) -> None:
    assert sum(judge(seed, FINE_S) for seed in range(first, first + 40)) > 15
