"""The latched emergency stop of the cell. It supports and never replaces a hard-wired one."""

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, replace

from cell.core import Answer, Effect, Publish
from cell.manager.listed_estops import ListedEstops
from cell.manager.records import EstopCleared, EstopLatched, Store, Stored
from cell.messages import Estop, Reply
from cell.net.estops import MOST_LISTED

_REPEAT_S = 0.05
_REPEAT_CLEARED_S = 2.0
_MOST_REPEATED = 2 * MOST_LISTED
"""Ends at a time; one that is left out is told when somebody stands under that stop."""
_CONFIRM_WITHIN_S = 1.0


@dataclass(frozen=True, slots=True)
class _Waiting:
    """A call whose answer names who confirmed."""

    request_id: str
    call_id: str
    done: str
    cleared: bool
    """Whether the end of stops is waited for, or a stop itself."""
    until: float


class EstopLatch:
    """The cell's stops: latched, repeated, and cleared by an operator who names them."""

    def __init__(self, stored: Stored) -> None:
        self._estops = ListedEstops(stored.estops, stored.cleared)
        self._unsaved = self._stores(stored.estops)
        self._repeat_cleared: dict[str, tuple[Estop, float]] = {}
        self._waiting: list[_Waiting] = []
        self._due = 0.0

    @property
    def in_force(self) -> tuple[Estop, ...]:
        """Those that are listed, oldest first."""
        return self._estops.in_force

    def holds(self, estop_id: str) -> bool:
        """Whether this stop is in force, listed or not."""
        return self._estops.holds(estop_id)

    def comes_again(self, estop: Estop) -> bool:
        """Whether this stop is asked for under an id that was cleared, and not as a copy that was under way then."""
        return estop.active and self._estops.was_cleared(estop.id) and estop.id not in self._repeat_cleared

    def latch(self, estop: Estop, now: float) -> list[Effect]:
        """Bring a stop into force, unless it is already, or was cleared before."""
        if not estop.active:
            return []
        if self._estops.was_cleared(estop.id):
            self._tell_again(estop, now)
        before = self.in_force
        if not self._estops.hear(estop):
            return []
        self._due = now
        return self._stores(before)

    def heard_confirmation(self, estop_id: str | None, who: str, now: float) -> list[Effect]:
        """Somebody stands under this stop: news if the manager missed the stop itself, or they its end."""
        if estop_id is None:
            return []
        return self.latch(Estop(estop_id, True, who, f"{who} stands under a stop that was set elsewhere"), now)

    def clear(self, ids: Collection[str], by: str, now: float) -> tuple[list[Effect], list[Estop]]:
        """An operator's reset: these stops end, as far as they are in force, and their ids are never accepted again."""
        ended = [estop for estop in self.in_force if estop.id in ids]
        for estop in ended:
            self._estops.hear(replace(estop, active=False))
            self._tell_again(estop, now)
        self._due = now
        return [Store(EstopCleared(estop.id, by)) for estop in ended], ended

    def answer_when_stopped(self, request_id: str, call_id: str, done: str, now: float) -> None:
        """Answer a call once everyone stands under a stop, or in 1 s."""
        self._waiting.append(_Waiting(request_id, call_id, done, False, now + _CONFIRM_WITHIN_S))

    def answer_when_dropped(self, request_id: str, call_id: str, done: str, now: float) -> None:
        """Answer a call once nobody stands under a stop that was cleared any more, or in 1 s."""
        self._waiting.append(_Waiting(request_id, call_id, done, True, now + _CONFIRM_WITHIN_S))

    def step(self, acknowledged: Mapping[str, str | None], silent: list[str], now: float) -> list[Effect]:
        """Repeat what is in force, and what was cleared lately, at 20 Hz; answer who waits."""
        effects, self._unsaved = self._unsaved, []
        if now >= self._due:
            self._due = now + _REPEAT_S
            self._repeat_cleared = {i: item for i, item in self._repeat_cleared.items() if now < item[1]}
            stops = (*self.in_force, *(estop for estop, _ in self._repeat_cleared.values()))
            effects += [Publish(estop) for estop in stops]
        return effects + self._answers(acknowledged, silent, now)

    def _answers(self, acknowledged: Mapping[str, str | None], silent: list[str], now: float) -> list[Effect]:
        effects: list[Effect] = []
        for waiting in list(self._waiting):
            agree = {
                robot: not self._estops.was_cleared(named) if waiting.cleared else self._estops.holds(named)
                for robot, named in acknowledged.items()
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

    def _stores(self, before: Iterable[Estop]) -> list[Effect]:
        """What is listed now and was not before, and instead of what."""
        kept = {estop.id for estop in self.in_force}
        gone = tuple(estop.id for estop in before if estop.id not in kept)
        known = set(before)
        return [Store(EstopLatched(estop, gone)) for estop in self.in_force if estop not in known]

    def _tell_again(self, estop: Estop, now: float) -> None:
        self._repeat_cleared.pop(estop.id, None)
        if len(self._repeat_cleared) >= _MOST_REPEATED:
            del self._repeat_cleared[next(iter(self._repeat_cleared))]
        self._repeat_cleared[estop.id] = (replace(estop, active=False), now + _REPEAT_CLEARED_S)
