"""The move that a robot is on, for people and views: how long it is, how much of it is done, and where it ends."""

import numpy as np
from numpy.typing import NDArray

from cell.geometry.pose import compose
from cell.geometry.quaternion import from_matrix
from cell.messages import MoveStatus
from robot_agent.agent.planning.planner import Planner
from robot_agent.trajectory import Motion

_SAMPLES = 65
"""Of a move, to measure the way of its TCP: half a turn is found to 0.01 %."""


class PresentMove:
    """Remembers the move that was asked for last: it is asked for in each state."""

    def __init__(self) -> None:
        self._motion: Motion | None = None
        self._number = 0
        self._taus = np.zeros(0)
        self._way_m = np.zeros(0)
        """Of the TCP from the beginning of the move to each of `_taus`."""
        self._q: NDArray[np.float64] = np.zeros(0)
        self._pose: NDArray[np.float64] = np.eye(4)

    def at(self, planner: Planner, motion: Motion, tau: float) -> MoveStatus:
        """The move at `tau` [s] of a motion that lasts longer than 0 s."""
        number = int(motion.move_at(np.array([tau]))[0])
        if motion is not self._motion or number != self._number:
            self._look(planner, motion, number)
        begins, ends = float(self._taus[0]), float(self._taus[-1])
        x, y, z = self._pose[:3, 3].tolist()
        qx, qy, qz, qw = from_matrix(self._pose[:3, :3]).tolist()
        return MoveStatus(
            length_m=float(self._way_m[-1]),
            done_m=float(np.interp(tau, self._taus, self._way_m)),
            duration_s=ends - begins,
            done_s=min(max(tau - begins, 0.0), ends - begins),
            target_joints=tuple(self._q.tolist()),
            target_position_m=(x, y, z),
            target_quaternion_xyzw=(qx, qy, qz, qw),
        )

    def _look(self, planner: Planner, motion: Motion, number: int) -> None:
        begins = float(motion.ends[number - 1]) if number else 0.0
        self._motion, self._number = motion, number
        self._taus = np.linspace(begins, float(motion.ends[number]), _SAMPLES)
        q = motion.q(self._taus)
        places = planner.model.forward(q)[:, :3, 3]
        steps = np.linalg.norm(np.diff(places, axis=0), axis=1)
        self._way_m = np.concatenate([[0.0], np.cumsum(steps)])
        self._q = q[-1]
        self._pose = compose(planner.pose_world_base, planner.model.forward(q[-1]))
