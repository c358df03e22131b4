"""Why a motion cannot be planned."""

from typing import Any

import numpy as np
from numpy.typing import NDArray


class PlanError(Exception):
    """A move that cannot be planned; the message says where, what was found, what is allowed and what to do.

    `move` counts the moves of the sequence from 0, `line` is the program line. `joint` and `limit` name what is
    exceeded and `pose` `(4, 4)` the TCP pose in the robot base where it happens, as far as they apply.
    """

    def __init__(
        self,
        move: int,
        line: int,
        reason: str,
        hint: str,
        joint: str | None = None,
        limit: str | None = None,
        pose: NDArray[np.float64] | None = None,
    ) -> None:
        self.move = move
        self.line = line
        self.reason = reason
        self.hint = hint
        self.joint = joint
        self.limit = limit
        self.pose = pose
        where = "" if pose is None else " at X {:.1f} Y {:.1f} Z {:.1f} mm".format(*(1000.0 * pose[:3, 3]))
        super().__init__(f"line {line}{where}: {reason}; {hint}")

    def __reduce__(self) -> tuple[Any, ...]:
        """Errors travel from the planning worker to the agent."""
        return type(self), (self.move, self.line, self.reason, self.hint, self.joint, self.limit, self.pose)
