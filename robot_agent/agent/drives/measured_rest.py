"""Whether a robot stands, as its drives measure it; where it may be until then, when no blocks lead it."""

import numpy as np
from numpy.typing import NDArray

from cell.messages import Body, DriveFeedback, PlayoutState
from robot_agent.agent.planning.planner import Planner
from robot_agent.workspace import Braking, joined, standing_body

REST_S = 0.1
"""A robot stands when no joint has left its window for so long."""
WINDOW = 1e-3
"""[rad or m] that window: 10 mrad/s or 10 mm/s over `REST_S`. More than a drive that holds lets its axis move."""
_MOVING = 0.05
"""[rad/s or m/s] A joint that is faster moves, however short it has been measured."""


class MeasuredRest:
    """Feed `take` with each feedback, in joints. What was never seen to move stands."""

    def __init__(self) -> None:
        self._anchor: NDArray[np.float64] | None = None
        self._still_since: int | None = None
        self._tick = 0
        self._cycle_s = 0.0
        self._standing = True
        self._sent: Body | None = None

    def take(self, feedback: DriveFeedback, cycle_s: float) -> None:
        """Note a measurement; one that is taken again, because no newer one came, changes nothing."""
        q, self._tick, self._cycle_s = feedback.position, feedback.tick, cycle_s
        stopping = feedback.state is PlayoutState.STOPPING
        fast = bool((np.abs(feedback.velocity) > _MOVING).any())
        if self._anchor is None or stopping or fast or (np.abs(q - self._anchor) > WINDOW).any():
            unmoved = self._anchor is None and self._standing and not stopping and not fast
            self._anchor, self._still_since = q, None if unmoved else self._tick
        self._standing = self.left_s == 0.0
        if self._standing and not feedback.enabled:
            self._sent = None

    def begin(self) -> None:
        """Whoever measures from here on may have ticks of its own: what moved must be measured at rest anew."""
        self._anchor = None

    def left_path(self, sent: Body | None) -> None:
        """Blocks lead the robot no more; `sent` is all that they led through, up to rest."""
        self._sent = sent

    @property
    def standing(self) -> bool:
        return self._standing

    @property
    def left_s(self) -> float:
        """How long [s] a robot that does not move any more is still to be measured until it stands."""
        if self._still_since is None:
            return 0.0
        return max(0.0, REST_S - (self._tick - self._still_since) * self._cycle_s)

    def stop_time_s(self, planner: Planner, feedback: DriveFeedback, commanded_s: float) -> float:
        """Until the robot is measured at rest [s]; 0.0 exactly when it is, and nothing that was sent moves it.

        Args:
            commanded_s: until all that was sent is at rest.
        """
        if self._standing:
            return commanded_s
        braking = Braking.of(planner.model, planner.limits, planner.cycle_s)
        return max(commanded_s, braking.time_s(feedback.velocity), self.left_s)

    def body(self, planner: Planner, feedback: DriveFeedback) -> Body:
        """Of a robot that no blocks lead: where it stands, or until it does, all that it may still come to.

        That is the rest of what was sent, and wherever its drives may bring it to rest, each by itself. For drives that
        have lost their voltage it is a guess; their robot's body and zones stay until it is measured at rest.
        """
        model, base = planner.model, planner.pose_world_base
        if self._standing or not feedback.referenced:
            return standing_body(model, base, feedback.position, known=feedback.referenced)
        braking = Braking.of(model, planner.limits, planner.cycle_s)
        body = braking.body(base, feedback.position, feedback.velocity)
        return body if self._sent is None else joined(body, self._sent)
