"""The root of a function between two values at which it has different signs."""

from collections.abc import Callable

_EPSILON = 2.0**-53
_STEPS = 200


def root(function: Callable[[float], float], first: float, last: float) -> float:
    """Where `function` is zero between `first` and `last`, to rounding; the better end where the signs are equal.

    Inverse quadratic interpolation where it is safe, else halving. Source: Chandrupatla, A new hybrid quadratic/
    bisection algorithm for finding the zero of a nonlinear function, Advances in Engineering Software 28 (1997).
    """
    a, b = last, first
    fa, fb = function(a), function(b)
    if fa * fb > 0.0:
        return a if abs(fa) < abs(fb) else b
    c, fc, share = a, fa, 0.5
    for _ in range(_STEPS):
        x = a + share * (b - a)
        fx = function(x)
        if (fx > 0.0) == (fa > 0.0):
            c, fc = a, fa
        else:
            c, fc, b, fb = b, fb, a, fa
        a, fa = x, fx
        best, least = (a, fa) if abs(fa) < abs(fb) else (b, fb)
        smallest = 2.0 * _EPSILON * abs(best) / abs(b - a) if b != a else 1.0
        if least == 0.0 or smallest > 0.5:
            return best
        share = min(1.0 - smallest, max(smallest, _share(a, b, c, fa, fb, fc)))
    return best


def _share(a: float, b: float, c: float, fa: float, fb: float, fc: float) -> float:
    """How far from a to b to look next: by interpolation where the three points allow it."""
    xi, phi = (a - b) / (c - b), (fa - fb) / (fc - fb)
    if not (phi * phi < xi and (1.0 - phi) ** 2 < 1.0 - xi):
        return 0.5
    return fa / (fb - fa) * fc / (fb - fc) + (c - a) / (b - a) * fa / (fc - fa) * fb / (fc - fb)
