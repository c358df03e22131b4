"""Who has control of the cell on this page: one browser at a time, visible to all, taken over only on purpose."""

from dataclasses import dataclass

from cell.view.gate import Level


@dataclass(frozen=True, slots=True)
class Visitor:
    """A browser that has come through the gate."""

    number: int
    address: str
    level: Level

    def __str__(self) -> str:
        return f"browser {self.number} at {self.address}"


class Control:
    """The holder, if there is one. It changes on the loop of the page's server alone; anybody may ask."""

    def __init__(self) -> None:
        self._holder: Visitor | None = None

    @property
    def holder(self) -> Visitor | None:
        """Who may give orders now."""
        return self._holder

    def take(self, visitor: Visitor) -> Visitor | None:
        """Give control to a visitor of level operate or more; who had it before. Raises `PermissionError`."""
        if visitor.level < Level.OPERATE:
            raise PermissionError("this address may only watch; open the page by the address for operating")
        before, self._holder = self._holder, visitor
        return before

    def leave(self, visitor: Visitor) -> None:
        """Give control back, if this visitor has it: a browser that goes does so."""
        if self._holder == visitor:
            self._holder = None

    def may(self, visitor: Visitor, level: Level = Level.OPERATE) -> bool:
        """Whether an order of this level is taken from a visitor."""
        return self._holder == visitor and visitor.level >= level
