"""What the governor answers: samples along a motion that end at rest."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from robot_agent.trajectory.governor.rate_law import RateLaw

RESTING_SAMPLES = 3
"""A segment ends with at least this many equal samples, so velocity and acceleration are zero by differences too."""


@dataclass(frozen=True, slots=True)
class PathState:
    """Where on the motion, and how fast planned time advances: tau [s], its rate, the rate's slope [1/s].

    Where the motion is travelled backwards the rate is negative.
    """

    tau: float
    rate: float
    rate_dot: float


@dataclass(frozen=True, eq=False)
class Segment:
    """Samples for consecutive ticks; sample k belongs to the tick at which it was joined, plus k.

    Sample 0 is the join: it repeats what the segment before commands for that tick. The first `nominal` samples after
    it follow the requested rate, then the braking ramp runs; after the last sample the robot stands there. A segment
    that is joined later than it is long is joined at rest.
    """

    tau: NDArray[np.float64]
    """`(m,)` [s], never falling; never rising where the motion is travelled backwards."""
    rate: NDArray[np.float64]
    """`(m,)`"""
    rate_dot: NDArray[np.float64]
    """`(m,)` [1/s]"""
    q: NDArray[np.float64]
    """`(m, n)` [rad or m]"""
    qd: NDArray[np.float64]
    """`(m, n)` velocity that is really commanded, the rate included."""
    nominal: int
    ruled_by: str
    """Who of the requests and holds rules; empty when the plan itself does."""
    before: NDArray[np.float64]
    """`(2, n)` the joints commanded in the two ticks before sample 0."""
    cycle_s: float
    law: RateLaw | None = None
    """How the rate changes over the nominal part, in the direction of travel; None where there is no such part."""

    @property
    def length(self) -> int:
        return len(self.tau)

    @cached_property
    def rest_index(self) -> int:
        """The first sample at rest. The next motion's first segment may take the place of this one from here on."""
        moving = np.flatnonzero(np.any(self.q != self.q[-1], axis=1))
        return int(moving[-1]) + 1 if len(moving) else 0

    @property
    def stop_time_s(self) -> float:
        """Time from sample 0 to rest."""
        return self.rest_index * self.cycle_s

    @property
    def stop_tau(self) -> float:
        """Where the segment comes to rest."""
        return float(self.tau[-1])

    def state(self, index: int) -> PathState:
        """The state at sample `index` (from 0); at rest after the end."""
        k = min(index, self.length - 1)
        return PathState(float(self.tau[k]), float(self.rate[k]), float(self.rate_dot[k]))

    def remainder(self, index: int, ruled_by: str) -> "Segment":
        """The rest of this segment from sample `index` on, as a segment of its own."""
        kept = np.minimum(np.arange(index, max(self.length, index + RESTING_SAMPLES)), self.length - 1)
        return replace(
            self,
            tau=self.tau[kept],
            rate=self.rate[kept],
            rate_dot=self.rate_dot[kept],
            q=self.q[kept],
            qd=self.qd[kept],
            nominal=max(0, self.nominal - index),
            ruled_by=ruled_by,
            before=self.history(index),
            law=self.law_from(index),
        )

    def law_from(self, index: int) -> RateLaw | None:
        """The law of the nominal part from sample `index` on; None after its end."""
        return None if self.law is None or index > self.nominal else self.law.later(index * self.cycle_s)

    def history(self, index: int) -> NDArray[np.float64]:
        """`(2, n)` the joints commanded in the two ticks before sample `index`."""
        if 2 <= index <= self.length:
            return self.q[index - 2 : index]
        commanded = np.concatenate([self.before, self.q])
        return commanded[np.minimum([index, index + 1], len(commanded) - 1)]
