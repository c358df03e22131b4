"""`cell frame`: what it shows, what it asks for before it moves a frame, and what it says afterwards."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import cast

import pytest
from typer.testing import CliRunner

from cell.commands.cell_command import app
from cell.commands.client.cell_view import Snapshot
from cell.commands.client.connection import Connection
from cell.commands.errors import CommandError
from cell.commands.operator import frame as module
from cell.commands.operator.frame import allowed_by, move_frame, parsed_pose, standing_at
from cell.config import load_cell
from cell.messages import (
    Command,
    FramePose,
    ManagerState,
    Mode,
    PlaceFrame,
    ProgramState,
    ProgramStatus,
    Reply,
    RobotState,
    TeachFrame,
)
from tests.unit.config_world import CELL, Copy

UPRIGHT = (0.0, 0.0, 0.0, 1.0)
FRAMES = """\
frames:
  table: {pose: {X: 900, Y: 0, Z: 700, A: 0, B: 0, C: 0}}
  nest: {parent: table, pose: {X: 0, Y: 0, Z: 0, A: 0, B: 0, C: 0}}
things: {ball: {sphere: 5, pose: {X: 0, Y: 0, Z: 0, A: 0, B: 0, C: 0}, frame: nest}}
"""
TOLD = FramePose("table", 7000, None, (0.9, 0.0, 0.7), UPRIGHT)


class Cell:
    """A cell of which an operator's commands see and hear only this; left stands at one place after the other."""

    file = Path("cell.yaml")
    stop = None

    def __init__(self, folder: Path, *places: tuple[float, float, float] | None) -> None:
        self.settings = load_cell(Copy(folder).add(CELL, FRAMES.rstrip()).cell)
        self.view = self.session = self
        self.asked: list[Command] = []
        self.reply = Reply("1", True, "frame table moves", data="7001")
        self.moves = False
        self.tools: list[str | None] = []
        """What it carries from one look to the next; no tool after the last."""
        self.line, self.planned_to, self.version = 0, 0, 7001
        self._places = list(places)
        self._looks = 0

    def look(self) -> Snapshot:
        self._looks += 1
        running = ProgramState.RUNNING if self.planned_to else ProgramState.LOADED
        program = ProgramStatus("p", running, self.line, "", planned_to=self.planned_to, planned_in="p.prog")
        place = self._places[0] if self._places else (0.0, 0.0, 0.0)
        state = RobotState(
            "left", "b", self._looks, Mode.READY, program, (), place, UPRIGHT, 0.1 if self.moves else 0.0, None,
            frames={"nest": self.version}, tool=self.tools.pop(0) if self.tools else "",
        )  # fmt: skip
        return Snapshot(robots={"left": state, "right": replace(state, robot="right")})

    def wait_for(self, condition: Callable[[Snapshot], bool], _timeout_s: float) -> Snapshot:
        for _ in range(3):
            if condition(seen := self.look()):
                break
        return seen

    def last(self, _pattern: str, _timeout_s: float) -> list[object]:
        return [replace(TOLD, frame="nest", parent="table"), TOLD]

    def manager_state(self) -> ManagerState:
        return ManagerState("c", "m", 7, 1, 0.0, "d")

    def check_robot(self, robot: str) -> None:
        assert robot in self.settings.robots

    def ask_manager(self, command: Command) -> Reply:
        self.asked.append(command)
        return self.reply

    def stepped(self) -> None:
        """The operator presses Enter at the next place."""
        self._places.pop(0)


def operator(cell: Cell) -> Connection:
    return cast(Connection, cell)


def connect_to(cell: Cell, monkeypatch: pytest.MonkeyPatch) -> None:
    @contextmanager
    def connected(*_: object) -> Iterator[Connection]:
        yield operator(cell)

    monkeypatch.setattr(module, "connect", connected)
    monkeypatch.setattr(module, "operator_name", lambda: "anna@pc")
    monkeypatch.setattr(module, "_APART_S", 0.0)


