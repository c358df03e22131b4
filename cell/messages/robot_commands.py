"""What an agent is asked for: `robot/<r>/cmd/<verb>`."""

from dataclasses import dataclass
from enum import Enum
from typing import ClassVar

from cell.messages.call import SWITCHED_ON_WITHIN_S, Command, command
from cell.messages.common import CellTime, Count, Name, Number, Text, Words
from cell.messages.jog import JogFrame


@command("robot")
@dataclass(frozen=True, slots=True)
class Enable(Command):
    """Switch the robot's drives on; the robot holds its position."""

    verb: ClassVar[str] = "enable"
    answer_within_s: ClassVar[float] = SWITCHED_ON_WITHIN_S + 1.0


@command("robot")
@dataclass(frozen=True, slots=True)
class Disable(Command):
    """Switch the robot's drives off; refused while it moves."""

    verb: ClassVar[str] = "disable"


@command("robot")
@dataclass(frozen=True, slots=True)
class Run(Command):
    """Start the robot's program from its first line or another one, at once or at a given time."""

    verb: ClassVar[str] = "run"
    at: CellTime | None = None
    """The first motion begins with the first tick at or after this moment, or not at all."""
    lasting_s: Number | None = None
    """Above 0, with `at`: the first motion ends so long after it, or as soon as it can when it takes longer."""
    first_line: Count | None = None
    """Begin there, with what the lines before make of speeds, frames and all else that holds from a line on."""
    last_line: Count | None = None
    """End with this line."""
    dry: bool = False
    """Switch no outputs."""
    virtual: bool = False
    """Nothing moves and nothing is switched: the program runs in `RobotState.virtual` alone."""


@command("robot")
@dataclass(frozen=True, slots=True)
class Load(Command):
    """Read a program and the robot's points anew and take them; ends a program that is halted or interrupted."""

    verb: ClassVar[str] = "load"
    answer_within_s: ClassVar[float] = 5.0
    file: Text | None = None
    """Relative to the folder of the agent's cell file, without `..`; None: the file of its present program."""


@command("robot")
@dataclass(frozen=True, slots=True)
class Halt(Command):
    """Brake on the path and stay there."""

    verb: ClassVar[str] = "halt"


@command("robot")
@dataclass(frozen=True, slots=True)
class Stop(Command):
    """Brake on the path; the program, or the press of a jog key, has ended."""

    verb: ClassVar[str] = "stop"


@command("robot")
@dataclass(frozen=True, slots=True)
class Continue(Command):
    """Go on from where the robot was halted on its path, or interrupted and is still within its window."""

    verb: ClassVar[str] = "continue"


@command("robot")
@dataclass(frozen=True, slots=True)
class Return(Command):
    """Go back slowly to where the interrupted program left its path, and stay there."""

    verb: ClassVar[str] = "return"


@command("robot")
@dataclass(frozen=True, slots=True)
class Step(Command):
    """Go on, or start, to the end of the present block of the program, and halt there."""

    verb: ClassVar[str] = "step"


@command("robot")
@dataclass(frozen=True, slots=True)
class SetOverride(Command):
    """Follow the path at `percent` of the planned speed, -100 to 100; a negative one goes back along the path."""

    verb: ClassVar[str] = "override"
    percent: Number


@command("robot")
@dataclass(frozen=True, slots=True)
class SetManual(Command):
    """Manual operation at reduced speed (TCP at most 250 mm/s), or automatic operation again."""

    verb: ClassVar[str] = "manual"
    on: bool


@command("robot")
@dataclass(frozen=True, slots=True)
class SetParameter(Command):
    """Give a parameter another value until the end of the agent; docs/commanding.md has names, units and ranges."""

    verb: ClassVar[str] = "set"
    name: Name
    value: Number | None
    """None: as the files say, again."""
    by: Words


@command("robot")
@dataclass(frozen=True, slots=True)
class ListParameters(Command):
    """The reply's text says which parameters may be set, their values and ranges."""

    verb: ClassVar[str] = "parameters"


@command("robot")
@dataclass(frozen=True, slots=True)
class SetTool(Command):
    """Which tool is mounted, by the word of an operator who has looked; ends a program that is halted."""

    verb: ClassVar[str] = "tool"
    tool: Name | None
    """Of its robot file; None for none."""


@command("robot")
@dataclass(frozen=True, slots=True)
class SetPart(Command):
    """What is in the robot's gripper, by the word of an operator who has looked; ends a program that is halted."""

    verb: ClassVar[str] = "part"
    part: Name | None
    """Of its robot file; None for nothing."""


@command("robot")
@dataclass(frozen=True, slots=True)
class AnswerFlag(Command):
    """Let a program go on that waits at `M` with this flag; halted, it goes on there when it continues."""

    verb: ClassVar[str] = "flag"
    flag: Count


@command("robot")
@dataclass(frozen=True, slots=True)
class ForceInput(Command):
    """What programs of this robot see of an input, whatever its gateway tells; spaces and safety inputs do not."""

    verb: ClassVar[str] = "input"
    input: Name
    on: bool | None
    """None: what its gateway tells, again."""


@command("robot")
@dataclass(frozen=True, slots=True)
class Jog(Command):
    """Begin to move along one axis; the robot goes on while `JogHeld` messages with the same press arrive."""

    verb: ClassVar[str] = "jog"
    press: Name
    """A fresh name for this press of the key; one that has ended is never taken again."""
    axis: Name
    """A joint's name, or X, Y, Z (along) and A, B, C (about X, Y, Z) for the tool."""
    speed: Number
    """[m/s or rad/s], signed."""
    frame: JogFrame
    """Of X to C."""
    step: Number | None = None
    """[m or rad], above 0: come to rest after that much."""
    in_frame: Name | None = None
    """A frame of the cell whose axes X to C are, instead of `frame`."""


class PointKind(Enum):
    """What is kept of where a robot stands."""

    POSE = "pose"
    JOINTS = "joints"


@command("robot")
@dataclass(frozen=True, slots=True)
class Teach(Command):
    """Keep where the robot is measured to stand as a point of its points file; programs take it from then on."""

    verb: ClassVar[str] = "teach"
    answer_within_s: ClassVar[float] = 5.0
    point: Name
    kind: PointKind
    frame: Name | None
    """Of a pose; empty: the robot's base; None: that of the point before, else the base."""
    replace: bool
    """A point of this name may be there."""


@command("robot")
@dataclass(frozen=True, slots=True)
class ListPoints(Command):
    """The reply's text says what points the robot has, and where they are now; its `data` has them by name, as JSON."""

    verb: ClassVar[str] = "points"


@command("robot")
@dataclass(frozen=True, slots=True)
class Go(Command):
    """Begin to move to a point, straight in the joints; the robot goes on as with `Jog`, while the key is held."""

    verb: ClassVar[str] = "go"
    press: Name
    """As in `Jog`."""
    point: Name


@command("robot")
@dataclass(frozen=True, slots=True)
class ResetRobot(Command):
    """Acknowledge a fault or a cleared emergency stop; nothing moves."""

    verb: ClassVar[str] = "reset"
