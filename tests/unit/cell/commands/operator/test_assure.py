"""`cell confine` and `cell stands`: what they ask for, and what they refuse before that."""

from collections.abc import Iterator
from contextlib import contextmanager

import pytest
from typer.testing import CliRunner

from cell.commands.cell_command import app
from cell.commands.client.state_table import manager_line
from cell.commands.errors import CommandError
from cell.commands.operator import assure as module
from cell.config import load_cell
from cell.messages import (
    Assurance,
    Command,
    Confinement,
    ConfineRobot,
    EndAssurance,
    ManagerState,
    Reply,
    RobotStands,
)
from tests.unit.config_world import TWO_ARMS

BOX = ("--box", "2400,2000,2600", "--pose", "-1800,0,1300,0,0,90")


class _Manager:
    def __init__(self) -> None:
        self.asked: list[Command] = []

    def check_robot(self, robot: str) -> None:
        assert robot == "left"

    def ask_manager(self, command: Command) -> Reply:
        self.asked.append(command)
        return Reply("1", True, "left stays there")


@pytest.fixture
def manager(monkeypatch: pytest.MonkeyPatch) -> _Manager:
    manager = _Manager()

    @contextmanager
    def connect(*_: object) -> Iterator[_Manager]:
        yield manager

    monkeypatch.setattr(module, "connect", connect)
    monkeypatch.setattr(module, "operator_name", lambda: "me")
    return manager


def _say(*words: str) -> str:
    result = CliRunner().invoke(app, list(words))
    if isinstance(result.exception, CommandError):
        raise result.exception
    assert result.exit_code == 0, result.output
    return result.output


def test_what_is_said_in_mm_and_deg_is_asked_for_in_metres(manager: _Manager) -> None:
    assert _say("confine", "left", *BOX) == "manager: left stays there\n"
    _say("stands", "left")
    _say("stands", "left", "off")
    _say("confine", "left", "off")
    confine, *others = manager.asked
    assert others == [RobotStands("left", "me"), EndAssurance("left", "me"), EndAssurance("left", "me")]
    assert isinstance(confine, ConfineRobot)
    assert confine.box.size_m == pytest.approx((2.4, 2.0, 2.6))
    assert confine.box.position_m == pytest.approx((-1.8, 0.0, 1.3))
    assert confine.box.quaternion_xyzw == pytest.approx((0.0, 0.0, 0.5**0.5, 0.5**0.5))


@pytest.mark.parametrize(
    ("words", "what"),
    [
        ((), "a box needs --box and --pose"),
        (BOX[:2], "a box needs --box and --pose"),
        (("off", *BOX), "off goes without --box and --pose"),
        (("--box", "1,2", *BOX[2:]), "--box '1,2' found, allowed are three lengths in mm"),
        (("--box", "1,2,0", *BOX[2:]), "--box '1,2,0' found"),
        (("--box", "1,2,nan", *BOX[2:]), "--box '1,2,nan' found"),
        ((*BOX[:2], "--pose", "1,2,3"), "--pose '1,2,3' found"),
    ],
)
def test_what_is_no_box_is_refused(manager: _Manager, words: tuple[str, ...], what: str) -> None:
    with pytest.raises(CommandError) as refused:
        _say("confine", "left", *words)
    assert refused.value.what.startswith(what)
    assert manager.asked == []


def test_the_status_says_who_said_what() -> None:
    cell = load_cell(TWO_ARMS)
    box = Confinement((1.0, 1.0, 1.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0))
    state = ManagerState("c", "m", 7, 1, 0.0, "d", assured={"left": Assurance("me", box), "right": Assurance("you")})
    assert manager_line(cell, state) == (
        "manager: epoch 7, left stays in a box, says me, right stands where it was last known, says you"
    )
