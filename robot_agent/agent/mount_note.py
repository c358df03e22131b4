"""A note in the state folder: what the robot carries may be something else than its robot file says."""

import logging
import os
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

_log = logging.getLogger(__name__)


class MountNote:
    """Of one robot, while its agent runs; on a thread of its own, so that no disk holds the agent up."""

    def __init__(self, folder: Path, robot: str) -> None:
        self._path = folder / f"robot-{robot}.mount-in-doubt"
        self.doubtful = self._path.exists()
        """As an agent before this one has left it."""
        self._writer = ThreadPoolExecutor(1, "mount-note")

    def keep(self, doubtful: bool) -> None:
        """Write the note soon, or take it away."""
        self._writer.submit(self._keep, doubtful)

    def close(self) -> None:
        """Wait until it is kept."""
        self._writer.shutdown()

    def _keep(self, doubtful: bool) -> None:
        try:
            if doubtful:
                self._path.write_text("a program that changes tool or part has begun, and not ended in order\n")
            else:
                self._path.unlink(missing_ok=True)
            folder = os.open(self._path.parent, os.O_RDONLY)
            try:
                os.fsync(folder)
            finally:
                os.close(folder)
        except OSError as error:
            _log.error("%s: %s; before the next start of this agent look what the robot carries", self._path, error)
