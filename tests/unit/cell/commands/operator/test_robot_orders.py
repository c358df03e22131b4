"""Orders of a word and at most two values: what an operator's words ask of a robot."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import SimpleNamespace

import pytest
from typer.testing import CliRunner

from cell.commands.cell_command import app
from cell.commands.errors import CommandError
from cell.commands.operator import robot_orders
from cell.messages import Command, Disable, Enable, ForceInput, ListParameters, Load, Reply, Run, SetParameter, Stop


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch) -> list[Command]:
    asked: list[Command] = []

    @contextmanager
    def connected(_file: Path, _endpoints: object) -> Iterator[SimpleNamespace]:
        def ask_robot(_robot: str, command: Command) -> Reply:
            asked.append(command)
            return Reply("1", True, "done")

        yield SimpleNamespace(ask_robot=ask_robot, check_robot=lambda _: None)

    monkeypatch.setattr(robot_orders, "connect", connected)
    monkeypatch.setattr(robot_orders, "operator_name", lambda: "ann@desk")
    return asked


@pytest.mark.parametrize(
    ("words", "command"),
    [
        ("load left", Load(None)),
        ("load left parts/lid.prog", Load("parts/lid.prog")),
        ("run left --virtual", Run(virtual=True)),
        ("run left --virtual --from 3", Run(first_line=3, virtual=True)),
        ("stop left", Stop()),
        ("set left", ListParameters()),
        ("set left joint_speed 50", SetParameter("joint_speed", 50.0, "ann@desk")),
        ("set left filter -1", SetParameter("filter", -1.0, "ann@desk")),
        ("set left filter file", SetParameter("filter", None, "ann@desk")),
        ("input left part on", ForceInput("part", True)),
        ("input left part off", ForceInput("part", False)),
        ("input left part follow", ForceInput("part", None)),
    ],
)
def test_words_ask_for_a_command(asked: list[Command], words: str, command: Command) -> None:
    result = CliRunner().invoke(app, [*words.split(), "-f", "cell.yaml"])
    assert (result.exit_code, asked) == (0, [command])


@pytest.mark.parametrize(("word", "command"), [("enable", Enable()), ("disable", Disable())])
def test_several_robots_are_switched_one_after_another(asked: list[Command], word: str, command: Command) -> None:
    result = CliRunner().invoke(app, [word, "left", "right", "-f", "cell.yaml"])
    assert (result.exit_code, asked) == (0, [command, command])
    assert result.output.splitlines() == ["left: done", "right: done"]


@pytest.mark.parametrize("value", ["", "fast", "50%", "nan", "inf"])
def test_a_value_that_is_no_number_is_refused_with_what_is_allowed(asked: list[Command], value: str) -> None:
    result = CliRunner().invoke(app, ["set", "left", "filter", value, "-f", "cell.yaml"])
    assert asked == []
    assert isinstance(result.exception, CommandError)
    assert "allowed is a number in its unit" in str(result.exception)


def test_a_name_without_a_value_is_refused(asked: list[Command]) -> None:
    result = CliRunner().invoke(app, ["set", "left", "filter", "-f", "cell.yaml"])
    assert asked == []
    assert "filter without a value" in str(result.exception)
