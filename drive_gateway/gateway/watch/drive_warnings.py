"""Warnings of drives (bit 7 of the statusword) for people: told once, not each time a value passes its limit."""

from collections.abc import Sequence

from drive_gateway.gateway.drives.drive import Drive
from drive_gateway.gateway.event_log import EventLog

QUIET_S = 10.0
"""A warning that is gone for this long is over."""


class DriveWarnings:
    """Of the drives of one robot."""

    def __init__(self, drives: Sequence[Drive], log: EventLog) -> None:
        self._drives = drives
        self._log = log
        self._last_s: dict[str, float] = {}
        """When each axis that warns did so last."""

    def step(self, now: float) -> None:
        """Look at what the drives show in this cycle."""
        for drive in self._drives:
            if drive.warns:
                if drive.label not in self._last_s:
                    self._begin(drive)
                self._last_s[drive.label] = now
            elif now - self._last_s.get(drive.label, now) > QUIET_S:
                del self._last_s[drive.label]
                self._log.info("drive_warning_over", f"{drive.label} warns no more")

    def _begin(self, drive: Drive) -> None:
        text = f"{drive.label} warns (statusword bit 7): near a limit of its own, or one direction is blocked"
        remedy = f"read its display; if it is hot or overloaded: cell override {drive.robot} 50, or look at its load"
        self._log.warn("drive_warning", text, remedy)
