"""The emergency stops in force as the manager lists them: few, whatever number was asked for."""

from collections.abc import Iterable
from dataclasses import replace

from cell.messages import Estop
from cell.messages.estop import LONGEST_WORDS
from cell.net.estops import MOST_LISTED, REMEMBERED, Estops

ONE_OF_MANY = " (one of many: `cell events` shows them)"


class ListedEstops(Estops):
    """At most `MOST_LISTED`. Beyond, a stop takes the place of a listed one, which is in force as long as it is.

    It takes that of the newest one with the same words, else of the newest one, so a script that stops the cell again
    and again hides nobody else's. It is listed under its own id: who was shown the other one does not clear it.
    """

    def __init__(self, in_force: Iterable[Estop] = (), cleared: Iterable[str] = ()) -> None:
        self._stands_for: dict[str, str] = {}
        """Stop that is not listed any more: the one that is listed instead. The oldest of too many are forgotten."""
        super().__init__(in_force, cleared)

    def holds(self, estop_id: str | None) -> bool:
        """Whether this stop is in force, listed or not."""
        return estop_id in self._in_force or estop_id in self._stands_for

    def hear(self, estop: Estop) -> bool:
        """Take a stop or its clearing; true when this changes what is listed."""
        if not estop.active:
            for each in [old for old, new in self._stands_for.items() if new == estop.id]:
                del self._stands_for[each]
                super().hear(replace(estop, id=each))
        elif self.holds(estop.id) or self.was_cleared(estop.id):
            return False
        elif len(self._in_force) >= MOST_LISTED:
            self._give_place(estop.id, self._least_missed(estop))
            estop = replace(estop, reason=_short(estop) + ONE_OF_MANY)
        return super().hear(estop)

    def _least_missed(self, estop: Estop) -> str:
        listed = self.in_force[::-1]
        return next((each.id for each in listed if _words(each) == _words(estop)), listed[0].id)

    def _give_place(self, new: str, old: str) -> None:
        del self._in_force[old]
        for each, instead in self._stands_for.items():
            if instead == old:
                self._stands_for[each] = new
        self._stands_for[old] = new
        if len(self._stands_for) > REMEMBERED // 2:
            del self._stands_for[next(iter(self._stands_for))]


def _short(estop: Estop) -> str:
    return estop.reason.removesuffix(ONE_OF_MANY)[: LONGEST_WORDS - len(ONE_OF_MANY)]


def _words(estop: Estop) -> tuple[str, str]:
    return estop.by, _short(estop)
