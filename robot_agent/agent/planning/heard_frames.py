"""Where the frames are in which the things of the cell stand: from the manager, and from nowhere else."""

from collections.abc import Iterable

from cell.config.settings import ThingSettings
from cell.messages import FramePose, ManagerState


class HeardFrames:
    """The newest version of each frame that this robot's plans need."""

    def __init__(self, things: Iterable[ThingSettings]) -> None:
        self._needed = frozenset(thing.in_frame.frame for thing in things if thing.in_frame is not None)
        self._heard: dict[str, FramePose] = {}

    def heard(self, frame: FramePose) -> bool:
        """Take a frame, unless it is not needed or no newer than the one that is known; whether it is news."""
        known = self._heard.get(frame.frame)
        if frame.frame not in self._needed or (known is not None and frame.version <= known.version):
            return False
        self._heard[frame.frame] = frame
        return True

    @property
    def present(self) -> tuple[FramePose, ...]:
        """All that are known."""
        return tuple(self._heard[name] for name in sorted(self._heard))

    def why_still(self, state: ManagerState | None) -> str:
        """Which frames are not known as the manager's newest state names them, for people; empty when all are."""
        in_force = {} if state is None else state.frames
        missing = sorted(
            name
            for name in self._needed
            if name not in self._heard or self._heard[name].version < in_force.get(name, 0)
        )
        return f"the manager has not said yet where frame {', '.join(missing)} is" if missing else ""
