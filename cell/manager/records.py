"""What must outlive the manager, and the effect that stores it."""

from dataclasses import dataclass

from cell.core import Effect
from cell.messages import Assurance, Estop, Sections


@dataclass(frozen=True, slots=True)
class EstopLatched:
    """An emergency stop came into force, and is listed."""

    estop: Estop
    instead_of: tuple[str, ...] = ()
    """Stops that are not listed any more: this one stands for them."""

    def __str__(self) -> str:
        return f"emergency stop {self.estop.id}, unless a robot or gateway that stands under it is heard"


@dataclass(frozen=True, slots=True)
class EstopCleared:
    """An operator cleared an emergency stop; its id is never accepted again."""

    id: str
    by: str

    def __str__(self) -> str:
        return f"that {self.by} cleared emergency stop {self.id}: it would be in force again"


@dataclass(frozen=True, slots=True)
class ZoneDecided:
    """An operator cleared a zone, had it adopted, or changed it."""

    zone: str
    decision: str
    by: str
    found: str
    """What the manager answered."""

    def __str__(self) -> str:
        return f"that {self.by} had zone {self.zone} {self.decision}"


@dataclass(frozen=True, slots=True, eq=False)
class Assured:
    """An operator said where a robot stays that does not tell it itself."""

    robot: str
    assurance: Assurance
    place: Sections
    """All that a robot which stands was in when it was last known; empty with a box."""

    def __str__(self) -> str:
        return f"that {self.assurance.by} said where {self.robot} stays: all wait for it again"


@dataclass(frozen=True, slots=True)
class AssuranceEnded:
    """The robot tells itself where it is, or an operator took the word back."""

    robot: str

    def __str__(self) -> str:
        return f"that what was said of where {self.robot} stays is over: `cell confine {self.robot} off`"


Record = EstopLatched | EstopCleared | ZoneDecided | Assured | AssuranceEnded


@dataclass(frozen=True, slots=True)
class Store(Effect):
    """Write `record` to the journal, after those before it and as soon as the disk lets it; nothing waits for that."""

    record: Record


@dataclass(frozen=True, slots=True)
class JournalFailed:
    """The journal could not be written; `unsaved` waits, and is tried again."""

    reason: str
    unsaved: tuple[Record, ...]


@dataclass(frozen=True, slots=True)
class JournalWritten:
    """After a failure: everything is on disk."""


@dataclass(frozen=True, slots=True)
class Stored:
    """What the journal holds at the start: the newest epoch, the latched stops and the ids of the newest that were
    cleared, both oldest first, and what operators have said of where robots stay."""

    epoch: int = 0
    estops: tuple[Estop, ...] = ()
    cleared: tuple[str, ...] = ()
    assured: tuple[Assured, ...] = ()


def next_epoch(stored: int, unix_s: float) -> int:
    """The epoch of a manager that starts now: it grows even when its state folder was lost, or its clock set back."""
    return max(stored + 1, int(1000.0 * unix_s))