def run(cell: Cell, monkeypatch: pytest.MonkeyPatch, *words: str) -> str:
    """What the command prints; a `CommandError` comes through."""
    connect_to(cell, monkeypatch)
    result = CliRunner().invoke(app, ["frame", *words])
    if result.exception is not None and not isinstance(result.exception, SystemExit):
        raise result.exception
    return result.output


def test_show_says_where_each_frame_is_by_the_manager(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    cell = Cell(tmp_path)
    nest, table = run(cell, monkeypatch, "show").splitlines()
    at = "X 900.00 Y 0.00 Z 700.00 mm, A 0.0000 B 0.0000 C 0.0000 deg"
    assert table == f"table: {at}, given in world, version 7000"
    assert nest == f"nest: {at}, given in table, version 7000"
    assert run(cell, monkeypatch, "show", "table") == f"{table}\n"


@pytest.mark.parametrize(
    "words", [["show", "wall"], ["set", "wall", "--pose", "0,0,0,0,0,0"], ["teach", "wall", "left"]]
)
def test_a_frame_that_is_not_there_is_refused_with_those_that_are(
    words: tuple[str, ...], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with pytest.raises(CommandError, match=r"no frame 'wall' in cell\.yaml; its frames are: table, nest"):
        run(Cell(tmp_path), monkeypatch, *words)


@pytest.mark.parametrize("words", [("set", "line", "--pose", "0,0,0,0,0,0"), ("teach", "line", "left")])
def test_a_frame_with_a_zone_in_it_is_refused_before_anything_is_taught(
    words: tuple[str, ...], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    cell = Cell(tmp_path)
    fixed = replace(cell.settings.frames["table"], name="line", fixed=("zone handover", "the base of robot left"))
    cell.settings.frames["line"] = fixed
    with pytest.raises(CommandError, match="in it is zone handover, in it is the base of robot left"):
        run(cell, monkeypatch, *words)
    assert cell.asked == []


def test_set_gives_the_pose_in_metres_and_as_a_quaternion(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    cell = Cell(tmp_path)
    run(cell, monkeypatch, "set", "table", "--pose", "-900,0,700,0,0,180")
    (command,) = cell.asked
    assert isinstance(command, PlaceFrame)
    assert (command.position_m, command.by) == ((-0.9, 0.0, 0.7), "anna@pc")
    assert command.quaternion_xyzw == pytest.approx((0.0, 0.0, 1.0, 0.0), abs=1e-15)


@pytest.mark.parametrize("text", ["", "1,2,3", "1,2,3,4,5,x", "1,2,3,4,5,nan", "1e12,0,0,0,0,0", "0,0,0,0,0,0,0"])
def test_a_pose_is_six_numbers(text: str) -> None:
    with pytest.raises(CommandError, match="allowed are six numbers X,Y,Z,A,B,C in mm and deg"):
        parsed_pose(text)


class Typing:
    """Enter, at one place after the other."""

    def __init__(self, cell: Cell) -> None:
        self._cell, self._first = cell, True

    def readline(self) -> str:
        if not self._first:
            self._cell.stepped()
        self._first = False
        return "\n"


def taught(cell: Cell, monkeypatch: pytest.MonkeyPatch, origin: bool = False, yes: bool = True) -> None:
    monkeypatch.setattr(module.sys, "stdin", Typing(cell))
    monkeypatch.setattr(module.typer, "confirm", lambda _: yes)
    connect_to(cell, monkeypatch)
    module.teach("table", "left", origin=origin, file=cell.file, endpoint=None)


POINTS = ((0.5, 0.0, 0.0), (1.0, 0.0, 0.0), (0.5, 0.3, 0.0))


def test_teach_hands_on_the_points_at_which_the_robot_stood_and_says_what_they_allow(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    cell = Cell(tmp_path, *POINTS)
    taught(cell, monkeypatch)
    assert cell.asked == [TeachFrame("table", POINTS, "anna@pc")]
    told = capsys.readouterr().out
    assert "X 500.00 Y 0.00 Z 0.00 mm" in told
    assert "the points lie 500.0 mm along X and 300.0 mm aside: errors of 1 mm in each of them allow an origin" in told


def test_a_fourth_point_is_the_origin(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    cell = Cell(tmp_path, *POINTS, (0.0, 0.0, 0.1))
    taught(cell, monkeypatch, origin=True)
    assert cell.asked == [TeachFrame("table", POINTS, "anna@pc", (0.0, 0.0, 0.1))]


@pytest.mark.parametrize(("points", "yes", "says"), [
    ((*POINTS[:2], (1.5, 0.0, 0.0)), True, "the points lie in one line"),
    ((POINTS[0], POINTS[0], POINTS[2]), True, "two points are less than 1 mm apart"),
    (POINTS, False, "nothing was changed"),
])  # fmt: skip
def test_points_in_one_line_and_a_no_change_nothing(
    points: tuple[tuple[float, float, float], ...],
    yes: bool,
    says: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    cell = Cell(tmp_path, *points)
    with pytest.raises(CommandError, match=says):
        taught(cell, monkeypatch, yes=yes)
    assert cell.asked == []


def test_no_point_is_taken_of_a_robot_that_moves_or_does_not_know_where_it_is(tmp_path: Path) -> None:
    cell = Cell(tmp_path, None)
    with pytest.raises(CommandError, match="left does not know where it is"):
        standing_at(operator(cell), "left")
    cell = Cell(tmp_path / "2", *POINTS)
    cell.moves = True
    with pytest.raises(CommandError, match="left moves"):
        standing_at(operator(cell), "left")


def test_no_point_is_taken_while_nobody_has_said_which_tool_is_mounted(tmp_path: Path) -> None:
    cell = Cell(tmp_path, *POINTS)
    cell.tools = [None] * 10
    with pytest.raises(CommandError, match=r"nobody has said what left carries: `cell tool left NAME\|none`"):
        standing_at(operator(cell), "left")


def test_points_of_two_tools_give_no_frame(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    cell = Cell(tmp_path, *POINTS)
    cell.tools = ["probe"] * 8
    with pytest.raises(CommandError, match="points of no tool and probe: nothing was changed"):
        taught(cell, monkeypatch)
    assert cell.asked == []


def test_a_pushed_robot_stands_where_it_is_measured_twice(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    cell = Cell(tmp_path, *POINTS)
    monkeypatch.setattr(module.time, "sleep", lambda _: cell.stepped())
    with pytest.raises(CommandError, match="left moves"):
        standing_at(operator(cell), "left")


def test_points_that_are_near_to_each_other_allow_any_turn() -> None:
    text = allowed_by([(0.0, 0.0, 0.0), (0.0012, 0.0, 0.0), (0.0, 0.3, 0.0)])
    assert "allow any turn: measure them farther apart" in text


PLACE = PlaceFrame("table", (0.0, 0.0, 0.0), UPRIGHT, "me")


def test_after_it_has_moved_each_robot_with_things_in_it_says_from_which_line_on_that_counts(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    cell = Cell(tmp_path)
    cell.line, cell.planned_to = 3, 12
    move_frame(operator(cell), "table", PLACE)
    told = capsys.readouterr().out
    assert "manager: frame table moves\n" in told
    assert "keep the old place, until it is through line 12 of p.prog next; what comes after is planned with" in told
    cell.planned_to = 0
    move_frame(operator(cell), "nest", PLACE)
    assert "left: its next motions are planned with it\nright: its next motions" in capsys.readouterr().out


def test_a_robot_that_has_not_heard_of_it_is_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    cell = Cell(tmp_path)
    cell.version = 7000
    move_frame(operator(cell), "table", PLACE)
    assert "left: has not said that it knows; once it is heard it plans with it" in capsys.readouterr().out


def test_a_refusal_ends_the_command(tmp_path: Path) -> None:
    cell = Cell(tmp_path)
    cell.reply = Reply("1", False, "frame table does not move while the cell runs: in it is zone a")
    with pytest.raises(CommandError, match="manager refuses: frame table does not move while the cell runs"):
        move_frame(operator(cell), "table", PLACE)
