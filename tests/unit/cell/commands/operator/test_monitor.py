"""The screen of `cell monitor`: what it shows of a cell, and what its keys do."""

import errno
import os
import pty
import termios
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from io import StringIO

import pytest
from rich.console import Console

from cell.commands.operator.keyboard import DOWN, UP, Keyboard
from cell.commands.operator.monitor import Screen, until_hung_up
from cell.config import load_cell
from cell.core import Arrived
from cell.messages import Command, Continue, Event, Halt, Heard, JogHeld, ManagerState, Mode, Reply, Severity
from cell.view.desk import NoAnswer
from cell.view.rows import Axes
from tests.unit.cell.commands.client.running_robot import RUNNING
from tests.unit.repository import ROOT

CELL = load_cell(ROOT / "cell_configs" / "two_arms" / "cell.yaml")
AXES = {name: Axes(("J1", "J2"), (False, True)) for name in ("left", "right")}
MANAGER = ManagerState("two_arms", "m", 1, 1, 0.0, "d")
DEADLINE_S = 10.0


@dataclass
class Messages:
    """A source that gives what it is given."""

    new: list[object] = field(default_factory=list)
    at: float = 10.0

    def take_new(self) -> list[Arrived]:
        new, self.new = self.new, []
        return [Arrived(message, self.at) for message in new]

    def now(self) -> float:
        return self.at


@dataclass
class Asked:
    """A desk that notes what it is asked for."""

    operator: str = "test"
    orders: list[tuple[str, Command, Heard]] = field(default_factory=list)
    stops: list[Callable[[str], None]] = field(default_factory=list)
    silent: bool = False
    refuses: bool = False

    def ask(self, to: str, command: Command, heard: Heard) -> Reply:
        self.orders.append((to, command, heard))
        if self.silent:
            raise NoAnswer(f"halt: {to} gave no usable answer")
        return Reply("id", not self.refuses, f"answer {len(self.orders)}")

    def hold(self, message: JogHeld) -> None:
        raise AssertionError(message)

    def stop_all(self, tell: Callable[[str], None]) -> None:
        self.stops.append(tell)


@dataclass
class World:
    desk: Asked = field(default_factory=Asked)
    source: Messages = field(default_factory=Messages)
    screen: Screen = field(init=False)

    def __post_init__(self) -> None:
        self.screen = Screen(CELL, AXES, self.desk, control=True)

    def hears(self, *messages: object) -> None:
        self.source.new += messages
        self.screen.look(self.source)

    def text(self, width: int = 120, height: int = 40) -> str:
        out = StringIO()
        Console(file=out, width=width, height=height).print(self.screen.drawn(width, height))
        return out.getvalue()

    def answered(self, text: str) -> None:
        """Wait until the screen shows an answer; it comes from a thread."""
        deadline = time.monotonic() + DEADLINE_S
        while text not in self.text():
            assert time.monotonic() < deadline


@pytest.fixture
def world() -> World:
    world = World()
    world.hears(MANAGER, RUNNING, replace(RUNNING, robot="right", mode=Mode.HALTED))
    return world


def test_each_robot_has_its_program_line_and_what_to_do_next(world: World) -> None:
    shown = world.text().splitlines()
    assert shown[1].startswith("> left running  8  ML X=1650  rate 100 %")
    assert "next: nothing: it runs" in shown[3]
    assert "  right halted" in shown[4]
    assert "next: let it go on: Continue (cell continue right)" in shown[6]


def test_who_is_silent_is_told_with_the_command_that_starts_it(world: World) -> None:
    world.source.at += 2.0
    world.hears()
    assert "left silent" in world.text()
    assert f"start its agent: robot-agent {CELL.file} left" in world.text()


@pytest.mark.parametrize("height", [1, 2, 5, 12, 40, 100])
@pytest.mark.parametrize("width", [20, 80, 200])
def test_it_fits_into_any_terminal_and_the_keys_are_always_told(world: World, width: int, height: int) -> None:
    world.hears(Event("manager", 1, Severity.ALARM, "estop", "stopped " * 40, "reset it"))
    shown = world.text(width, height).splitlines()
    assert len(shown) == height
    assert max(map(len, shown)) <= width
    assert " arrows: left" in shown[-1]


