"""The frames of the cell: where each is, under which version, and how an operator moves one.

A frame is moved in the cell file first (`cell/manager/edits_on_disk.py`); then the running cell has it too.
So whatever happens in between, the next manager reads from the file what the cell was told, or was about to be told.
Nothing that every process takes from its own file may stand in it: zones, bases and conveyors move with a restart only.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from cell.config.settings import CellSettings, FrameSettings, Points, PoseSettings
from cell.core import Effect
from cell.geometry import compose, inverse, quaternion
from cell.messages import FramePose, PlaceFrame, TeachFrame

EDITS_PER_EPOCH = 1000
"""Versions of one run of the manager: its epoch, which only grows, times so much, and one more for each edit."""


@dataclass(frozen=True, slots=True)
class WriteFrame(Effect):
    """Write where a frame is into the cell file; `FramesWritten` or `FrameNotWritten` comes back."""

    file: Path
    frame: str
    place: PoseSettings | Points
    running: dict[str, FrameSettings]


@dataclass(frozen=True, slots=True)
class FramesWritten:
    """All frames as the cell file gives them now."""

    frames: dict[str, FrameSettings]


@dataclass(frozen=True, slots=True)
class FrameNotWritten:
    """The cell file stays as it is; why, for people."""

    reason: str


class Frames:
    """All frames in force."""

    def __init__(self, cell: CellSettings, epoch: int) -> None:
        self._file = cell.file
        self._frames = dict(cell.frames)
        self._epoch = epoch
        self._edits = 0
        self.versions = dict.fromkeys(cell.frames, epoch * EDITS_PER_EPOCH)

    @property
    def poses(self) -> list[FramePose]:
        """What is told of all frames."""
        return [
            FramePose(name, self.versions[name], frame.parent, frame.pose.position_m, frame.pose.quaternion_xyzw)
            for name, frame in self._frames.items()
        ]

    def why_not(self, name: str) -> str:
        """Why a frame cannot be moved while the cell runs, for people; empty when it can."""
        frame = self._frames.get(name)
        if frame is None:
            return f"no frame {name!r}; this cell has {', '.join(self._frames) or 'none'}"
        if frame.fixed:
            return (
                f"frame {name} does not move while the cell runs: in it is {', in it is '.join(frame.fixed)}, which "
                f"every process takes from its own cell file; end the cell, change {name} in the cell file on each "
                "computer, start it again"
            )
        if self._edits + 1 >= EDITS_PER_EPOCH:
            return f"{self._edits} frames were moved since the manager was started: start it again, then move {name}"
        return ""

    def write(self, command: PlaceFrame | TeachFrame) -> WriteFrame:
        """What is to be written for a command that nothing speaks against."""
        place: PoseSettings | Points
        if isinstance(command, PlaceFrame):
            place = PoseSettings(command.position_m, command.quaternion_xyzw)
        else:
            place = command.points_m if command.origin_m is None else (*command.points_m, command.origin_m)
        return WriteFrame(self._file, command.frame, place, dict(self._frames))

    def take(self, frames: dict[str, FrameSettings]) -> list[str]:
        """Take over what the file gives now; the names of those that moved, each under a new version."""
        moved = [name for name in self._frames if frames[name].pose != self._frames[name].pose]
        if moved:
            self._edits += 1
        self._frames = dict(frames)
        self.versions |= dict.fromkeys(moved, self._epoch * EDITS_PER_EPOCH + self._edits)
        return moved

    def way(self, name: str, frames: dict[str, FrameSettings]) -> str:
        """How far a frame is to move, for people."""
        change = compose(inverse(self._frames[name].pose.matrix()), frames[name].pose.matrix())
        w = min(float(quaternion.from_matrix(change[:3, :3])[3]), 1.0)
        far_mm, turned_deg = 1000.0 * float(np.linalg.norm(change[:3, 3])), float(np.degrees(2.0 * np.arccos(w)))
        return f"by {far_mm:.1f} mm and {turned_deg:.2f} deg"
