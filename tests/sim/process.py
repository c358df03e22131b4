"""A simulated process: its core and its real shell, stepped on virtual time, and what a machine can do to it."""

import random
import threading
from collections.abc import Callable, Iterable
from typing import Protocol

from cell.core import Arrived, Core, Effect
from cell.net.runner import SLIP, Turns
from tests.sim.clock import Clock
from tests.sim.exchange import SimSession


class Shell(Protocol):
    """What `run_core` needs of a shell."""

    def inbox(self) -> Iterable[object]: ...

    def perform(self, effect: Effect) -> None: ...


class WatchedCore:
    """Stands before a core and shows what it is handed, messages that arrived at a moment without it."""

    def __init__(self, name: str, core: Core, looks: list[Callable[[str, object], None]]) -> None:
        self._name = name
        self._core = core
        self._looks = looks

    def receive(self, message: object, now: float) -> None:
        for look in self._looks:
            look(self._name, message.message if isinstance(message, Arrived) else message)
        self._core.receive(message, now)

    def step(self, now: float) -> Iterable[Effect]:
        return self._core.step(now)

    def __getattr__(self, name: str) -> object:
        return getattr(self._core, name)


class Process:
    """One run of a process, from its start to its end."""

    def __init__(
        self,
        core: Core,
        watched: WatchedCore,
        shell: Shell,
        session: SimSession,
        period_s: float,
        clock: Clock,
        rng: random.Random,
        on_effect: Callable[[str, Effect], None],
        on_end: Callable[["Process", str], None],
        stop: threading.Event,
    ) -> None:
        """`on_end` is called when the process ends by itself, with what it says then; `stop` asks it to."""
        self.name = session.process
        self.boot = session.boot
        self.core = core
        self.shell = shell
        self.session = session
        self.alive = True
        self.stop = stop
        self._turns = Turns(watched, session.host.read)
        self._ahead: Callable[[], Iterable[object]] | None = getattr(shell, "ahead", None)
        self._period_s = period_s
        self._clock = clock
        self._rng = rng
        self._on_effect = on_effect
        self._on_end = on_end
        self._ended: threading.Event = getattr(shell, "ended", stop)
        self._frozen_until = 0.0
        self._due = clock.now + rng.random() * period_s
        clock.after(self._due - clock.now, self._turn)

    @property
    def frozen(self) -> bool:
        return self.alive and self._clock.now < self._frozen_until

    def freeze(self, duration_s: float) -> None:
        """Its threads stand still."""
        self._frozen_until = max(self._frozen_until, self._clock.now + duration_s)
        self.session.freeze(self._clock.now, self._frozen_until)

    def end(self) -> None:
        """It does nothing any more."""
        self.alive = False
        self.session.close()

    def _turn(self) -> None:
        """One cycle of `run_core`."""
        if not self.alive:
            return
        clock = self._clock
        if clock.now < self._frozen_until:
            clock.after(self._frozen_until - clock.now, self._turn)
            return
        self.session.take_in()
        self._step()
        if self._ended.is_set():
            self._on_end(self, "")
        else:
            self._plan_next()

    def _step(self) -> None:
        # What came long enough before a cycle is taken ahead of it, the rest in it.
        if self._ahead is not None and self._rng.random() < 0.5:
            self._turns.hand_over(self._ahead)
        now = self._turns.hand_over(self.shell.inbox)
        perform, look, name = self.shell.perform, self._on_effect, self.name
        for effect in self.core.step(now):
            look(name, effect)
            perform(effect)

    def _plan_next(self) -> None:
        """On an absolute schedule, which slips after a freeze."""
        if self._clock.now - self._due > SLIP * self._period_s:
            self._due = self._clock.now
        self._due += self.session.host.lasts(self._period_s + getattr(self.core, "trim_s", 0.0))
        self._clock.after(max(0.0, self._due - self._clock.now), self._turn)
