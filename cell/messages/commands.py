"""Calls: query and reply, for operators and for the claim of a robot. State never travels here.

A call's verb is the last chunk of its key (`robot/left/cmd/run`); the verb picks the command's type.
"""

from dataclasses import dataclass
from typing import ClassVar

from cell.messages.common import CellTime, Heard
from cell.messages.jog import JogFrame


@dataclass(frozen=True, slots=True)
class Command:
    """What is asked for; each kind names its verb."""

    verb: ClassVar[str]


# To an agent: robot/<r>/cmd/<verb>


@dataclass(frozen=True, slots=True)
class Enable(Command):
    """Switch the robot's drives on; the robot holds its position."""

    verb: ClassVar[str] = "enable"


@dataclass(frozen=True, slots=True)
class Disable(Command):
    """Switch the robot's drives off; refused while it moves."""

    verb: ClassVar[str] = "disable"


@dataclass(frozen=True, slots=True)
class Run(Command):
    """Start the configured program from its first line, at once or at a given time."""

    verb: ClassVar[str] = "run"
    at: CellTime | None = None
    """The first motion begins with the first tick at or behind this moment, or not at all."""
    lasting_s: float | None = None
    """Above 0, with `at`: the first motion ends so long behind it, or as soon as it can when it takes longer."""


@dataclass(frozen=True, slots=True)
class Halt(Command):
    """Brake on the path and stay there."""

    verb: ClassVar[str] = "halt"


@dataclass(frozen=True, slots=True)
class Continue(Command):
    """Go on from where the robot was halted on its path."""

    verb: ClassVar[str] = "continue"


@dataclass(frozen=True, slots=True)
class Step(Command):
    """Go on, or start, to the end of the present block of the program, and halt there."""

    verb: ClassVar[str] = "step"


@dataclass(frozen=True, slots=True)
class SetOverride(Command):
    """Follow the path at `percent` of the planned speed, -100 to 100; a negative one goes back along the path."""

    verb: ClassVar[str] = "override"
    percent: float


@dataclass(frozen=True, slots=True)
class SetManual(Command):
    """Manual operation at reduced speed (TCP at most 250 mm/s), or automatic operation again."""

    verb: ClassVar[str] = "manual"
    on: bool


@dataclass(frozen=True, slots=True)
class Jog(Command):
    """Begin to move along one axis; the robot goes on while `JogHeld` messages with the same press arrive."""

    verb: ClassVar[str] = "jog"
    press: str
    """A fresh name for this press of the key; one that has ended is never taken again."""
    axis: str
    """A joint's name, or X, Y, Z (along) and A, B, C (about X, Y, Z) for the tool."""
    speed: float
    """[m/s or rad/s], signed."""
    frame: JogFrame
    """Of X to C."""
    step: float | None = None
    """[m or rad], above 0: come to rest after that much."""


@dataclass(frozen=True, slots=True)
class ResetRobot(Command):
    """Acknowledge a fault or a cleared emergency stop; nothing moves."""

    verb: ClassVar[str] = "reset"


# To the manager: manager/cmd/<verb>


@dataclass(frozen=True, slots=True)
class SetEstop(Command):
    verb: ClassVar[str] = "estop"
    id: str
    by: str
    reason: str


@dataclass(frozen=True, slots=True)
class ResetEstop(Command):
    verb: ClassVar[str] = "reset"
    by: str


@dataclass(frozen=True, slots=True)
class ClearZone(Command):
    """The operator has looked: nobody is inside."""

    verb: ClassVar[str] = "clear_zone"
    zone: str
    by: str


@dataclass(frozen=True, slots=True)
class AdoptZone(Command):
    """The operator gives an orphaned zone to the robot that stands in it, under its new boot."""

    verb: ClassVar[str] = "adopt_zone"
    zone: str
    robot: str
    by: str


# To anyone who serves calls


@dataclass(frozen=True, slots=True)
class Who(Command):
    """Who answers here: role, name, boot and process, in the reply's text."""

    verb: ClassVar[str] = "who"


# To a gateway: gateway/<g>/cmd/<verb>


@dataclass(frozen=True, slots=True)
class Claim(Command):
    """Become the one owner of a robot's drives."""

    verb: ClassVar[str] = "claim"
    robot: str
    boot: str
    digest: str


@dataclass(frozen=True, slots=True)
class Release(Command):
    verb: ClassVar[str] = "release"
    robot: str
    owner: int


