"""A simulated process: a core, its period, and what a machine can do to it (freeze, kill)."""

import random
from collections.abc import Callable

from cell.core import Arrived, Core, Effect, Frozen
from tests.sim.clock import Clock
from tests.sim.host import Host

FREEZE_S = 0.25


class Process:
    """Steps a core on virtual time until it is killed. Messages wait while it is frozen, as they do in a real one."""

    def __init__(
        self,
        name: str,
        core: Core,
        period_s: float,
        clock: Clock,
        host: Host,
        perform: Callable[["Process", Effect], None],
        delivered: Callable[[str, object], None],
        rng: random.Random,
        boot: str,
    ) -> None:
        self.name = name
        self.boot = boot
        self.core = core
        self.alive = True
        self.host = host
        self._period_s = period_s
        self._clock = clock
        self._perform = perform
        self._delivered = delivered
        self._inbox: list[object] = []
        self._frozen_until = 0.0
        self._last_step = host.now
        clock.after(rng.uniform(0.0, period_s), self._step)

    def tell(self, message: object) -> None:
        """A message has arrived."""
        if self.alive:
            self._inbox.append(message)

    @property
    def frozen(self) -> bool:
        return self.alive and self._clock.now < self._frozen_until

    def freeze(self, duration_s: float) -> None:
        self._frozen_until = max(self._frozen_until, self._clock.now + duration_s)

    def kill(self) -> None:
        self.alive = False
        self._inbox.clear()

    def _step(self) -> None:
        if not self.alive:
            return
        if self._clock.now < self._frozen_until:
            self._clock.after(self._frozen_until - self._clock.now, self._step)
            return
        now = self.host.now
        if now - self._last_step > FREEZE_S:
            self.core.receive(Frozen(now - self._last_step), now)
        self._last_step = now
        inbox, self._inbox = self._inbox, []
        for message in inbox:
            self._delivered(self.name, message.message if isinstance(message, Arrived) else message)
            self.core.receive(message, now)
        for effect in self.core.step(now):
            self._perform(self, effect)
        if self.alive:
            self._clock.after(self.host.lasts(self._period_s), self._step)
