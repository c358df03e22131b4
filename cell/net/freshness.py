"""Freshness by echo (`docs/architecture.md`, section 4.1).

A process that was frozen finds old messages in its queue that look new on arrival. So the age of a message is not its
arrival: every side repeats the newest (boot, sequence) it heard, and a message is as young as the moment at which its
receiver itself sent the sequence that the message repeats.
"""

from collections import OrderedDict
from math import inf

from cell.messages import Heard
from cell.messages.common import ECHO_S


class Sent:
    """When the own messages were sent, by sequence."""

    def __init__(self, boot: str, keep_s: float = ECHO_S) -> None:
        self.boot = boot
        self._keep_s = keep_s
        self._times: OrderedDict[int, float] = OrderedDict()

    def record(self, sequence: int, now: float) -> None:
        """The message with `sequence` is sent at `now` [s]."""
        self._times[sequence] = now
        while self._times and now - next(iter(self._times.values())) > self._keep_s:
            self._times.popitem(last=False)

    def age(self, heard: Heard | None, now: float) -> float:
        """Upper bound [s] of the age of a message that repeats `heard`; infinite when it proves nothing."""
        if heard is None or heard.boot != self.boot:
            return inf
        sent = self._times.get(heard.sequence)
        return inf if sent is None else now - sent

    def forget(self) -> None:
        """After an own freeze: what was sent before it proves nothing any more."""
        self._times.clear()


class NewestOf:
    """Lets through only news from one peer: growing (era, sequence).

    An era is a number that grows from one run of the peer to the next: the epoch of a manager, the claim of an agent.
    The boot alone has no order: a late message of a run that was never heard would look like the newest run, and ban
    the living one for ever.
    """

    def __init__(self) -> None:
        self.boot: str | None = None
        self.era = -1
        self.sequence = -1

    def accept(self, boot: str, era: int, sequence: int) -> bool:
        """True when the message is newer than everything accepted before."""
        if (era, sequence) <= (self.era, self.sequence) or (era == self.era and boot != self.boot):
            return False
        self.boot, self.era, self.sequence = boot, era, sequence
        return True