@dataclass(frozen=True, slots=True)
class EnableDrives(Command):
    verb: ClassVar[str] = "enable_drives"
    robot: str
    owner: int


@dataclass(frozen=True, slots=True)
class DisableDrives(Command):
    verb: ClassVar[str] = "disable_drives"
    robot: str
    owner: int


@dataclass(frozen=True, slots=True)
class ResetDrives(Command):
    """Acknowledge the drives' faults; succeeds only where the cause is gone."""

    verb: ClassVar[str] = "reset_drives"
    robot: str
    owner: int


@dataclass(frozen=True, slots=True)
class ReadObject(Command):
    """Read an object of a node's dictionary; the reply's `data` are its bytes in hex, low byte first."""

    verb: ClassVar[str] = "sdo_read"
    node_id: int
    index: int
    sub: int


@dataclass(frozen=True, slots=True)
class WriteObject(Command):
    """Write an object, `data` in hex, low byte first; only while the node's robot is at rest and switched off."""

    verb: ClassVar[str] = "sdo_write"
    node_id: int
    index: int
    sub: int
    data: str


@dataclass(frozen=True, slots=True)
class ScanBus(Command):
    """Which nodes are on the bus, configured or not; the reply's text has one line for each."""

    verb: ClassVar[str] = "scan"


@dataclass(frozen=True, slots=True)
class RecordBus(Command):
    """Write all frames of the next seconds to a file on the gateway's host; its suffix says the format."""

    verb: ClassVar[str] = "record"
    file: str
    seconds: float


@dataclass(frozen=True, slots=True)
class Home(Command):
    """Set-up: let axes find their home points (none named: all that can), in their configured order, while held."""

    verb: ClassVar[str] = "home"
    robot: str
    axes: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class MoveAxes(Command):
    """Set-up: move axes by their drives' own profiles, all in the same time, while held.

    `targets` are axis: rad or m, from where the axis is when `relative`. `speed` is a share (0 to 1) of what set-up may
    use. `by_velocity` uses profile velocity, which stops by time, instead of profile position.
    """

    verb: ClassVar[str] = "move_axes"
    robot: str
    targets: dict[str, float]
    relative: bool
    speed: float
    by_velocity: bool


@dataclass(frozen=True, slots=True)
class PressAxis(Command):
    """Set-up: let one axis give a torque while held, without moving farther than `within` [rad or m].

    `torque` [Nm, or N of a slide] is behind the gear, and comes on top of what carries the robot where that is known.
    It rises evenly, stays for `seconds`, and falls again; then the axis is switched off.
    """

    verb: ClassVar[str] = "press_axis"
    robot: str
    axis: str
    torque: float
    seconds: float
    within: float


@dataclass(frozen=True, slots=True)
class HoldSetup(Command):
    """The operator still holds the set-up motion; the reply's `data` are `moving`, `done` or `stopped`."""

    verb: ClassVar[str] = "hold_setup"
    robot: str


@dataclass(frozen=True, slots=True)
class AcceptPosition(Command):
    """An operator has looked: axes (none named: all that are in doubt) are where their drives show them."""

    verb: ClassVar[str] = "accept_position"
    robot: str
    axes: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Call:
    """A command with the id that makes a repeated call harmless, and the echo that makes an old one recognisable.

    `heard` is the newest state of the addressee that the caller had seen when it sent the call. An agent refuses
    operator commands whose echo is older than 0.5 s; gateways and the manager do not need it for the calls above.
    """

    id: str
    command: Command
    heard: Heard | None = None


@dataclass(frozen=True, slots=True)
class ClaimGrant:
    """What a gateway gives its new owner."""

    owner: int
    """Number of this claim; grows with each claim, never 0."""
    cycle_s: float
    tick: int
    axes: tuple[str, ...]
    gateway_boot: str
    torques: bool = False
    """Some drive takes torque as feed-forward: blocks should carry it."""
    outputs: tuple[str, ...] = ()
    """The robot's digital outputs, which `SetpointBlock.events` may switch."""


@dataclass(frozen=True, slots=True)
class Reply:
    """The answer to a call. `text` says what was done, or what was found, what is allowed and what to do next."""

    id: str
    ok: bool
    text: str
    claim: ClaimGrant | None = None
    data: str = ""
    """What was asked for, where the command says that there is something."""
