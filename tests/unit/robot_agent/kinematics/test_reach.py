"""The reach of every robot: never too small, and hardly too large."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from robot_agent.kinematics import Model, OpenMechanism, load_model, model_of
from robot_agent.kinematics.reach import farthest, placed, points, slid, together, turned
from robot_agent.model.description import Capsule, Mounted
from tests.unit.config_world import CONFIGS
from tests.unit.six_axis_arm import arm, with_tip

MODELS = sorted((CONFIGS / "models").glob("*.yaml"))


def distance(model: Model, q: np.ndarray) -> np.ndarray:
    """`(m, n)` -> `(m,)` [m]: the farthest point of the body from the base."""
    return np.asarray((np.linalg.norm(model.capsules(q), axis=-1).max(axis=-1) + model.capsule_radii).max(axis=-1))


def climbed(model: Model) -> float:
    """The largest distance that a random search inside the limits finds."""
    rng = np.random.default_rng(3)
    lower, upper = model.limits.position.T
    q = rng.uniform(lower, upper, (300, model.n))
    best, step = distance(model, q), 0.3 * (upper - lower)
    for round_ in range(60):
        tried = np.clip(q + 0.9**round_ * step * rng.normal(size=q.shape), lower, upper)
        found = distance(model, tried)
        q, best = np.where((found > best)[:, None], tried, q), np.maximum(best, found)
    return float(best.max())


@pytest.mark.parametrize("path", MODELS, ids=lambda path: path.stem)
def test_the_reach_is_what_a_robot_can_reach(path: Path) -> None:
    model = load_model(path)
    found = climbed(model)
    assert found <= model.reach_m
    assert found > (0.95 if path.stem == "delta" else 0.99) * model.reach_m


@pytest.mark.parametrize("name", ["six_axis", "cobot", "palletizer", "scara", "painter"])
def test_it_holds_outside_the_limits_too(name: str) -> None:
    model = load_model(CONFIGS / "models" / f"{name}.yaml")
    low, high = np.where(model.linear, model.limits.position.T, np.array([[-np.pi], [np.pi]]))
    q = np.random.default_rng(4).uniform(low, high, (5000, model.n))
    assert distance(model, q).max() <= model.reach_m


def test_a_delta_that_hangs_outside_its_limits_stays_within_its_reach() -> None:
    model = load_model(CONFIGS / "models/delta.yaml")
    angles = np.random.default_rng(4).uniform(-np.pi, np.pi, (3000, 4))
    met = 0
    for q in angles:
        try:
            points_ = model.capsules(q)
        except OpenMechanism:
            continue
        met += 1
        assert (np.linalg.norm(points_, axis=-1).max(axis=-1) + model.capsule_radii).max() <= model.reach_m
    assert met > 1000


def test_a_long_tool_counts() -> None:
    model = load_model(CONFIGS / "models/palletizer.yaml")
    long = replace(model.description.tools["cups"], capsules=(Capsule((0, 0, 0), (1.5, 0, -0.2), 0.1),))
    carrying = model_of(replace(model.description, tools={"long": long}, mounted=Mounted(("long",))))
    found = climbed(carrying)
    assert 0.99 * carrying.reach_m < found <= carrying.reach_m
    assert carrying.reach_m > model.reach_m + 1


def test_a_point_on_two_turning_links_is_where_the_triangle_says() -> None:
    # An elbow at 0.5 m above and 0.3 m beside an upright axis, a lever of 0.4 m that turns about Y.
    lever = turned(points(np.array([[0.4, 0.0, 0.0]])), 1)
    reach = farthest(turned(placed(lever, np.array([0.3, 0.0, 0.5])), 2))
    assert np.hypot(0.3, 0.5) + 0.4 <= reach[0] < 1.005 * (np.hypot(0.3, 0.5) + 0.4)


def test_a_slide_reaches_to_its_farther_end() -> None:
    reach = farthest(slid(points(np.array([[0.0, 0.2, 0.0], [0.1, 0.0, 0.0]])), 0, -0.5, 0.3))
    expected = np.array([np.hypot(0.5, 0.2), 0.4])
    assert (reach >= expected).all()
    assert (reach < 1.005 * expected).all()


def test_places_that_are_taken_independently_add_up() -> None:
    circle = turned(points(np.array([[0.2, 0.0, 0.0]])), 2)
    reach = farthest(together(circle, circle, points(np.array([[0.0, 0.0, 0.3]]))))
    assert np.hypot(0.4, 0.3) <= reach[0] < 1.005 * np.hypot(0.4, 0.3)


def test_a_tcp_far_from_the_tools_capsules_counts() -> None:
    model = with_tip()
    q = np.random.default_rng(6).uniform(-np.pi, np.pi, (20_000, model.n))
    far = np.linalg.norm(model.forward(q)[:, :3, 3], axis=-1).max()
    assert arm().reach_m < far <= model.reach_m
