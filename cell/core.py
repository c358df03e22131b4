"""The two-method core that every process is built around.

A core is plain Python: it takes messages and the present time, keeps its state, and answers with effects. It opens no
socket, starts no thread, reads no clock and never sleeps. A thin shell around it owns Zenoh, CAN, threads, timers and
files, and carries the effects out. What takes time (a call to another process, a plan, an SDO, a disk write) is an
effect whose result comes back through `receive`. So a whole cell runs in one test process on virtual time.

Times are seconds of one monotonic clock, as `float`; only the shell knows where they come from.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Protocol


@dataclass(frozen=True, slots=True)
class Effect:
    """Something the shell must do for the core. Packages add their own kinds beside the three below."""


@dataclass(frozen=True, slots=True)
class Publish(Effect):
    """Send a state message to everyone; its key follows from its type and its name fields (`cell.net.keys`)."""

    message: object


@dataclass(frozen=True, slots=True)
class Ask(Effect):
    """Call another process. The outcome comes back as `AskDone` with the same `ask_id`.

    `to` is the addressee's key prefix without the cell: `"manager"`, `"robot/left"`, `"gateway/left_bus"`.
    `call` is a `cell.messages.Call`.
    """

    ask_id: str
    to: str
    call: object
    timeout_s: float


@dataclass(frozen=True, slots=True)
class Answer(Effect):
    """Answer the call that arrived as `Request` with the same `request_id`; `reply` is a `Reply`."""

    request_id: str
    reply: object


@dataclass(frozen=True, slots=True)
class Request:
    """A call from an operator or another process; the core must `Answer` it, at once or later."""

    request_id: str
    call: object


@dataclass(frozen=True, slots=True)
class AskDone:
    """The outcome of an `Ask`: a reply, or `None` and the reason (no answer, error, time-out: none means yes)."""

    ask_id: str
    reply: object | None
    problem: str = ""


@dataclass(frozen=True, slots=True)
class Arrived:
    """A state message and the moment [s] at which it came in, which is before the step that takes it."""

    message: object
    at: float


@dataclass(frozen=True, slots=True)
class Frozen:
    """The process stood still for `gap_s`: what it receives next may be that old, what it sent proves nothing now."""

    gap_s: float


@dataclass(frozen=True, slots=True)
class Shutdown:
    """Message to a core: bring what you own to rest, give it up, then emit `Ended`."""


@dataclass(frozen=True, slots=True)
class Ended(Effect):
    """After `Shutdown`: everything is at rest and given up, the loop may end."""


class Core(Protocol):
    """What a shell and the simulation need to know of a process."""

    def receive(self, message: object, now: float) -> None:
        """Take one message; `now` is the monotonic time at which the shell hands it over. Unknown kinds are ignored."""

    def step(self, now: float) -> Iterable[Effect]:
        """Do what is due at `now`: what the shell must carry out, in this order, each before it asks for the next."""
