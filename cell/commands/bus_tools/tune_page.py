"""The page of `drive-gateway tune`: step, gain and phase of a speed loop as curves."""

from cmath import phase
from math import isfinite

import numpy as np
from numpy.typing import NDArray

from cell.commands.pages.page import Chart, page
from drive_gateway.sim.axis.response import Margins, Point, Step

Floats = NDArray[np.float64]


def tune_page(name: str, summary: list[str], points: list[Point], step: Step, found: Margins) -> str:
    """The HTML text. Vertical lines stand at the frequencies of both margins, dashed ones at 0 dB and -180 deg."""
    hz = np.array([point.hz for point in points])
    loops = {"open": np.array([point.open for point in points]), "closed": np.array([point.closed for point in points])}
    marks = tuple(mark for mark in (found.crossover_hz, found.gain_hz) if isfinite(mark))
    gains = [(loop, hz, 20.0 * np.log10(np.abs(values))) for loop, values in loops.items()]
    phases = [(loop, hz, _degrees(values)) for loop, values in loops.items()]
    step_curve = [("speed", 1e3 * np.array(step.times), np.array(step.speed))]
    charts = [
        Chart("Step of the set speed", "ms", "part of the step", step_curve, bounds=(1.0,)),
        Chart("Gain", "Hz", "dB", gains, marks, bounds=(0.0,), decades=True),
        Chart("Phase", "Hz", "deg", phases, marks, bounds=(-180.0,), decades=True),
    ]
    return page(f"Speed loop of {name}", summary, [chart.figure() for chart in charts])


def _degrees(values: NDArray[np.complex128]) -> Floats:
    """Phase without jumps, from where the loop is slowest on."""
    unwrapped: Floats = np.degrees(np.unwrap([phase(value) for value in values]))
    return unwrapped
