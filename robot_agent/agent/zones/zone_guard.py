"""Things, spaces and zones in the way of samples that no plan has checked: jogs and corrected paths."""

from collections.abc import Callable

from robot_agent.agent.planning.planner import ZONE_MARGIN_M, Planner
from robot_agent.agent.space.shared_space import SharedSpace
from robot_agent.agent.zones.zone_claims import ZoneClaims
from robot_agent.trajectory.sources import States
from robot_agent.workspace import Cover, sweep

_WANTED_S = 1.0
"""A zone stays asked for so long after samples have last been in front of it."""


class ZoneGuard:
    """Closes the way into things, out of spaces, and into zones without a grant; remembers for which of them to ask."""

    def __init__(self, zones: ZoneClaims, space: SharedSpace) -> None:
        self._zones = zones
        self._space = space
        self._now = 0.0
        self._ahead: dict[str, float] = {}

    def at(self, now: float) -> None:
        """What is looked at from here on is looked at `now` [s]."""
        self._now = now

    def forget(self) -> None:
        """Ask for nothing any more."""
        self._ahead.clear()

    @property
    def wants(self) -> dict[str, float]:
        """The zones in front of the robot: seconds until they are entered, which is 0."""
        return {zone: 0.0 for zone, at in self._ahead.items() if self._now - at < _WANTED_S}

    def clear_for(self, planner: Planner) -> Callable[[States], str]:
        """What judges the samples of a robot."""

        def clear(states: States) -> str:
            """The thing that states would touch, the space or the zone that is closed to them."""
            links = planner.model.links(states.q)
            base, spaces = planner.pose_world_base, planner.spaces
            path = sweep(planner.model, base, states.q, links)
            watched = spaces.watched(path, base, planner.model.tcp_at(links[:, -1])) if spaces else path
            cover = Cover.of_block(watched)
            if reason := planner.things.in_the_way(path, cover) or self._space.outside(path):
                return reason
            if spaces:
                off = self._zones.spaces.off(self._now)
                if border := spaces.in_the_way(watched, off, cover):
                    return border
                haste = spaces.haste(base, states.q, states.qd, off)
                if haste[1:].max(initial=0.0) > max(1.0, haste[0]):
                    return "the TCP at the speed of a slow space"
            crossed = self._zones.crossed(path, ZONE_MARGIN_M)
            if crossed is None:
                return "the zones of the cell have not been heard yet"
            self._ahead.update(dict.fromkeys(crossed, self._now))
            closed = (zone for zone in crossed if not self._zones.permitted(zone, self._now))
            return next(map(self._zones.why_not, closed), "")

        return clear
