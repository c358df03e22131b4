"""`cell teach`, `points`, `go` and `jog --in`: what an operator's words ask of a robot."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from typer.testing import CliRunner

from cell.commands.cell_command import app
from cell.commands.operator import jog, point
from cell.messages import Command, Go, Jog, ListPoints, PointKind, Reply, Teach


class Robot:
    """An agent that answers whatever it is asked."""

    settings = SimpleNamespace(frames={"table": None})

    def __init__(self) -> None:
        self.asked: list[Command] = []
        self.held: list[str] = []
        self.reply = Reply("1", True, "left: done")

    def ask_robot(self, _robot: str, command: Command) -> Reply:
        self.asked.append(command)
        return self.reply

    def check_robot(self, _robot: str) -> None:
        pass

    def presence(self, _robot: str) -> Any:
        return SimpleNamespace(digest="d")

    def check_files(self, _who: str, _digest: str) -> None:
        pass


@pytest.fixture
def robot(monkeypatch: pytest.MonkeyPatch) -> Robot:
    robot = Robot()

    @contextmanager
    def connected(_file: Path, _endpoints: object, _stop: object = None) -> Iterator[Robot]:
        yield robot

    for module in (jog, point):
        monkeypatch.setattr(module, "connect", connected)
        monkeypatch.setattr(module, "hold", lambda _operator, _robot, press, _stop: robot.held.append(press))
    return robot


def run(*words: str) -> str:
    return CliRunner().invoke(app, [*words, "-f", "cell.yaml"]).output


@pytest.mark.parametrize(
    ("words", "command"),
    [
        ((), Teach("pick", PointKind.POSE, None, replace=False)),
        (("--joints", "--replace"), Teach("pick", PointKind.JOINTS, None, replace=True)),
        (("--frame", "table"), Teach("pick", PointKind.POSE, "table", replace=False)),
        (("--frame", "base"), Teach("pick", PointKind.POSE, "", replace=False)),
    ],
)
def test_a_point_is_taught_in_the_frame_that_is_named(robot: Robot, words: tuple[str, ...], command: Teach) -> None:
    assert run("teach", "left", "pick", *words) == "left: done\n"
    assert robot.asked == [command]


def test_an_unknown_frame_is_refused_before_anything_is_asked(robot: Robot) -> None:
    result = CliRunner().invoke(app, ["teach", "left", "pick", "--frame", "tabel", "-f", "cell.yaml"])
    assert "--frame 'tabel' found, allowed are base, table" in str(result.exception)
    assert not robot.asked


def test_points_are_printed_as_the_robot_tells_them(robot: Robot) -> None:
    robot.reply = Reply("1", True, "pick: X 1\nup: J1=2")
    assert run("points", "left") == "pick: X 1\nup: J1=2\n"
    assert robot.asked == [ListPoints()]


def test_going_to_a_point_is_a_key_that_is_held(robot: Robot) -> None:
    run("go", "left", "pick")
    (command,) = robot.asked
    assert isinstance(command, Go)
    assert (command.point, [command.press]) == ("pick", robot.held)


def test_a_jog_names_a_frame_of_the_cell(robot: Robot) -> None:
    run("jog", "left", "X", "+", "--in", "table")
    (command,) = robot.asked
    assert isinstance(command, Jog)
    assert (command.in_frame, robot.held) == ("table", [command.press])
