"""Places on curves one after the other, asked for all at once."""

import numpy as np

from robot_agent.paths.chain import CurveChain
from robot_agent.paths.curves import Circle, Straight, Trimmed, bezier

X, Y = np.eye(3)[:2]
SPLINE = bezier(np.array([[0, 0, 0], [0.1, 0.2, 0], [0.2, -0.1, 0.1], [0.4, 0, 0]]))
EDGE = bezier(np.array([[0, 0, 0], [0.02, 0, 0], [0.04, 0.02, 0], [0.04, 0.04, 0.03], [0.1, 0.1, 0.1]]))
CURVES = (
    Straight(np.zeros(3), X, 0.3),
    SPLINE,
    Trimmed(Trimmed(EDGE, 0.01, 0.15), 0.02, 0.1),
    Circle(np.zeros(3), X, Y, 0.2, -1.5),
    Trimmed(SPLINE, 0.05, 0.2),
)
CHAIN = CurveChain(CURVES, np.append(0.0, np.cumsum([curve.length_m for curve in CURVES])))


def test_each_place_is_the_one_on_its_own_curve() -> None:
    distances = np.random.default_rng(1).uniform(0.0, CHAIN.length_m, 200)
    number = np.searchsorted(CHAIN.starts_m, distances, side="right") - 1
    own = [CURVES[k].at(np.array(d - CHAIN.starts_m[k])) for k, d in zip(number, distances, strict=True)]
    assert set(number) == set(range(len(CURVES)))
    np.testing.assert_allclose(CHAIN.at(distances), np.stack(own, axis=1), atol=1e-9)


def test_a_curve_begins_where_its_border_is_and_the_last_one_ends_at_the_end() -> None:
    borders = CHAIN.at(CHAIN.starts_m)
    firsts = [curve.at(np.zeros(())) for curve in CURVES]
    last = CURVES[-1].at(np.array(CURVES[-1].length_m))
    np.testing.assert_allclose(borders, np.stack([*firsts, last], axis=1), atol=1e-9)


def test_curves_without_polynomials_need_none() -> None:
    chain = CurveChain((CURVES[0], CURVES[3]), np.array([0.0, 0.3, 0.6]))
    np.testing.assert_allclose(chain.at(np.array([0.1, 0.3]))[0], [[0.1, 0, 0], [0.2, 0, 0]], atol=1e-12)
