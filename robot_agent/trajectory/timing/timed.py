"""Joints over time, and what a filter on the axes was given to make them from, kept for motions that go on."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from robot_agent.trajectory.joints.pieces import Pieces

Numbers = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class FilterInput:
    """The joints in front of the filter, in a time of their own.

    What leaves the filter is a mean over the window before it: the first value that enters is the first of `pieces`.
    """

    pieces: Pieces
    times: Numbers
    """`(k,)` [s] at which `parameters` `(k,)` of the path are passed."""
    parameters: Numbers
    window_s: float
    lead_s: float = 0.0
    """Of `pieces` before the filtered run begins: at most a window."""
    slower: float = 1.0
    """How many times longer everything takes after the filter."""

    def entered_s(self, run_s: float) -> float:
        """The own time of what enters the filter at `run_s` [s] of the filtered run."""
        return self.lead_s + run_s / self.slower

    def window_before(self, own_s: float) -> Pieces:
        """All that the filter still needs of the time before `own_s` [s]: a window, or from the rest at the start."""
        return self.pieces.part(max(own_s - self.window_s, 0.0), own_s)


@dataclass(frozen=True, slots=True, eq=False)
class Timed:
    """Joints over time, and times `(k,)` [s] at which parameters `(k,)` of the path are passed."""

    pieces: Pieces
    times: Numbers
    parameters: Numbers
    deviation_m: float = 0.0
    """How far a filter takes the TCP off the path."""
    raw: FilterInput | None = None
    """What the filter was given; None without one."""