def test_a_key_orders_the_chosen_robot_in_view_of_its_state(world: World) -> None:
    for key in ("h", DOWN, "c", UP, "h"):
        world.screen.press(key)
        if key not in (UP, DOWN):
            world.answered(f"answer {len(world.desk.orders)}")
    assert world.desk.orders == [
        ("robot/left", Halt(), Heard("b", 1)),
        ("robot/right", Continue(), Heard("b", 1)),
        ("robot/left", Halt(), Heard("b", 1)),
    ]


def test_without_control_nothing_is_set_in_motion_and_every_stop_goes_out() -> None:
    world = World()
    world.screen.control = False
    world.hears(RUNNING)
    world.screen.press("c")
    assert "not without --control" in world.text()
    assert "c continue" not in world.text()
    world.screen.press("e")
    world.screen.press("h")
    world.answered("left: answer 1")
    assert [command for _, command, _ in world.desk.orders] == [Halt()]
    assert len(world.desk.stops) == 1


def test_an_emergency_stop_is_sent_only_once_its_doors_say_so(world: World) -> None:
    world.screen.press("e")
    assert "sending an emergency stop" in world.text()
    assert "stop sent" not in world.text()
    world.desk.stops[0]("NO emergency stop was sent")
    assert "NO emergency stop was sent" in world.text()


def test_a_robot_that_was_not_heard_is_not_asked_and_one_that_does_not_answer_is_told() -> None:
    world = World()
    world.screen.press("h")
    assert "left: its agent does not answer; nothing was sent" in world.text()
    world.desk.silent = True
    world.hears(RUNNING)
    world.screen.press("h")
    world.answered("gave no usable answer")
    world.desk.silent, world.desk.refuses = False, True
    world.screen.press("h")
    world.answered("left refuses: answer 2")


def test_events_are_filtered_and_stand_still_while_paused(world: World) -> None:
    world.hears(Event("manager", 1, Severity.INFO, "a", "small news"), Event("manager", 2, Severity.ALARM, "b", "loud"))
    assert "small news" in world.text()
    world.screen.press("f")
    assert "small news" not in world.text()
    assert "0 s ago  manager: loud" in world.text()
    world.screen.press("p")
    world.hears(Event("manager", 3, Severity.ALARM, "c", "later"))
    assert "later" not in world.text()
    assert "PAUSED" in world.text()
    world.screen.press("p")
    assert "later" in world.text()


def test_any_other_key_does_nothing_and_q_ends_it(world: World) -> None:
    for key in ("", "x", "H", "\x01", " "):
        world.screen.press(key)
    assert not world.desk.orders
    assert not world.screen.done
    world.screen.press("q")
    assert world.screen.done


# The keyboard, on a terminal of its own


@pytest.fixture
def terminal(monkeypatch: pytest.MonkeyPatch) -> Iterator[int]:
    """Where a test types; standard input is the other end."""
    typed, shown = pty.openpty()
    with os.fdopen(shown, "rb", buffering=0) as stdin:
        monkeypatch.setattr("sys.stdin", stdin)
        yield typed


@pytest.mark.parametrize(
    ("pressed", "key"),
    [(b"h", "h"), (b"\x1b[A", UP), (b"\x1b[B", DOWN), (b"\x1bOB", DOWN), (b"\t", DOWN), (b"\x1b", ""), (b"\xc3", "")],
)
def test_a_key_is_read_without_a_line(terminal: int, pressed: bytes, key: str) -> None:
    with Keyboard() as keyboard:
        os.write(terminal, pressed)
        assert keyboard.key(DEADLINE_S) == key
        assert keyboard.key(0.0) == ""
        assert not keyboard.gone


def test_no_key_is_no_key_and_a_closed_terminal_is_told(terminal: int) -> None:
    with Keyboard() as keyboard:
        assert keyboard.key(0.01) == ""
        os.write(terminal, b"\x1b[Ae")
        assert [keyboard.key(DEADLINE_S), keyboard.key(DEADLINE_S)] == [UP, "e"]
        os.close(terminal)
        assert keyboard.key(DEADLINE_S) == ""
        assert keyboard.gone


@pytest.mark.parametrize("error", [OSError(errno.EIO, "gone"), termios.error(errno.EIO, "gone")])
def test_a_terminal_that_has_gone_ends_it_quietly(error: Exception) -> None:
    with until_hung_up():
        raise error


def test_any_other_trouble_with_the_terminal_is_told() -> None:
    with pytest.raises(OSError, match="full"), until_hung_up():
        raise OSError(errno.ENOSPC, "full")
