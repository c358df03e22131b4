"""When positions are stored: the robot stands, no drive has torque, and all brakes have had the time to close."""

from collections.abc import Sequence

from cell.core import Effect
from drive_gateway.gateway.drive import Drive
from drive_gateway.gateway.effects import StorePosition

BRAKE_S = 0.3
"""Longest overlap of motor and brake: after it the brake holds alone."""


class PositionKeeper:
    """Of one robot."""

    def __init__(self, robot: str, nodes: Sequence[Drive]) -> None:
        self._robot = robot
        self._nodes = nodes
        self._off_since: float | None = None

    def step(self, off: bool, now: float) -> list[Effect]:
        """`off`: measured at rest and without torque."""
        if not off:
            self._off_since = None
            return []
        if self._off_since is None:
            self._off_since = now
        if now - self._off_since < BRAKE_S:
            return []
        records = [(node, node.reference.record(node.counts)) for node in self._nodes if node.counts is not None]
        return [
            StorePosition(f"{self._robot}.{node.axis.name}", record) for node, record in records if record is not None
        ]
