"""Node guarding, master side (CiA 301): a poll by remote frame, an answer whose toggle bit alternates."""

from drive_gateway.canopen.cob_id import ERROR_CONTROL
from drive_gateway.canopen.frame import CanFrame

_TOGGLE = 0x80


class Guarding:
    """Polls one node; `answered` takes the byte of its answer."""

    def __init__(self, node_id: int, period_s: float) -> None:
        self._poll = CanFrame(ERROR_CONTROL + node_id, b"", remote=True)
        self._period_s = period_s
        self._due = 0.0
        self._expected = 0

    def restart(self) -> None:
        """The node was reset: its first answer has the toggle bit clear."""
        self._due = 0.0
        self._expected = 0

    def poll(self, now: float) -> CanFrame | None:
        """The remote frame, when it is due."""
        if now < self._due:
            return None
        self._due = now + self._period_s
        return self._poll

    def answered(self, byte: int) -> bool:
        """Whether the answer is the next one; after a lost answer the node's toggle bit is believed again."""
        as_expected = byte & _TOGGLE == self._expected
        self._expected = (byte & _TOGGLE) ^ _TOGGLE
        return as_expected
