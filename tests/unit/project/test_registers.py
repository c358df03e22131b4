"""What one module declares is known everywhere: nothing here changes a file of the product, or looks inside one.

`docs/architecture.md`, section 2.1, is about what is done here.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from unittest.mock import patch

import pytest

from cell.messages import COMMANDS, STATES, Call, Command, Correction, Urgency
from cell.messages.call import command
from cell.messages.common import Duration, Name
from cell.messages.state import state
from cell.net.codec import decode, decode_call, encode, encode_call, message_schemas
from cell.net.errors import CodecError
from cell.net.keys import Keys
from cell.net.latest import Decoder

# A message, and a command of a call


@dataclass(frozen=True, slots=True)
class ToolWear:
    """How long a tool has worked."""

    robot: Name
    tool: Name
    worked_s: Duration


@dataclass(frozen=True, slots=True)
class ChangeTool(Command):
    verb = "change_tool"
    tool: Name


@pytest.fixture
def messages() -> Iterator[None]:
    with patch.dict(STATES), patch.dict(COMMANDS["robot"]):
        state("robot/{robot}/wear/{tool}", Urgency.HIGH)(ToolWear)
        command("robot")(ChangeTool)
        yield


WEAR = ToolWear("left", "gripper", 7.5)
KEY = "cell/two_arms/robot/left/wear/gripper"


@pytest.mark.usefixtures("messages")
def test_a_message_travels_on_its_key() -> None:
    keys = Keys("two_arms")
    assert (keys.of(WEAR), keys.type_of(KEY)) == (KEY, ToolWear)
    assert Decoder(keys).decode(KEY, encode(WEAR)) == WEAR


@pytest.mark.usefixtures("messages")
def test_a_message_is_as_strict_as_all_and_has_a_schema() -> None:
    with pytest.raises(CodecError, match="worked_s"):
        decode(ToolWear, encode(WEAR).replace(b"7.5", b"-7.5"))
    assert set(message_schemas()["ToolWear"]["properties"]) == {"robot", "tool", "worked_s"}


@pytest.mark.usefixtures("messages")
def test_a_command_is_called_by_its_verb() -> None:
    call = Call("1", ChangeTool("gripper"))
    assert decode_call("robot/left", "change_tool", encode_call(call)) == call
    with pytest.raises(CodecError, match="verb 'change_tool' is unknown to manager"):
        decode_call("manager", "change_tool", encode_call(call))


def test_nothing_of_it_is_left() -> None:
    assert Correction in STATES
    assert ToolWear not in STATES
    assert Keys("two_arms").type_of(KEY) is None
