"""What one robot may use of the cell's space, under one claim (`docs/architecture.md`, section 4.5)."""

from collections import OrderedDict
from collections.abc import Sequence
from typing import Self

from cell.messages.sections import Clearance

_ASKS = 200
"""So many presences are remembered with what they asked for; a later answer counts as none."""


class OwnedSpace:
    """Sections by their ids. What is owned is a stretch of the way from where the robot is measured on."""

    def __init__(self, owner: int, epoch: int) -> None:
        """`owner` numbers the claim, `epoch` is the highest that the gateway has heard of."""
        self.owner = owner
        self.epoch = epoch
        """Of the newest manager known; what an earlier one clears counts no more."""
        self.taken = 0
        """Number of that manager's newest clearance that was taken."""
        self.ids: frozenset[int] = frozenset()
        """Of what is owned."""
        self._asked: OrderedDict[int, tuple[int, ...]] = OrderedDict()
        """By sequence of a presence, what it asked for."""

    def claimed(self, owner: int, epoch: int) -> Self:
        """Of a new claim, which owns nothing; what earlier managers cleared stays over."""
        return type(self)(owner, max(epoch, self.epoch))

    def heard_epoch(self, epoch: int) -> None:
        """A manager of this epoch lives; a newer one counts its clearances anew."""
        if epoch > self.epoch:
            self.epoch, self.taken = epoch, 0
            self._asked.clear()

    def take(self, clearance: Clearance) -> bool:
        """Take a clearance, unless it is old: of an earlier manager or claim, or confirmed already."""
        self.heard_epoch(clearance.epoch)
        if clearance.epoch < self.epoch or clearance.owner != self.owner or clearance.number <= self.taken:
            return False
        self.taken = clearance.number
        asked = self._asked.get(clearance.presence, ())
        self.ids |= frozenset(asked[: clearance.cleared])
        return True

    def follow(self, way: Sequence[int], committed: int, *, renounce: bool = False) -> int:
        """How much of its way a robot owns: from where it is measured on, as far as it goes without a gap.

        Whatever else it owned is given up, with `renounce` also what lies beyond the first `committed` sections, which
        it may pass by what was sent. Those it has in any case.
        """
        owned = committed
        while not renounce and owned < len(way) and way[owned] in self.ids:
            owned += 1
        self.ids = frozenset(way[:owned])
        return owned

    def ask(self, presence: int, sections: Sequence[int]) -> None:
        """A presence with this sequence asks for the sections that come after those that are owned."""
        self._asked[presence] = tuple(sections)
        while len(self._asked) > _ASKS:
            self._asked.popitem(last=False)
