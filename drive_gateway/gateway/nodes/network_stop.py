"""The last means of software against a drive that does not stop: NMT stop of its node.

In the network state Stopped a node takes no process data, and its drive does what its 6007h says: a quick stop. The
node says nothing about its axes then, so after a while it is brought up again to be measured.
"""

from drive_gateway.canopen.frame import CanFrame
from drive_gateway.canopen.nmt import NmtCommand, NmtState, nmt_frame

REPEAT_S = 0.05
"""NMT is not confirmed: the command is repeated until a heartbeat shows the state."""


class NetworkStop:
    """Of one node."""

    def __init__(self, node_id: int) -> None:
        self._frame = nmt_frame(NmtCommand.STOP, node_id)
        self._until = 0.0
        self._due = 0.0
        self.active = False
        """The node was stopped and has not been brought up since."""

    def begin(self, now: float, lasts_s: float) -> None:
        """Stop the node; after `lasts_s` its drives must stand, if they stand at all."""
        self.active = True
        self._due, self._until = now, now + lasts_s

    def end(self) -> None:
        """The node is brought up again."""
        self.active = False

    def over(self, now: float) -> bool:
        """It is time to look what came of it."""
        return self.active and now >= self._until

    def frames(self, now: float, nmt: NmtState | None) -> list[CanFrame]:
        """What is to be sent in this cycle; `nmt` is what the node's newest heartbeat says."""
        if nmt is NmtState.STOPPED or not self._due <= now < self._until:
            return []
        self._due = now + REPEAT_S
        return [self._frame]
