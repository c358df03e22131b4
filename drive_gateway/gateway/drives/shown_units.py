"""The units that a drive says it takes velocities and accelerations in: 60A9h and 60AAh of drives that have them."""

import math

from drive_gateway.canopen.drive_objects import SI_ACCELERATION, SI_VELOCITY
from drive_gateway.canopen.sdo import Dialogue, SdoDone, SdoRead
from drive_gateway.config.drive_units import DriveUnits

SAME = 1e-3
"""Two units are one when they differ by no more than this share: 60A9h has no more digits than a manual."""


class ShownUnits:
    """Read once after each start of the drive, and compared with what the drives file says.

    They are only read: written, they would change what every other object of the drive means. Whoever wants another
    unit names the object under `objects` of the axis, which is written before everything else.
    """

    def __init__(self, label: str, units: DriveUnits) -> None:
        self._label = label
        self._units = units
        self._found: dict[int, str] = {}
        self._asked = {SI_VELOCITY, SI_ACCELERATION}

    @property
    def read(self) -> bool:
        """The drive has answered since its start."""
        return not self._asked

    @property
    def problem(self) -> str:
        """Which unit of the drive is another one, and what to do; empty when none is, or the drive says nothing."""
        return "; ".join(self._found.values())

    def dialogue(self) -> Dialogue:
        """The drive has started: what to read of it."""
        self._found.clear()
        self._asked = {SI_VELOCITY, SI_ACCELERATION}
        for index in (SI_VELOCITY, SI_ACCELERATION):
            self._take(index, (yield SdoRead(index, 0)))

    def _take(self, index: int, done: SdoDone) -> None:
        """Many drives have no such object, or leave it at zero: then only a motion tells."""
        self._asked.discard(index)
        if done.problem or not done.data:
            return
        code, units = int.from_bytes(done.data, "little"), self._units
        if index == SI_VELOCITY:
            what, key, stated, name = "velocities", "velocity_unit", units.velocity, units.velocity_name
            shown = units.shown_velocity(code)
        else:
            what, key, stated, name = "accelerations", "acceleration_unit", units.acceleration, units.acceleration_name
            shown = units.shown_acceleration(code)
        if shown is None or math.isclose(shown, stated, rel_tol=SAME):
            return
        self._found[index] = (
            f"{self._label} says by {index:04X}h ({code:08X}h) that one of its units of {what} is {shown:.6g} counts, "
            f"the drives file's is {stated:.6g} ({key}: {name}); correct {key}, or set {index:04X}h under objects"
        )
