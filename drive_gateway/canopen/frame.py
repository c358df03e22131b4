"""One CAN frame, as the cores see it."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class CanFrame:
    """A classic CAN 2.0A frame: 11-bit identifier and at most eight bytes."""

    id: int
    data: bytes
    remote: bool = False
    """A remote frame asks for data and carries none."""
