"""Where the frames are in which things stand and programs move: from the manager, and from nowhere else."""

from collections.abc import Collection, Iterable

from cell.config.settings import ThingSettings
from cell.messages import FramePose, ManagerState


class HeardFrames:
    """The newest version of each frame that this robot's plans need."""

    def __init__(self, frames: Collection[str], things: Iterable[ThingSettings], named: Iterable[str] = ()) -> None:
        """`frames` are those of the cell, `named` those of the program and of its points."""
        self._of_cell = frozenset(frames)
        self._of_things = frozenset(thing.in_frame.frame for thing in things if thing.in_frame is not None)
        self._needed = self._of_things.union(named)
        self._heard: dict[str, FramePose] = {}

    def need(self, named: Iterable[str]) -> None:
        """From now on the program and its points name these."""
        self._needed = self._of_things.union(named)

    def heard(self, frame: FramePose) -> bool:
        """Take a frame of the cell, unless it is no newer than what is known; whether it is news that is needed."""
        if frame.frame not in self._of_cell:
            return False
        known = self._heard.get(frame.frame)
        if known is not None and frame.version <= known.version:
            return False
        self._heard[frame.frame] = frame
        return frame.frame in self._needed

    @property
    def present(self) -> tuple[FramePose, ...]:
        """All that are needed and known."""
        return tuple(self._heard[name] for name in sorted(self._needed & self._heard.keys()))

    def of(self, name: str) -> FramePose | None:
        """A frame, needed or not; None where the manager has not said where it is."""
        return self._heard.get(name)

    def why_still(self, state: ManagerState | None) -> str:
        """Which frames are not known as the manager's newest state names them, for people; empty when all are."""
        in_force = {} if state is None else state.frames
        missing = sorted(
            name
            for name in self._needed
            if name not in self._heard or self._heard[name].version < in_force.get(name, 0)
        )
        return f"the manager has not said yet where frame {', '.join(missing)} is" if missing else ""
