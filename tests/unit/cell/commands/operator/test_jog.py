"""`cell jog`: from an operator's words in mm and deg to the call in SI."""

import math
import threading
from collections.abc import Iterable
from dataclasses import replace
from itertools import repeat
from types import SimpleNamespace
from typing import Any

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


PROGRAM = ProgramStatus("left.prog", ProgramState.FAILED, 3, "", "the robot was jogged off its path by an operator")


def state(mode: Mode, waiting_for: str = "") -> RobotState:
    at_rest = RobotState("left", "b", 1, mode, PROGRAM, None, None, None, 0.0, None)
    return replace(at_rest, waiting_for=waiting_for)


def operator(states: Iterable[RobotState], said: list[JogHeld]) -> Any:
    """Somebody at the keyboard, who sees one state after the other."""
    following = iter(states)
    return SimpleNamespace(
        view=SimpleNamespace(look=lambda: SimpleNamespace(robots={"left": next(following)})),
        session=SimpleNamespace(publish=said.append),
    )


def test_a_jog_that_was_over_before_it_was_seen_ends_the_command_too() -> None:
    said: list[JogHeld] = []
    released = threading.Event()
    released.set()
    with pytest.raises(CommandError, match="the jog was over before it was seen: no sign of the key arrived in time"):
        hold(operator(repeat(state(Mode.READY)), said), "left", "press", released)
    assert said
    assert not any(message.held for message in said)


def test_a_jog_that_the_robot_breaks_off_is_no_success() -> None:
    silent = "no sign of the jog key for 0.21 s"
    seen = operator((state(Mode.JOGGING), state(Mode.JOGGING, silent), state(Mode.READY)), [])
    with pytest.raises(CommandError, match=f"the jog was broken off: {silent}") as refused:
        hold(seen, "left", "press", threading.Event())
    assert "see where the robot stands" in refused.value.next_step


def test_what_is_in_the_way_is_said_once_while_the_robot_creeps_up_to_it(capsys: pytest.CaptureFixture[str]) -> None:
    held, free = state(Mode.JOGGING, "block is in the way of link 5"), state(Mode.JOGGING)
    hold(operator((held, free, held, free, held, free, state(Mode.READY)), []), "left", "press", threading.Event())
    assert capsys.readouterr().out.splitlines() == [
        "left: block is in the way of link 5",
        "left: is at rest; the jog has ended",
    ]


@pytest.mark.parametrize("waiting_for", ["", "cleared space"])
def test_a_jog_that_comes_to_its_end_is_one(waiting_for: str, capsys: pytest.CaptureFixture[str]) -> None:
    seen = operator((state(Mode.JOGGING, waiting_for), state(Mode.JOGGING), state(Mode.READY)), [])
    hold(seen, "left", "press", threading.Event())
    assert "the jog has ended" in capsys.readouterr().out
