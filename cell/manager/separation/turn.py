"""Whose turn it is: who has been cleared nothing for long goes before all who need not get through before it.

Without that two robots that pass through the middle again and again, one after the other, may keep a third one out of
it for ever.
"""

from collections.abc import Mapping
from math import inf

from cell.manager.separation.order import Order
from cell.messages import Clearance, Refusal

PATIENCE_S = 2.0
"""So long a robot is cleared nothing before it is its turn. Who is in its way and was cleared nothing for so long is
not about to leave it: then it is no use to keep others out, and they may be whom that one waits for."""
_ASKS_S = 0.3
"""Who wants to go on asks much more often than that."""


class Turn:
    """Remembers who was answered when, and says whose turn it is."""

    def __init__(self, order: Order) -> None:
        self._order = order
        self._asked: dict[str, float] = {}
        self._cleared: dict[str, float] = {}
        """When each robot was cleared something last [s]."""

    def asked(self, robot: str, now: float) -> None:
        """Somebody asks for room, or for a zone; `now` is cell time [s]."""
        self._asked[robot] = now

    def answered(self, clearance: Clearance, now: float) -> None:
        """Take an answer; `now` is cell time [s]."""
        self.asked(clearance.robot, now)
        if clearance.cleared > 0:
            self._cleared[clearance.robot] = now

    def pass_on(self, refused: Mapping[str, Refusal], now: float) -> None:
        """Give the order a turn that is due, and end one that is over.

        It lasts until its robot has got through to where nobody else has to pass, or asks for nothing any more.
        `refused`: who was cleared nothing by its newest answer, why, and since when.
        """
        turn = self._order.turn
        asks = now - self._asked.get(turn, -inf) <= _ASKS_S
        if asks and self._is_of_use(turn, now) and (turn in refused or not self._order.is_clear(turn)):
            return
        due = [
            (refusal.since, robot)
            for robot, refusal in refused.items()
            if now - refusal.since >= PATIENCE_S and self._order.plans(refusal.by) and self._is_of_use(robot, now)
        ]
        self._order.turn = min(due)[1] if due else ""

    def _is_of_use(self, robot: str, now: float) -> bool:
        """Whether all go on that must get through before it and wait for nobody; and there are such, or it is next."""
        first = self._order.goes_first(robot)
        going = (each for each in first if each != robot)
        return bool(first) and all(now - self._cleared.get(each, -inf) < PATIENCE_S for each in going)
