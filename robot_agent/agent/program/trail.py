"""The motions that a run of a program has done, so that the robot may go back over them, and on again."""

from collections import deque

from robot_agent.agent.planning.plans import Planned
from robot_agent.trajectory import Motion

_MOST = 50
_MOST_S = 60.0
"""So many motions are kept, and so much of them beside the newest one."""


class Trail:
    """Each motion begins where the one before it ends, and with the same mounted; the newest is the present one."""

    def __init__(self) -> None:
        self._motions: deque[Planned] = deque(maxlen=_MOST)
        self._outdated: tuple[Motion, ...] = ()
        """Nobody goes back on these any more: they were planned when things stood elsewhere."""

    def forget(self) -> None:
        """There is no way back to what was done so far; the robot is on nothing of it."""
        self._motions.clear()
        self._outdated = ()

    def outdate(self) -> None:
        """Things stand elsewhere from now on: the robot goes on from where it is, and back on nothing of it."""
        self._outdated = tuple(each.motion for each in self._motions)

    def begun(self, planned: Planned) -> None:
        """The robot is on it, and will not go back to the one before but over its beginning."""
        self._motions.append(planned)
        while sum(each.motion.duration_s for each in self._motions) - planned.motion.duration_s > _MOST_S:
            self._motions.popleft()

    def extended(self, longer: Planned) -> None:
        """The present motion is this one from here on."""
        if longer.first_tau > 0.0:
            self._motions.clear()
        elif self._motions:
            self._motions.pop()
        self._motions.append(longer)

    def behind(self, path: Planned) -> bool:
        """Whether a motion comes before the present one."""
        index = self._index(path)
        return index is not None and index + 1 < len(self._motions)

    def before(self, path: Planned) -> Planned | None:
        """The motion that ends where this one begins."""
        index = self._index(path)
        found = self._motions[index - 1] if index else None
        return None if found is None or any(found.motion is old for old in self._outdated) else found

    def after(self, path: Planned) -> tuple[Planned, ...]:
        """Those that come after a motion, up to the present one."""
        index = self._index(path)
        return () if index is None else tuple(self._motions)[index + 1 :]

    def _index(self, path: Planned) -> int | None:
        return next((index for index, each in enumerate(self._motions) if each.motion is path.motion), None)
