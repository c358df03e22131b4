"""An interpreter of G-code of its own, from the text of the standard alone: what the product reads is judged by it.

Source: Kramer, Proctor, Messina: The NIST RS274NGC Interpreter, Version 3, NISTIR 6556 (2000). Of an arc in the center
format "the coordinates of the end point of the arc in the selected plane are specified along with the offsets of the
center of the arc from the current location" (3.5.3.2); in the radius format "a positive radius indicates that the arc
turns through 180 degrees or less, while a negative radius indicates a turn of 180 degrees to 359.999 degrees"
(3.5.3.1). With G91 X, Y and Z are increments (3.5.17); G2 is clockwise as seen from the positive end of the third
axis (3.5.3).
It knows nothing of mistakes.
"""

import math
import re
from dataclasses import dataclass

import numpy as np

_SAMPLES = np.linspace(0.0, 1.0, 33)
_NOWHERE_MM = 1e-6
PLANES = {17: "XYZ", 18: "ZXY", 19: "YZX"}
"""The two axes in which an arc turns, from the first to the second where it is counter-clockwise, and the third."""
OFFSET = {"X": "I", "Y": "J", "Z": "K"}


@dataclass(frozen=True)
class Stroke:
    """One move: places `(33, 3)` [m] at even shares of its way, and its feed [m/s]; None at rapid."""

    line: int
    places: np.ndarray
    feed_m_s: float | None


def strokes(text: str) -> list[Stroke]:
    """The moves of a file that names X, Y and Z in its first; those that lead nowhere are left out."""
    made: list[Stroke] = []
    at: dict[str, float] = {}
    unit, relative, absolute_centre, plane, motion, feed = 1.0, False, False, 17, 0, 0.0
    for line, written in enumerate(text.splitlines(), 1):
        plain = re.sub(r"\(.*?\)|;.*|\s", "", written).upper()
        words = [(letter, float(number)) for letter, number in re.findall(r"([A-Z])([-+0-9.]+)", plain)]
        codes = [number for letter, number in words if letter == "G"]
        said = {letter: number for letter, number in words if letter not in "GMN"}
        if ("M", 2.0) in words or ("M", 30.0) in words:
            return made
        for code in codes:
            unit = {20.0: 25.4, 21.0: 1.0}.get(code, unit)
            relative = {90.0: False, 91.0: True}.get(code, relative)
            absolute_centre = {90.1: True, 91.1: False}.get(code, absolute_centre)
            plane = int(code) if code in PLANES else plane
            motion = int(code) if code in (0, 1, 2, 3) else motion
        feed = said["F"] * unit / 60000.0 if "F" in said else feed
        if not any(letter in said for letter in "XYZIJKR"):
            continue
        goal = dict(at)
        for axis in "XYZ":
            if axis in said:
                goal[axis] = said[axis] * unit + (at[axis] if relative else 0.0)
        if motion < 2:
            places = _straight(at, goal) if at else None
        else:
            scaled = {letter: number * unit for letter, number in said.items()}
            places = _arc(at, goal, scaled, PLANES[plane], motion == 3, absolute_centre)
        at = goal
        if places is not None:
            made.append(Stroke(line, places / 1000.0, feed if motion else None))
    return made


def _straight(at: dict[str, float], goal: dict[str, float]) -> np.ndarray | None:
    begin, end = (np.array([each[axis] for axis in "XYZ"]) for each in (at, goal))
    return None if np.abs(begin - end).max() < _NOWHERE_MM else begin + _SAMPLES[:, None] * (end - begin)


def _arc(
    at: dict[str, float], goal: dict[str, float], said: dict[str, float], axes: str, ccw: bool, absolute_centre: bool
) -> np.ndarray:
    first, second, third = axes
    begin, end = (complex(each[first], each[second]) for each in (at, goal))
    sign = 1 if ccw else -1
    if "R" in said:
        chord, radius = end - begin, said["R"]
        height = math.sqrt(max(0.0, radius**2 - abs(chord) ** 2 / 4.0))
        # of the two centres, that from which the way in this direction is the shorter one where R is positive
        centre = begin + chord / 2.0 + math.copysign(1.0, radius) * sign * 1j * chord / abs(chord) * height
    else:
        offset = complex(said.get(OFFSET[first], 0.0), said.get(OFFSET[second], 0.0))
        centre = offset if absolute_centre else begin + offset
    turned = 2.0 * math.pi
    if abs(end - begin) > 1e-9:
        turned = float(np.angle((end - centre) / (begin - centre)) * sign) % (2.0 * math.pi)
    around = centre + (begin - centre) * np.exp(1j * sign * turned * _SAMPLES)
    by_axis = {first: around.real, second: around.imag, third: at[third] + _SAMPLES * (goal[third] - at[third])}
    return np.stack([by_axis[axis] for axis in "XYZ"], axis=1)
