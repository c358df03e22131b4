"""The space in front of a robot that is jogged: the wish gone on straight, laid out before the robot comes there."""

import numpy as np
from numpy.typing import NDArray

from cell.geometry import transform_points
from cell.messages import Sections
from robot_agent.agent.planning.planner import Planner
from robot_agent.kinematics import OpenMechanism
from robot_agent.model.description import NOTHING
from robot_agent.trajectory.sources import JogSource
from robot_agent.trajectory.sources.tcp import NoDirection
from robot_agent.workspace import FOLLOWING_M, of_points

_LENGTH_M = 0.004
"""Of a section, by the capsule end that goes the farthest. Short ones are hardly larger than what a robot at rest owns,
so it can be jogged away from where it may come no nearer to another one."""
_BESIDE_M = 0.004
"""How far the robot may be beside the line: by what the jog's own samples differ, and by a quick stop at 250 mm/s."""
_AHEAD_M = 0.12
"""So far ahead of where the robot would come to rest it is laid: its braking way, and what comes until an answer."""
_TINY = 1e-6


class JogTube:
    """The sections of one press of a jog key, from where the robot stood when it began."""

    def __init__(self) -> None:
        self._source: JogSource | None = None
        self._q: list[NDArray[np.float64]] = []
        """Where sections begin, and where the last one ends."""
        self._sections = Sections()
        self._shape = NOTHING

    def ahead(self, planner: Planner, source: JogSource, q: NDArray[np.float64], at_rest: bool) -> Sections:
        """The sections from joints `q` `(n,)` on, at which the robot comes to rest by what was sent."""
        anew = source is not self._source or planner.mounted != self._shape
        nearest = 0 if anew or not self._q else self._nearest(q)
        if anew or not self._q or (at_rest and nearest + 1 >= len(self._q)):
            self._source, self._shape, self._q, self._sections, nearest = source, planner.mounted, [q], Sections(), 0
        self._drop(nearest)
        self._lay(planner, source)
        return self._sections

    def _nearest(self, q: NDArray[np.float64]) -> int:
        """Of the sections, that which `q` is the nearest to the beginning of, or the one before."""
        away = np.linalg.norm(np.array(self._q) - q, axis=1)
        return max(int(away.argmin()) - 1, 0)

    def _drop(self, count: int) -> None:
        count = min(count, len(self._sections))
        self._q, self._sections = self._q[count:], self._sections[count:]

    def _lay(self, planner: Planner, source: JogSource) -> None:
        model = planner.model
        low, high = model.limits.position.T
        while len(self._sections) * _LENGTH_M < _AHEAD_M:
            q = self._q[-1]
            try:
                half = _step(planner, source, q) / 2.0
                onward = np.clip(q + _step(planner, source, q + half), low, high)
                way = np.stack([q, (q + onward) / 2.0, onward])
                first, middle, last = transform_points(planner.pose_world_base, model.capsules(way))
            except (NoDirection, OpenMechanism):
                return
            moved = float(np.linalg.norm([first - middle, last - middle], axis=-1).max())
            if moved < _TINY:
                return
            radii = model.capsule_radii + FOLLOWING_M + moved + _BESIDE_M
            self._sections = self._sections.joined(of_points(middle[None], radii))
            self._q.append(onward)


def _step(planner: Planner, source: JogSource, q: NDArray[np.float64]) -> NDArray[np.float64]:
    """What the joints move `(n,)` in the direction that the wish has at `q`, for a section's length."""
    lead = source.lead(q)
    small = lead * (_TINY / max(float(np.abs(lead).max()), _TINY))
    ends = planner.model.capsules(np.stack([q, q + small]))
    moved = float(np.linalg.norm(ends[1] - ends[0], axis=-1).max())
    return np.asarray(small * (_LENGTH_M / moved)) if moved > 0.0 else np.zeros_like(q)
