"""What a robot may pass up to rest: pieces of its motions, and the body over them."""

from dataclasses import dataclass

import numpy as np

from cell.messages import Body
from robot_agent.agent.planning.plans import Planned
from robot_agent.trajectory import AT_HOLD_S
from robot_agent.workspace import Sweep

Piece = tuple[Sweep, int, int]
"""Of a swept body: from its first sample to its last, inclusive."""


@dataclass(frozen=True, slots=True)
class Span:
    """A piece of one motion: everything from path time `first_tau` to `last_tau`, in whichever direction."""

    planned: Planned
    first_tau: float
    last_tau: float

    @property
    def stands(self) -> bool:
        """Whether it is one place only.

        Blocks that wait in front of one hold may each have come to it in a way of their own, apart by rounding.
        """
        return self.last_tau - self.first_tau <= AT_HOLD_S

    @property
    def samples(self) -> tuple[int, int]:
        """First and last sample of the motion's sweep that enclose the span."""
        taus = self.planned.taus
        last = min(int(np.searchsorted(taus, self.last_tau, side="left")), len(taus) - 1)
        first = int(np.searchsorted(taus, self.first_tau, side="right")) - 1
        return max(min(first, last), 0), last


@dataclass(frozen=True, slots=True)
class Passed:
    """What a robot may pass up to rest."""

    body: Body
    """The whole reach when nobody knows where the robot is: it is not referenced, or its joints cannot be so."""
    spans: list[Span]
    pieces: list[Piece]
    """Of each span the body over it: exactly where the robot stands, else from sample to sample around it."""
    widen_m: float
    """How far it is measured from where it is commanded."""
    from_tick: int
    """After which tick it was commanded to where it is measured."""
