import numpy as np
import pinocchio as pin
from hypothesis import given
from hypothesis import strategies as st

from cell.geometry import quaternion

RNG = np.random.default_rng(3)
RANDOM = RNG.normal(size=(500, 4))
RANDOM /= np.linalg.norm(RANDOM, axis=1)[:, None]


def test_matrices_agree_with_pinocchio() -> None:
    expected = np.array([pin.Quaternion(q).toRotationMatrix() for q in RANDOM])
    np.testing.assert_allclose(quaternion.to_matrix(RANDOM), expected, atol=1e-14)


def test_products_agree_with_products_of_matrices() -> None:
    left, right = RANDOM[:250], RANDOM[250:]
    product = quaternion.to_matrix(quaternion.multiply(left, right))
    np.testing.assert_allclose(product, quaternion.to_matrix(left) @ quaternion.to_matrix(right), atol=1e-14)


@given(
    axis=st.tuples(*[st.sampled_from([-1.0, -1e-9, 0.0, 1e-9, 0.5, 1.0])] * 3).filter(lambda a: max(map(abs, a)) > 0.1),
    angle=st.sampled_from([0.0, 1e-12, 1e-7, 1.0, np.pi / 2, np.pi - 1e-7, np.pi, np.pi + 1e-7, 2 * np.pi]),
)
def test_matrix_to_quaternion_is_exact_for_small_angles_and_half_turns(axis: tuple[float, ...], angle: float) -> None:
    direction = np.array(axis) / np.linalg.norm(axis)
    q = np.append(np.sin(angle / 2) * direction, np.cos(angle / 2))
    found = quaternion.from_matrix(quaternion.to_matrix(q))
    sign = np.sign(found @ q)
    np.testing.assert_allclose(found * sign, q, atol=1e-14)
    assert found[3] >= 0
