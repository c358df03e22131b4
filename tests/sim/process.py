"""A simulated process: a core, its period, and what a machine can do to it (freeze, kill)."""

import random
from collections.abc import Callable

from cell.core import Core, Effect, Frozen
from tests.sim.clock import Clock

FREEZE_S = 0.25


class Process:
    """Steps a core on virtual time until it is killed. Messages wait while it is frozen, as they do in a real one."""

    def __init__(
        self,
        name: str,
        core: Core,
        period_s: float,
        clock: Clock,
        perform: Callable[["Process", Effect], None],
        rng: random.Random,
    ) -> None:
        self.name = name
        self.core = core
        self.alive = True
        self._period_s = period_s
        self._clock = clock
        self._perform = perform
        self._inbox: list[object] = []
        self._frozen_until = 0.0
        self._last_step = clock.now
        clock.after(rng.uniform(0.0, period_s), self._step)

    def tell(self, message: object) -> None:
        """A message has arrived."""
        if self.alive:
            self._inbox.append(message)

    def freeze(self, duration_s: float) -> None:
        self._frozen_until = self._clock.now + duration_s

    def kill(self) -> None:
        self.alive = False
        self._inbox.clear()

    def _step(self) -> None:
        if not self.alive:
            return
        now = self._clock.now
        if now < self._frozen_until:
            self._clock.after(self._frozen_until - now, self._step)
            return
        if now - self._last_step > FREEZE_S:
            self.core.receive(Frozen(now - self._last_step), now)
        self._last_step = now
        inbox, self._inbox = self._inbox, []
        for message in inbox:
            self.core.receive(message, now)
        for effect in self.core.step(now):
            self._perform(self, effect)
        self._clock.after(self._period_s, self._step)
