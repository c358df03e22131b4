"""A zone as whoever judges a simulated cell looks at it."""

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from cell.config.settings import ZoneSettings
from cell.geometry import Solid, SpaceOf, capsules_touch
from cell.messages import ZoneGeometry

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Volume:
    """Where a zone is, and what of a robot is inside."""

    solid: Solid
    of: SpaceOf

    @classmethod
    def at(cls, zone: ZoneSettings) -> Self:
        place = zone.pose.position_m, zone.pose.quaternion_xyzw
        return cls(ZoneGeometry(zone.name, 1, zone.size_m, *place, zone.robots, zone.shape).solid(), zone.of)

    def touched(self, points: Floats, radii: Floats, tcp: Floats) -> NDArray[np.bool_]:
        """Which of the real bodies are inside, `(m,)`: capsules `(m, c, 2, 3)` [m], TCPs `(m, 3)` [m]."""
        if self.of is SpaceOf.TCP:
            return capsules_touch(np.stack([tcp, tcp], axis=1), np.zeros(len(tcp)), self.solid)
        return np.asarray(capsules_touch(points, radii, self.solid).any(axis=-1))
