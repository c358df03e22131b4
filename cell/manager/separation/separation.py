"""Keeps the robots of a cell apart: from their presences to clearances, and what people are told of it."""

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

from cell.config.settings import CellSettings
from cell.manager.records import Assured
from cell.manager.separation.assurances import Assurances, Ended, Sighting
from cell.manager.separation.ledger import Ledger, Whereabouts
from cell.manager.separation.nearness import Nearness
from cell.manager.separation.order import Order
from cell.manager.separation.standoff import StandoffWatch
from cell.manager.separation.turn import Turn
from cell.messages import Clearance, Deadlock, PlannedWay, Presence, Refusal, Severity

_ASKS_S = 0.3
"""Who waits asks much more often than that."""


@dataclass(frozen=True, slots=True)
class SpaceNews:
    """For people."""

    severity: Severity
    code: str
    text: str
    remedy: str
    stops: bool = False
    """All robots must stop."""


class Separation:
    """Of one manager."""

    def __init__(self, settings: CellSettings, boot: str, epoch: int, stored: Iterable[Assured] = ()) -> None:
        """`settings` say by how much robots keep apart; `stored`: what operators said under a manager of before."""
        if settings.separation is None:
            raise ValueError("a cell that does not keep its robots apart")
        self._robots = frozenset(settings.robots)
        self._links: dict[str, tuple[str, ...]] = {}
        self._fixed: dict[str, frozenset[int]] = {}
        self._beside: set[str] = set()
        """Robots that were last heard where nothing was reserved for them."""
        self._breaching: set[str] = set()
        """Those of them that were in space of others, and were told of."""
        self._at_rest: dict[str, bool] = {}
        self._refused: dict[str, tuple[Refusal, float]] = {}
        """Who is cleared nothing, or granted no zone though it is free, why, and when it was told so last."""
        self.waiting: dict[str, Refusal] = {}
        """Who rests and is cleared nothing, and why."""
        margins = {frozenset(pair.robots): pair.margin_m for pair in settings.separation.pairs}
        nearness = Nearness(
            settings.separation.margin_m, margins, lambda robot: self._fixed.get(robot, frozenset()), self._link
        )
        self._order = Order(nearness)
        self._turn = Turn(self._order)
        self._ledger = Ledger(settings.robots, boot, epoch, nearness, self._order)
        ours = [each for each in stored if each.robot in self._robots]
        self.assurances = Assurances(self._ledger, ours, settings.times.moves_alone_s)
        self._tcp_m: dict[str, tuple[float, float, float] | None] = {}
        """By the newest presence of each."""
        self._standoffs = StandoffWatch(self._order.way_back_m, self._tcp_m.get)

    def planned(self, way: PlannedWay) -> None:
        """Take what a robot of the cell has planned."""
        if way.robot in self._robots:
            self._order.planned(way)

    def hear(self, presence: Presence) -> Iterable[SpaceNews]:
        """Take a presence of a robot of the cell, whatever its age; what there is to tell of it."""
        robot, way = presence.robot, presence.way
        if robot not in self._robots:
            return
        if way.links:
            self._links[robot], self._fixed[robot] = way.links, frozenset(way.fixed)
        self._at_rest[robot] = presence.stop_time_s == 0.0
        tcp = presence.body.tcp_m[:1].tolist()
        self._tcp_m[robot] = tuple(tcp[0]) if tcp else None
        where = self._ledger.hear(presence)
        reserved = where is Whereabouts.RESERVED
        other = "" if reserved else self._ledger.intruded(robot, presence.body, where)
        if reserved or (where is Whereabouts.APPEARED and not other):
            self._beside.discard(robot)
            self._breaching.discard(robot)
            return
        if other and robot not in self._breaching:
            self._breaching.add(robot)
            text = f"{robot} is in space that is cleared for {other}"
            remedy = f"look at the robots, then `cell reset`; jog {robot} away with `cell jog {robot}`"
            yield SpaceNews(Severity.ALARM, "space_breach", text, remedy, stops=True)
        elif robot not in self._beside:
            text = f"{robot} is where nothing was cleared for it: others keep away from there now"
            remedy = f"it left its path by a quick stop, or was pushed: look at it, then `cell return {robot}`"
            yield SpaceNews(Severity.WARNING, "space_forced", text, remedy)
        self._beside.add(robot)

    @property
    def standoffs(self) -> tuple[Deadlock, ...]:
        """Robots that wait for each other, as they were told."""
        return self._standoffs.present

    def follow(self, sightings: Mapping[str, Sighting], now: float) -> list[Ended]:
        """Take what is heard of the robots now: who is in set-up, and whose place operators have said in vain."""
        self._ledger.in_setup = next((robot for robot, each in sightings.items() if each.in_setup), "")
        return self.assurances.step(sightings, now)

    def hold(self, holders: Mapping[str, str | None]) -> None:
        """Who has which zone by now."""
        self._order.hold(holders)

    def why_not_grant(
        self, robot: str, zones: Sequence[str], going: Collection[str], cell_time: float
    ) -> Refusal | None:
        """Why a robot must not have these zones yet, so that all `going` get through; None: it may.

        Who is put off waits like one that is cleared no room.
        """
        refusal = self._order.why_not_grant(robot, zones, going)
        if refusal is None:
            return None
        self._turn.asked(robot, cell_time)
        return self._keep_in_mind(robot, refusal, cell_time)

    def clear(self, cell_time: float) -> tuple[list[Clearance], list[SpaceNews]]:
        """Answers to what was asked for since the last call, and what there is to tell."""
        self._turn.pass_on({robot: refusal for robot, (refusal, _) in self._refused.items()}, cell_time)
        clearances = [self._dated(each, cell_time) for each in self._ledger.clear()]
        for clearance in clearances:
            self._turn.answered(clearance, cell_time)
        lasting = {robot: each for robot, each in self._refused.items() if cell_time - each[1] <= _ASKS_S}
        self._refused = lasting
        self.waiting = {robot: refusal for robot, (refusal, _) in lasting.items() if self._at_rest.get(robot)}
        standoffs = self._standoffs.look(self.waiting, cell_time)
        return clearances, [SpaceNews(Severity.WARNING, "space_standoff", each.text, each.remedy) for each in standoffs]

    def _dated(self, clearance: Clearance, cell_time: float) -> Clearance:
        """With the time since which nothing has been cleared."""
        if clearance.refused is None or clearance.cleared > 0:
            self._refused.pop(clearance.robot, None)
            return clearance
        return replace(clearance, refused=self._keep_in_mind(clearance.robot, clearance.refused, cell_time))

    def _keep_in_mind(self, robot: str, refusal: Refusal, cell_time: float) -> Refusal:
        before = self._refused.get(robot)
        dated = replace(refusal, since=cell_time if before is None else before[0].since)
        self._refused[robot] = dated, cell_time
        return dated

    def _link(self, robot: str, capsule: int) -> str:
        links = self._links.get(robot, ())
        return links[capsule] if capsule < len(links) else f"link {capsule}"
