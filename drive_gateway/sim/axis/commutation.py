"""Three phases as one complex number, and the duty cycles of a three-leg bridge.

A space vector is `u + jv` in the stator's frame, phase U along the real axis; its length is the amplitude of a phase
(Clarke with constant amplitudes: i_alpha = i_u, i_beta = (i_u + 2 i_v) / sqrt 3). Turned back by the electric angle it
is `d + jq` (Park).
"""

from math import sqrt

_HALF_ROOT_3 = 0.5 * sqrt(3.0)


def phases(vector: complex) -> tuple[float, float, float]:
    """The values of U, V and W; their sum is zero."""
    along, across = -0.5 * vector.real, _HALF_ROOT_3 * vector.imag
    return vector.real, along + across, along - across


def clarke(u: float, v: float, w: float) -> complex:
    """The space vector of three phases; what all three have in common drops out."""
    return complex((2.0 * u - v - w) / 3.0, (v - w) / (2.0 * _HALF_ROOT_3))


def space_vector(voltage: complex, dc_v: float) -> tuple[float, float, float]:
    """Duty cycles, 0 to 1, of the upper switches of U, V and W.

    The two neighbouring vectors of the sector and V0 for the rest of the period: the lowest phase stays at the negative
    rail. This is phase voltage minus the lowest of the three, over the DC voltage; in sector 1 it is (T1 + T2, T2, 0)
    with T1 = m sin(60 deg - angle), T2 = m sin(angle) and m = sqrt(3) |voltage| / dc_v. A vector outside the hexagon is
    shortened and keeps its angle.
    """
    u, v, w = phases(voltage)
    low = min(u, v, w)
    u, v, w = u - low, v - low, w - low
    scale = max(u, v, w, dc_v)
    return (u / scale, v / scale, w / scale) if scale > 0.0 else (0.0, 0.0, 0.0)


def bridged(voltage: complex, dc_v: float) -> complex:
    """What these duty cycles put on the terminals: the voltage itself inside the circle that fits into the hexagon."""
    if 3.0 * (voltage.real * voltage.real + voltage.imag * voltage.imag) <= dc_v * dc_v:
        return voltage
    return dc_v * clarke(*space_vector(voltage, dc_v))
