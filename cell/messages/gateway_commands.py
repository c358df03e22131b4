"""What a gateway is asked for: `gateway/<g>/cmd/<verb>`."""

from dataclasses import dataclass
from typing import Annotated, ClassVar

from annotated_types import MaxLen

from cell.messages.call import SWITCHED_ON_WITHIN_S, Command, command
from cell.messages.common import Count, Few, Name, Number, Words


@command("gateway")
@dataclass(frozen=True, slots=True)
class Claim(Command):
    """Become the one owner of a robot's drives."""

    verb: ClassVar[str] = "claim"
    robot: Name
    boot: Name
    digest: Name


@command("gateway")
@dataclass(frozen=True, slots=True)
class Release(Command):
    verb: ClassVar[str] = "release"
    robot: Name
    owner: Count


@command("gateway")
@dataclass(frozen=True, slots=True)
class EnableDrives(Command):
    verb: ClassVar[str] = "enable_drives"
    answer_within_s: ClassVar[float] = SWITCHED_ON_WITHIN_S
    robot: Name
    owner: Count


@command("gateway")
@dataclass(frozen=True, slots=True)
class DisableDrives(Command):
    verb: ClassVar[str] = "disable_drives"
    robot: Name
    owner: Count


@command("gateway")
@dataclass(frozen=True, slots=True)
class ResetDrives(Command):
    """Acknowledge the drives' faults; succeeds only where the cause is gone."""

    verb: ClassVar[str] = "reset_drives"
    robot: Name
    owner: Count


@command("gateway")
@dataclass(frozen=True, slots=True)
class ReadObject(Command):
    """Read an object of a node's dictionary; the reply's `data` are its bytes in hex, low byte first."""

    verb: ClassVar[str] = "sdo_read"
    node_id: Count
    index: Count
    sub: Count


@command("gateway")
@dataclass(frozen=True, slots=True)
class WriteObject(Command):
    """Write an object, `data` in hex, low byte first; only while the node's robot is at rest and switched off."""

    verb: ClassVar[str] = "sdo_write"
    node_id: Count
    index: Count
    sub: Count
    data: Annotated[str, MaxLen(2**20)]


@command("gateway")
@dataclass(frozen=True, slots=True)
class ScanBus(Command):
    """Which nodes are on the bus, configured or not; the reply's text has one line for each."""

    verb: ClassVar[str] = "scan"


@command("gateway")
@dataclass(frozen=True, slots=True)
class RecordBus(Command):
    """Write all frames of the next seconds to a file in the gateway's state folder; its suffix says the format."""

    verb: ClassVar[str] = "record"
    file: Words
    """A name without a folder."""
    seconds: Number


@command("gateway")
@dataclass(frozen=True, slots=True)
class Home(Command):
    """Set-up: let axes find their home points (none named: all that can), in their configured order, while held."""

    verb: ClassVar[str] = "home"
    robot: Name
    axes: Annotated[tuple[Name, ...], Few]
    alone: bool = False
    """There is no manager, and the operator himself keeps all other robots still; refused while a manager is heard."""


@command("gateway")
@dataclass(frozen=True, slots=True)
class MoveAxes(Command):
    """Set-up: move axes by their drives' own profiles, all in the same time, while held.

    `targets` are axis: rad or m, from where the axis is when `relative`. `speed` is a share (0 to 1) of what set-up may
    use. `by_velocity` uses profile velocity, which stops by time, instead of profile position.
    """

    verb: ClassVar[str] = "move_axes"
    robot: Name
    targets: Annotated[dict[Name, Number], Few]
    relative: bool
    speed: Number
    by_velocity: bool
    alone: bool = False
    """There is no manager, and the operator himself keeps all other robots still; refused while a manager is heard."""


@command("gateway")
@dataclass(frozen=True, slots=True)
class PressAxis(Command):
    """Set-up: let one axis give a torque while held, without moving farther than `within` [rad or m].

    `torque` [Nm, or N of a slide] is behind the gear, and comes on top of what carries the robot where that is known.
    It rises evenly, stays for `seconds`, and falls again; then the axis is switched off.
    """

    verb: ClassVar[str] = "press_axis"
    robot: Name
    axis: Name
    torque: Number
    seconds: Number
    within: Number
    alone: bool = False
    """There is no manager, and the operator himself keeps all other robots still; refused while a manager is heard."""


@command("gateway")
@dataclass(frozen=True, slots=True)
class HoldSetup(Command):
    """The operator holds his set-up motion, as of the gateway state that the call's `heard` names.

    It begins with the first hold. The reply's `data` are `moving`, `done` or `stopped`.
    """

    verb: ClassVar[str] = "hold_setup"
    robot: Name
    order: Name
    """Id of the call that ordered the motion; a hold of another order holds nothing."""


@command("gateway")
@dataclass(frozen=True, slots=True)
class SwitchOutput(Command):
    """Switch a digital output of a robot by hand; the gateway refuses calls whose `heard` is too old.

    Refused while something moves the robot or its program runs. The answer comes when the drive shows it in 60FEh:01.
    """

    verb: ClassVar[str] = "switch_output"
    robot: Name
    output: Name
    on: bool
    by: Words


@command("gateway")
@dataclass(frozen=True, slots=True)
class ForceOutput(Command):
    """Keep a digital output of a robot on or off for a test, whatever its program says, also while the robot moves.

    It ends by an order with `on` None, with the gateway, and for one that is on by each stop that switches it off.
    """

    verb: ClassVar[str] = "force_output"
    robot: Name
    output: Name
    on: bool | None
    """None: as the robot's program has switched it meanwhile, again."""
    by: Words


@command("gateway")
@dataclass(frozen=True, slots=True)
class SimulateInput(Command):
    """Close (on) or open a named digital input of a simulated drive or I/O node; real ones are never written."""

    verb: ClassVar[str] = "simulate_input"
    robot: Name
    input: Name
    on: bool


@command("gateway")
@dataclass(frozen=True, slots=True)
class AcceptPosition(Command):
    """An operator has looked: axes (none named: all that are in doubt) are where their drives show them."""

    verb: ClassVar[str] = "accept_position"
    robot: Name
    axes: Annotated[tuple[Name, ...], Few]
