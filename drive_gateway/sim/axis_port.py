"""What the drive's own trajectories need of the axis."""

from typing import Protocol


class AxisPort(Protocol):
    """Position [counts] and velocity [counts/s] of the axis itself, and its demand."""

    @property
    def position(self) -> float: ...
    @property
    def velocity(self) -> float: ...
    def interpolate(self, target: float, period_s: float) -> None:
        """The demand runs from where it is to `target` within `period_s`."""
