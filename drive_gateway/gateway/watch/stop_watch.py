"""Axes that were told to stop and do not: named, and stopped by the last means that software has."""

from collections.abc import Callable, Iterator, Sequence
from math import degrees

from drive_gateway.gateway.drives.drive import Drive
from drive_gateway.gateway.trouble import HARD_WIRED, Trouble


class StopWatch:
    """Of one robot. An axis is told of once; again when it moves on after it stood, or after its node was stopped."""

    def __init__(self, drives: Sequence[Drive]) -> None:
        self._drives = drives
        self._since: dict[Drive, float] = {}
        self._told: set[Drive] = set()

    def forget(self) -> None:
        """The robot stands, or something wants it to move."""
        self._since.clear()
        self._told.clear()

    def step(self, due: Callable[[Drive], bool], now: float) -> Iterator[Trouble]:
        """One cycle; `due` says of which drives nothing wants a motion. Drives that cannot be heard are waited for."""
        for drive in self._drives:
            if drive.rest.standing or not drive.operational or not due(drive):
                self._since.pop(drive, None)
                self._told.discard(drive)
                continue
            since = self._since.setdefault(drive, now)
            if drive not in self._told and drive.rest.moved_at > since + drive.rest.stop_s:
                self._told.add(drive)
                yield self._stop(drive, now)

    def _stop(self, drive: Drive, now: float) -> Trouble:
        unit, factor = ("mm/s", 1000.0) if drive.axis.linear else ("deg/s", degrees(1.0))
        moves = f"{drive.rest.stop_s:.2g} s later it still moves with {factor * abs(drive.velocity):.3g} {unit}"
        if drive.without_torque:
            text = f"{drive.label} has no torque and should stand, but {moves}: its brake does not hold"
            return Trouble("does_not_stop", text, f"{HARD_WIRED}, then secure the axis", drive.axis.node_id)
        text = f"{drive.label} was told to stop, but {moves}"
        remedy = f"{HARD_WIRED}; its node is stopped by NMT meanwhile, to which its drive should answer as 6007h says"
        drive.stop_by_network(now)
        return Trouble("does_not_stop", text, remedy, drive.axis.node_id)
