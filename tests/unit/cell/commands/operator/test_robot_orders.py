"""Orders of a word and at most two values: what an operator's words ask of a robot."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import SimpleNamespace

import pytest
from typer.testing import CliRunner

from cell.commands.cell_command import app
from cell.commands.operator import robot_orders
from cell.messages import Command, ForceInput, Load, Reply, Run, Stop


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch) -> list[Command]:
    asked: list[Command] = []

    @contextmanager
    def connected(_file: Path, _endpoints: object) -> Iterator[SimpleNamespace]:
        def ask_robot(_robot: str, command: Command) -> Reply:
            asked.append(command)
            return Reply("1", True, "done")

        yield SimpleNamespace(ask_robot=ask_robot)

    monkeypatch.setattr(robot_orders, "connect", connected)
    return asked


@pytest.mark.parametrize(
    ("words", "command"),
    [
        ("load left", Load(None)),
        ("load left parts/lid.prog", Load("parts/lid.prog")),
        ("run left --virtual", Run(virtual=True)),
        ("run left --virtual --from 3", Run(first_line=3, virtual=True)),
        ("stop left", Stop()),
        ("input left part on", ForceInput("part", True)),
        ("input left part off", ForceInput("part", False)),
        ("input left part follow", ForceInput("part", None)),
    ],
)
def test_words_ask_for_a_command(asked: list[Command], words: str, command: Command) -> None:
    result = CliRunner().invoke(app, [*words.split(), "-f", "cell.yaml"])
    assert (result.exit_code, asked) == (0, [command])
