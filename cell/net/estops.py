"""The software emergency stops of the cell as each of its processes keeps them."""

from collections.abc import Iterable

from cell.messages import Estop, Heard, ManagerState

MOST_LISTED = 24
"""So many stops the manager lists one by one (`cell.manager.listed_estops`); a cell stands under one as under many."""
MOST_OBEYED = 12
"""So many an agent or a gateway keeps one by one. Fewer than are listed: it keeps the oldest ones, and whoever comes
later takes the place of a newer one."""
REMEMBERED = 1000
"""So many ids of stops that are over. An older one that comes again is a new stop."""


class Estops:
    """Several stops may be in force at once, each until it is cleared by its id, which then means nothing any more."""

    def __init__(self, in_force: Iterable[Estop] = (), cleared: Iterable[str] = ()) -> None:
        """Both oldest first."""
        self._cleared = dict.fromkeys(cleared)
        self._in_force: dict[str, Estop] = {}
        for estop in in_force:
            self.hear(estop)

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
        self._cleared[estop.id] = None
        if len(self._cleared) > REMEMBERED:
            del self._cleared[next(iter(self._cleared))]
        return self._in_force.pop(estop.id, None) is not None

    def was_cleared(self, estop_id: str | None) -> bool:
        """Whether this stop has ended for ever."""
        return estop_id in self._cleared


class ObeyedEstops(Estops):
    """As agents and gateways keep them: only the manager ends a stop, and only one that it knew of.

    Anybody may publish the end of a stop. It counts where a manager state answers an own message that named the stop,
    and does not list it: the manager that heard of it there has it in force, or had it cleared by an operator.

    Beyond `MOST_OBEYED` a stop is not kept: the process stands anyway, and the manager lists it again and again. The
    state that proves the last of the kept ones over is heard when there is room for all that it lists.
    """

    def __init__(self, boot: str) -> None:
        """`boot` is that of this process, whose messages name the stop under which it stands."""
        super().__init__()
        self._boot = boot
        self._named: dict[str, int] = {}
        self._over: set[str] = set()

    def named(self, estop_id: str, sequence: int) -> None:
        """The own message with `sequence` says that this process stands under a stop."""
        self._named.setdefault(estop_id, sequence)

    def answered(self, state: ManagerState, heard: Heard | None) -> None:
        """A manager state, and which own message it answers."""
        if heard is None or heard.boot != self._boot:
            return
        listed = {estop.id for estop in state.estops}
        for estop_id, sequence in self._named.items():
            if heard.sequence >= sequence and estop_id not in listed:
                self._over.add(estop_id)

    def hear(self, estop: Estop) -> bool:
        """Take a stop, or its end where it is one; true when this changes what is in force."""
        if estop.active:
            return len(self._in_force) < MOST_OBEYED and super().hear(estop)
        if estop.id not in self._over:
            return False
        self._over.discard(estop.id)
        self._named.pop(estop.id, None)
        return super().hear(estop)
