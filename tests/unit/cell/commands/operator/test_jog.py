"""`cell jog`: from an operator's words in mm and deg to the call in SI."""

import math
import threading
from types import SimpleNamespace

import pytest

from cell.commands.errors import CommandError
from cell.commands.operator.jog import Direction, hold, jog_command
from cell.messages import Jog, JogFrame, JogHeld, Mode, ProgramState, ProgramStatus, RobotState


def command(axis: str, sign: str, speed: float | None = None, step: float | None = None, sliding: bool = False) -> Jog:
    return jog_command(axis, Direction(sign), speed, step, JogFrame.TOOL, sliding)


def test_lines_are_in_millimetres_and_turns_in_degrees() -> None:
    along, about = command("Z", "-", 20.0, 5.0), command("B", "+", 90.0, 45.0)
    assert (along.speed, along.step, along.frame) == (pytest.approx(-0.02), pytest.approx(0.005), JogFrame.TOOL)
    assert (about.speed, about.step) == (pytest.approx(math.pi / 2), pytest.approx(math.pi / 4))


def test_a_joint_is_in_degrees_unless_it_slides() -> None:
    assert command("J3", "+", 180.0).speed == pytest.approx(math.pi)
    assert command("J3", "+", 180.0, sliding=True).speed == pytest.approx(0.18)


def test_without_a_speed_it_is_slow() -> None:
    assert command("X", "+").speed == pytest.approx(0.05)
    assert command("J1", "-").speed == pytest.approx(math.radians(-10.0))


def test_every_press_has_a_name_of_its_own() -> None:
    assert command("X", "+").press != command("X", "+").press


@pytest.mark.parametrize("words", [{"speed": 0.0}, {"speed": -5.0}, {"step": 0.0}, {"step": math.inf}])
def test_a_speed_or_step_that_is_not_above_0_is_refused(words: dict[str, float]) -> None:
    with pytest.raises(CommandError, match="allowed is any above 0"):
        command("X", "+", **words)


def test_a_jog_that_was_over_before_it_was_seen_ends_the_command_too() -> None:
    program = ProgramStatus("left.prog", ProgramState.LOADED, 0, "")
    at_rest = RobotState("left", "b", 1, Mode.READY, program, None, None, None, 0.0, None)
    said: list[JogHeld] = []
    operator = SimpleNamespace(
        view=SimpleNamespace(look=lambda: SimpleNamespace(robots={"left": at_rest})),
        session=SimpleNamespace(publish=said.append),
    )
    released = threading.Event()
    released.set()
    with pytest.raises(CommandError, match="the jog was over before it was seen: no sign of the key arrived in time"):
        hold(operator, "left", "press", released)  # type: ignore[arg-type]
    assert said
    assert not any(message.held for message in said)
