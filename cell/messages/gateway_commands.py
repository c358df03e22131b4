"""What a gateway is asked for: `gateway/<g>/cmd/<verb>`."""

from dataclasses import dataclass
from typing import ClassVar

from cell.messages.call import Command


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
    alone: bool = False
    """There is no manager, and the operator himself keeps all other robots still; refused while a manager is heard."""


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
    alone: bool = False
    """There is no manager, and the operator himself keeps all other robots still; refused while a manager is heard."""


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
    alone: bool = False
    """There is no manager, and the operator himself keeps all other robots still; refused while a manager is heard."""


@dataclass(frozen=True, slots=True)
class HoldSetup(Command):
    """The operator holds the set-up motion, as of the gateway state that the call's `heard` names.

    It begins with the first hold. The reply's `data` are `moving`, `done` or `stopped`.
    """

    verb: ClassVar[str] = "hold_setup"
    robot: str


@dataclass(frozen=True, slots=True)
class SwitchOutput(Command):
    """Switch a digital output of a robot by hand; the gateway refuses calls whose `heard` is too old.

    Refused while something moves the robot or its program runs. The answer comes when the drive shows it in 60FEh:01.
    """

    verb: ClassVar[str] = "switch_output"
    robot: str
    output: str
    on: bool
    by: str


@dataclass(frozen=True, slots=True)
class AcceptPosition(Command):
    """An operator has looked: axes (none named: all that are in doubt) are where their drives show them."""

    verb: ClassVar[str] = "accept_position"
    robot: str
    axes: tuple[str, ...]
