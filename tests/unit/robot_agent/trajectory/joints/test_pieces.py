"""A part of a curve is that curve, wherever it is cut."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from robot_agent.trajectory.joints.pieces import Pieces

KNOTS = np.array([0.0, 0.3, 0.7, 0.7004, 1.2])
RNG = np.random.default_rng(5)
CURVE = Pieces.through(KNOTS, *RNG.uniform(-1.0, 1.0, (3, len(KNOTS), 2)))
"""Neighbouring pieces go far apart beyond the knot between them."""
HAIR = st.sampled_from([0.0, 1e-16, 1e-13, 5e-13, 1e-12, 2e-12, 1e-9])
CUTS = st.floats(0.0, 1.2) | st.builds(
    lambda knot, by: float(np.clip(knot + by, 0.0, 1.2)), st.sampled_from(list(KNOTS)), HAIR | HAIR.map(lambda by: -by)
)


@given(CUTS, CUTS)
def test_a_part_is_the_curve_also_where_it_is_cut_a_hair_beside_a_knot(one: float, other: float) -> None:
    first, last = min(one, other), max(one, other)
    part = CURVE.part(first, last)
    at = np.linspace(0.0, last - first, 50)
    assert part.duration_s == last - first
    assert np.abs(part.shape(at)[:2] - CURVE.shape(first + at)[:2]).max() < 1e-6
