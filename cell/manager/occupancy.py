"""Where a zone is, and which bodies touch it."""

import zlib

from cell.config.settings import ZoneSettings
from cell.geometry import body_touches
from cell.messages import Body, ZoneGeometry


class ZoneSpace:
    """The solid of one zone. Answers are remembered for each robot's newest body, which is asked about often."""

    def __init__(self, zone: ZoneSettings) -> None:
        self.geometry = ZoneGeometry(
            zone=zone.name,
            version=_version(zone),
            size_m=zone.size_m,
            position_m=zone.pose.position_m,
            quaternion_xyzw=zone.pose.quaternion_xyzw,
            robots=zone.robots,
            shape=zone.shape,
            of=zone.of,
        )
        self._solid = self.geometry.solid()
        self._known: dict[str, tuple[Body, bool]] = {}

    def touched_by(self, robot: str, body: Body) -> bool:
        """Whether the space that `robot`, or its TCP, may occupy touches the zone."""
        known = self._known.get(robot)
        if known is None or known[0] is not body:
            known = self._known[robot] = (body, body_touches(body, self._solid, self.geometry.of))
        return known[1]


def _version(zone: ZoneSettings) -> int:
    """The same number for the same geometry, over restarts too, so that plans stay valid when a manager returns."""
    meaning = (zone.shape, zone.size_m, zone.pose.position_m, zone.pose.quaternion_xyzw, zone.robots, zone.of.value)
    return zlib.crc32(repr(meaning).encode())
