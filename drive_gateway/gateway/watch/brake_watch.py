"""Axes without torque that move: a holding brake that slips, or somebody who moves them."""

from collections.abc import Iterator, Sequence

from drive_gateway.gateway.drives.drive import Drive
from drive_gateway.gateway.trouble import Trouble


class BrakeWatch:
    """Of one robot that is switched off, but for axes that move by themselves in set-up.

    An axis is told of when it is farther than its following window from where it lost its torque, and again after as
    much; it is followed where it goes, and nothing is stopped, because nothing could.
    """

    def __init__(self, drives: Sequence[Drive]) -> None:
        self._drives = drives
        self._place: dict[Drive, int] = {}

    def step(self, off: bool) -> Iterator[Trouble]:
        """One cycle; `off`: the robot is switched off."""
        for drive in self._drives:
            if not off or not drive.operational or not drive.without_torque or drive.counts is None:
                self._place.pop(drive, None)
                continue
            way = drive.counts - self._place.setdefault(drive, drive.counts)
            far = abs(way) > drive.axis.following_window * abs(drive.axis.counts_per_unit)
            if far:
                self._place[drive] = drive.counts
                text = f"{drive.label} moves without torque: its brake does not hold, or somebody moves it"
                remedy = "keep away from below it and secure it before anything else; then look at its brake"
                yield Trouble("moves_without_torque", text, remedy, drive.axis.node_id)
