"""Keeps the robots of a cell apart: from their presences to clearances, and what people are told of it."""

from collections.abc import Iterable

from cell.config.settings import CellSettings
from cell.manager.separation.ledger import Ledger
from cell.manager.separation.nearness import Nearness
from cell.manager.separation.order import Order
from cell.manager.setup_turns import SetupNews
from cell.messages import Clearance, PlannedWay, Presence, Severity


class Separation:
    """Of one manager."""

    def __init__(self, settings: CellSettings, boot: str, epoch: int) -> None:
        """`settings` say by how much robots keep apart."""
        if settings.separation is None:
            raise ValueError("a cell that does not keep its robots apart")
        self._links: dict[str, tuple[str, ...]] = {}
        self._fixed: dict[str, frozenset[int]] = {}
        self._beside: set[str] = set()
        """Robots that were last heard where nothing was reserved for them."""
        margins = {frozenset(pair.robots): pair.margin_m for pair in settings.separation.pairs}
        nearness = Nearness(
            settings.separation.margin_m, margins, lambda robot: self._fixed.get(robot, frozenset()), self._link
        )
        self._order = Order(nearness)
        self._ledger = Ledger(settings.robots, boot, epoch, nearness, self._order)

    def planned(self, way: PlannedWay) -> None:
        """Take what a robot has planned."""
        self._order.planned(way)

    def hear(self, presence: Presence) -> Iterable[SetupNews]:
        """Take a presence, whatever its age; what there is to tell of it."""
        robot = presence.robot
        if presence.way.links:
            self._links[robot], self._fixed[robot] = presence.way.links, frozenset(presence.way.fixed)
        if not self._ledger.hear(presence):
            self._beside.discard(robot)
        elif robot not in self._beside:
            self._beside.add(robot)
            text = f"{robot} is where nothing was cleared for it: others keep away from there now"
            remedy = f"it left its path by a quick stop, or was pushed: look at it, then `cell return {robot}`"
            yield SetupNews(Severity.WARNING, "space_forced", text, remedy)

    def clear(self) -> list[Clearance]:
        """Answers to what was asked for since the last call."""
        return self._ledger.clear()

    def _link(self, robot: str, capsule: int) -> str:
        links = self._links.get(robot, ())
        return links[capsule] if capsule < len(links) else f"link {capsule}"
