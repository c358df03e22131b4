"""What an operator's jog key says while it is held."""

from dataclasses import dataclass
from enum import Enum

from cell.messages.common import Heard, Name
from cell.messages.state import Urgency, state


class JogFrame(Enum):
    """Whose axes a tool is jogged along and about."""

    BASE = "base"
    WORLD = "world"
    TOOL = "tool"


@state("robot/{robot}/jog", Urgency.INTERACTIVE)
@dataclass(frozen=True, slots=True)
class JogHeld:
    """The key of one press, repeated while it is held; without it the jog ramps to rest.

    `heard` is the newest state of the robot that the operator's side has received: the message is as young as that.
    """

    robot: Name
    press: Name
    """The press that the call `jog` has begun."""
    held: bool
    """False: the key was let go, the robot comes to rest at once."""
    heard: Heard
