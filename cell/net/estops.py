"""The software emergency stops of the cell as each of its processes keeps them."""

from collections.abc import Iterable

from cell.messages import Estop


class Estops:
    """Several stops may be in force at once, each until it is cleared by its id, which then means nothing any more."""

    def __init__(self, in_force: Iterable[Estop] = (), cleared: Iterable[str] = ()) -> None:
        self._in_force = {estop.id: estop for estop in in_force}
        self._cleared = set(cleared)

    @property
    def in_force(self) -> tuple[Estop, ...]:
        """Oldest first; while there is one the robots stand."""
        return tuple(self._in_force.values())

    @property
    def first(self) -> Estop | None:
        """The oldest stop in force."""
        return next(iter(self._in_force.values()), None)

    def hear(self, estop: Estop) -> bool:
        """Take a stop or its clearing; true when this changes what is in force."""
        if estop.active:
            known = estop.id in self._in_force or estop.id in self._cleared
            if not known:
                self._in_force[estop.id] = estop
            return not known
        self._cleared.add(estop.id)
        return self._in_force.pop(estop.id, None) is not None

    def was_cleared(self, estop_id: str) -> bool:
        """Whether this stop has ended for ever."""
        return estop_id in self._cleared
