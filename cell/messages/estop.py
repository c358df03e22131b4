"""The software emergency stop. It supports and never replaces a hard-wired one."""

from dataclasses import dataclass

from cell.messages.common import Name
from cell.messages.state import Urgency, state

LONGEST_WORDS = 500
"""Of `by` and `reason`, in characters: for people who hurry."""


@state("estop", Urgency.REAL_TIME)
@dataclass(frozen=True, slots=True)
class Estop:
    """A latched stop of the whole cell. Anyone sends it; only the manager's `reset` clears it, by the same id.

    Several may be in force; while one is, the cell stands. An id that was once cleared is never accepted again, so a
    late copy of an old stop does nothing. A text that is too long is cut and refuses no stop.
    """

    id: Name
    active: bool
    by: str
    reason: str

    def __post_init__(self) -> None:
        object.__setattr__(self, "by", self.by[:LONGEST_WORDS])
        object.__setattr__(self, "reason", self.reason[:LONGEST_WORDS])
