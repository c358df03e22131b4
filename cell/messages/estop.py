"""The software emergency stop. It supports and never replaces a hard-wired one."""

from dataclasses import dataclass

from cell.messages.common import Name, Words
from cell.messages.state import Urgency, state


@state("estop", Urgency.REAL_TIME)
@dataclass(frozen=True, slots=True)
class Estop:
    """A latched stop of the whole cell. Anyone sends it; only the manager's `reset` clears it, by the same id.

    Several may be in force; while one is, the cell stands. An id that was once cleared is never accepted again, so a
    late copy of an old stop does nothing.
    """

    id: Name
    active: bool
    by: Words
    reason: Words
