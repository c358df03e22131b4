"""The latched emergency stop of the cell. It supports and never replaces a hard-wired one."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

from cell.core import Answer, Effect, Publish
from cell.manager.records import EstopCleared, EstopLatched, Store, Stored
from cell.messages import Estop, Reply

_REPEAT_S = 0.05
_REPEAT_CLEARED_S = 2.0
_CONFIRM_WITHIN_S = 1.0


@dataclass(frozen=True, slots=True)
class _Waiting:
    """A call whose answer names who confirmed."""

    request_id: str
    call_id: str
    done: str
    stopping: bool
    until: float


class EstopLatch:
    """All stops that are in force; more than one may be, when several people press at once."""

    def __init__(self, stored: Stored) -> None:
        self._active = {estop.id: estop for estop in stored.estops}
        self._cleared = set(stored.cleared)
        self._repeat_cleared: dict[str, tuple[Estop, float]] = {}
        self._waiting: list[_Waiting] = []
        self._due = 0.0

    @property
    def estop(self) -> Estop | None:
        """The first stop in force."""
        return next(iter(self._active.values()), None)

    def in_force(self, estop_id: str) -> bool:
        """Whether the stop with this id is set."""
        return estop_id in self._active

    def latch(self, estop: Estop, now: float) -> list[Effect]:
        """Bring a stop into force, unless it is already, or was cleared before."""
        if not estop.active or estop.id in self._active:
            return []
        if estop.id in self._cleared:
            self._tell_again(estop, now)
            return []
        self._active[estop.id] = estop
        self._due = now
        return [Store(EstopLatched(estop))]

    def heard_confirmation(self, estop_id: str | None, who: str, now: float) -> list[Effect]:
        """Somebody stands under this stop: news if the manager missed the stop itself, or they its end."""
        if estop_id is None:
            return []
        return self.latch(Estop(estop_id, True, who, f"{who} stands under a stop that was set elsewhere"), now)

    def clear(self, by: str, now: float) -> list[Effect]:
        """An operator's reset: every stop ends and its id is never accepted again."""
        effects: list[Effect] = [Store(EstopCleared(estop_id, by)) for estop_id in self._active]
        for estop in self._active.values():
            self._cleared.add(estop.id)
            self._tell_again(estop, now)
        self._active.clear()
        self._due = now
        return effects

    def answer_when_confirmed(self, request_id: str, call_id: str, done: str, stopping: bool, now: float) -> None:
        """Answer a call once everyone follows (`stopping`: stands under the stop; else: has dropped it), or in 1 s."""
        self._waiting.append(_Waiting(request_id, call_id, done, stopping, now + _CONFIRM_WITHIN_S))

    def step(self, acknowledged: Mapping[str, str | None], silent: list[str], now: float) -> list[Effect]:
        """Repeat what is in force, and what was cleared lately, at 20 Hz; answer who waits."""
        effects: list[Effect] = []
        if now >= self._due:
            self._due = now + _REPEAT_S
            self._repeat_cleared = {i: item for i, item in self._repeat_cleared.items() if now < item[1]}
            stops = (*self._active.values(), *(estop for estop, _ in self._repeat_cleared.values()))
            effects += [Publish(estop) for estop in stops]
        return effects + self._answers(acknowledged, silent, now)

    def _answers(self, acknowledged: Mapping[str, str | None], silent: list[str], now: float) -> list[Effect]:
        effects: list[Effect] = []
        for waiting in list(self._waiting):
            agree = {
                robot: (estop_id in self._active) if waiting.stopping else estop_id is None
                for robot, estop_id in acknowledged.items()
            }
            open_ = sorted({robot for robot, done in agree.items() if not done} | set(silent))
            if open_ and now < waiting.until:
                continue
            names = ", ".join(sorted(robot for robot, done in agree.items() if done)) or "nobody"
            text = f"{waiting.done}; confirmed by {names}"
            text += f"; NOT confirmed by {', '.join(open_)}" if open_ else ""
            effects.append(Answer(waiting.request_id, Reply(waiting.call_id, True, text)))
            self._waiting.remove(waiting)
        return effects

    def _tell_again(self, estop: Estop, now: float) -> None:
        self._repeat_cleared[estop.id] = (replace(estop, active=False), now + _REPEAT_CLEARED_S)
