"""When positions are stored: the robot stands, no drive has torque, and all brakes have had the time to close.

When it gets torque that is stored too, so that after a gateway's sudden end nobody takes a motion for a lost turn.
"""

from collections.abc import Iterable, Sequence

from cell.core import Effect
from drive_gateway.gateway.drives.drive import Drive
from drive_gateway.gateway.effects import StorePosition
from drive_gateway.gateway.reference.encoder_record import EncoderRecord


class PositionKeeper:
    """Of one robot."""

    def __init__(self, robot: str, nodes: Sequence[Drive]) -> None:
        self._robot = robot
        self._nodes = nodes
        self._off_since: float | None = None
        self._brake_s = max(node.axis.brake_s for node in nodes)

    def step(self, off: bool, now: float) -> list[Effect]:
        """`off`: measured at rest and without torque."""
        if not off:
            self._off_since = None
            driven = [node for node in self._nodes if node.operational and not node.without_torque]
            return self._stores((node, node.reference.used()) for node in driven)
        if self._off_since is None:
            self._off_since = now
        if now - self._off_since < self._brake_s:
            return []
        return self._stores(
            (node, node.reference.record(node.counts)) for node in self._nodes if node.counts is not None
        )

    def _stores(self, records: Iterable[tuple[Drive, EncoderRecord | None]]) -> list[Effect]:
        return [
            StorePosition(f"{self._robot}.{node.axis.name}", record) for node, record in records if record is not None
        ]
