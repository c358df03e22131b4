"""A block of a corrected path, as it was given: whoever learns that it is played goes on from it."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from robot_agent.trajectory.governor.segment import Segment
from robot_agent.trajectory.sources.states import States


@dataclass(frozen=True, slots=True, eq=False)
class CorrectedBlock:
    """State `k` of all three belongs to the same tick, the first one is where the block was joined."""

    path: Segment
    correction: NDArray[np.float64]
    """`(3, m, 6)` offset, velocity, acceleration."""
    states: States
    before: NDArray[np.float64]
    """`(2, n)` the joints commanded in the two ticks before the first state."""

    @classmethod
    def standing(cls, path: Segment) -> "CorrectedBlock":
        """At rest on the path, without a correction."""
        here = path.q[:1]
        return cls(path, np.zeros((3, 1, 6)), States.standing(here[0], 1), np.repeat(here, 2, axis=0))

    def offset(self, index: int) -> NDArray[np.float64]:
        """`(6,)` the correction in state `index`; after the last one it rests where that is."""
        return np.asarray(self.correction[0, min(index, self.correction.shape[1] - 1)])

    def after(self, ticks: int) -> "CorrectedBlock":
        """What comes from tick `ticks` on."""
        kept = np.minimum(np.arange(ticks, max(self.states.count, ticks + 1)), self.states.count - 1)
        correction = self.correction[:, kept].copy()
        correction[1:, -1] = 0.0
        before = np.concatenate([self.before, self.states.first(ticks).q])[-2:]
        return CorrectedBlock(
            self.path.remainder(ticks, self.path.ruled_by), correction, self.states.after(ticks), before
        )

    def onto(self, path: Segment) -> "CorrectedBlock":
        """The same correction on another path that begins where this one has ended."""
        return CorrectedBlock(path, self.correction, self.states, self.before)
