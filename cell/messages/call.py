"""Calls: query and reply, for operators and for the claim of a robot. State never travels here.

A call's verb is the last chunk of its key (`robot/left/cmd/run`); the verb picks the command's type.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, ClassVar, TypeVar

from annotated_types import MaxLen

from cell.messages.common import Count, Duration, Few, Heard, Name, Number, Text

SWITCHED_ON_WITHIN_S = 12.0
"""Drives that charge their DC link first take up to 10 s (`switch_on_s` of an axis), and their brakes."""


@dataclass(frozen=True, slots=True)
class Command:
    """What is asked for; each kind names its verb."""

    verb: ClassVar[str]
    answer_within_s: ClassVar[float] = 2.0
    """Whoever is asked answers within this time, or says that it has none."""


C = TypeVar("C", bound=Command)

COMMANDS: dict[str, dict[str, type[Command]]] = {"robot": {}, "manager": {}, "gateway": {}}
"""Role: verb: the command that the last chunk of a call's key stands for."""


def command(*roles: str) -> Callable[[type[C]], type[C]]:
    """Register a command of these roles; above its `@dataclass`."""

    def register(kind: type[C]) -> type[C]:
        for role in roles:
            COMMANDS[role][kind.verb] = kind
        return kind

    return register


@command("robot", "manager", "gateway")
@dataclass(frozen=True, slots=True)
class Who(Command):
    """Who answers here: role, name, boot and process, in the reply's text."""

    verb: ClassVar[str] = "who"


@dataclass(frozen=True, slots=True)
class Call:
    """A command with the id that makes a repeated call harmless, and the echo that makes an old one recognisable.

    A caller that got no answer repeats the same call: id, command and echo. The addressee remembers an id and its
    outcome for 60 s; by the echo it refuses a call that comes late, or was meant for the process before a restart.
    `heard` is the newest state of the addressee that the caller had seen when it sent the call; from a robot's owner to
    its gateway the newest `DriveFeedback`. Whatever moves, releases or switches something is refused when its echo is
    older than 0.5 s or missing; what stops or switches off never is. `docs/messages.md` has the table.
    """

    id: Name
    command: Command
    heard: Heard | None = None


@dataclass(frozen=True, slots=True)
class ClaimGrant:
    """What a gateway gives its new owner."""

    owner: Count
    """Number of this claim; grows with each claim, never 0."""
    cycle_s: Duration
    tick: Count
    axes: Annotated[tuple[Name, ...], Few]
    gateway_boot: Name
    torques: bool = False
    """Some drive takes torque as feed-forward: blocks should carry it."""
    outputs: Annotated[tuple[Name, ...], Few] = ()
    """The robot's digital outputs, which `SetpointBlock.events` may switch."""
    epoch: Count = 0
    """The highest of a manager that any block for this robot told of; whatever an earlier one clears does not count."""
    quick_stop: Annotated[tuple[Number, ...], Few] = ()
    """[rad/s^2 or m/s^2] with which the drive of each of `axes` brakes by itself; empty: not told."""


@dataclass(frozen=True, slots=True)
class Reply:
    """The answer to a call. `text` says what was done, or what was found, what is allowed and what to do next."""

    id: Name
    ok: bool
    text: Text
    claim: ClaimGrant | None = None
    data: Annotated[str, MaxLen(2**20)] = ""
    """What was asked for, where the command says that there is something."""
