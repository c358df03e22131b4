"""The manager's process, run in a thread, against a real Zenoh client."""

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import pytest

from cell.config.settings import CellSettings, FrameSettings, PoseSettings
from cell.manager.shell import SecondManager, run_manager
from cell.messages import FramePose, Heard, ManagerState, PlaceFrame, Presence, SetEstop, Who, ZoneGeometry, ZoneState
from cell.net.errors import EndpointInUse
from cell.net.options import Link, ZenohOptions
from cell.net.session import CellSession, new_call
from tests.ports import free_endpoint
from tests.unit.config_world import TWO_ARMS
from tests.unit.manager_world import ball, settings

DEADLINE_S = 15.0


@contextmanager
def running(cell: CellSettings, state_dir: Path, options: ZenohOptions | None = None) -> Iterator[None]:
    """A manager in a thread; its exception, if any, is raised at the end."""
    stop, outcome = threading.Event(), list[object]()

    def run() -> None:
        try:
            outcome.append(run_manager(cell, options or ZenohOptions(), state_dir, stop))
        except Exception as error:
            outcome.append(error)

    thread = threading.Thread(target=run)
    thread.start()
    try:
        yield
    finally:
        stop.set()
        thread.join(DEADLINE_S)
    assert outcome == [0]


@pytest.fixture
def cell() -> CellSettings:
    return replace(settings(), manager_endpoint=free_endpoint())


class Robots:
    """Both robots of the cell in one client session; left wants the zone."""

    def __init__(self, cell: CellSettings) -> None:
        link = Link("client", connect=(cell.manager_endpoint,), open_timeout_s=DEADLINE_S)
        self.session = CellSession(cell.name, link, "robot", "both", "b1")
        self.state: ManagerState | None = None
        self.geometry: list[ZoneGeometry] = []
        self.sequence = 0

    def __enter__(self) -> "Robots":
        self.session.__enter__()
        self.inbox = self.session.watch("manager/state", "zone/*")
        return self

    def __exit__(self, *_: object) -> None:
        self.session.close()

    def until(self, condition: Callable[[ManagerState], bool]) -> ManagerState:
        deadline, pause = time.monotonic() + DEADLINE_S, threading.Event()
        while self.state is None or not condition(self.state):
            assert time.monotonic() < deadline, f"did not happen in time: {self.state}"
            self._exchange()
            pause.wait(0.01)
        return self.state

    def _exchange(self) -> None:
        for message in self.inbox.take_new():
            if isinstance(message, ManagerState):
                self.state = message
            elif isinstance(message, ZoneGeometry):
                self.geometry.append(message)
        self.sequence += 1
        heard = Heard(self.state.boot, self.state.sequence) if self.state else None
        estop = self.state.estops[0].id if self.state and self.state.estops else None
        for robot, wants in (("left", {"middle": 0.0}), ("right", dict[str, float]())):
            presence = Presence(robot, "b1", 1, self.sequence, heard, "digest", ball(1.0), 0.0, {}, wants, estop)
            self.session.publish(presence)


@contextmanager
def cell_of(cell: CellSettings, state_dir: Path) -> Iterator[Robots]:
    with running(cell, state_dir), Robots(cell) as robots:
        yield robots


def test_a_manager_grants_answers_and_keeps_its_stop_over_a_restart(cell: CellSettings, tmp_path: Path) -> None:
    with cell_of(cell, tmp_path) as robots:
        granted = robots.until(lambda state: state.zones["middle"].state is ZoneState.GRANTED)
        assert granted.zones["middle"].holder == "left"
        robots.until(lambda _: bool(robots.geometry))
        assert "manager of cell line" in robots.session.ask("manager", new_call(Who()), DEADLINE_S).text
        assert robots.session.ask("manager", new_call(SetEstop("e1", "me", "test")), DEADLINE_S).ok
    with cell_of(cell, tmp_path) as robots:
        again = robots.until(lambda state: bool(state.estops))
        assert [estop.id for estop in again.estops] == ["e1"]
        assert again.epoch > granted.epoch
        assert robots.session.ask("manager", new_call(Who()), DEADLINE_S).ok


def test_a_frame_is_moved_in_the_file_and_told_to_who_asks_later(cell: CellSettings, tmp_path: Path) -> None:
    file = tmp_path / "cell.yaml"
    frames = "frames: {table: {pose: {X: 0, Y: 0, Z: 0, A: 0, B: 0, C: 0}}}  # here\n"
    file.write_text(TWO_ARMS.read_text() + frames)
    table = FrameSettings("table", None, PoseSettings((0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0)))
    with cell_of(replace(cell, file=file, frames={"table": table}), tmp_path) as robots:
        state = robots.until(lambda state: "table" in state.frames)
        (before,) = robots.session.last("frame/*", DEADLINE_S)
        assert isinstance(before, FramePose)
        assert before.version == state.frames["table"]
        command = PlaceFrame("table", (0.1, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0), "me")
        reply = robots.session.ask("manager", new_call(command, Heard(state.boot, state.sequence)), DEADLINE_S)
        assert reply.ok, reply.text
        robots.until(lambda state: state.frames["table"] > before.version)
        (after,) = robots.session.last("frame/*", DEADLINE_S)
        assert isinstance(after, FramePose)
        assert (after.position_m, after.version > before.version) == ((0.1, 0.0, 0.0), True)
    assert file.read_text().endswith(frames.replace("X: 0", "X: 100"))


def test_a_second_manager_at_the_same_endpoint_is_told_about_the_first(cell: CellSettings, tmp_path: Path) -> None:
    with cell_of(cell, tmp_path) as robots:
        robots.until(lambda _: True)
        with pytest.raises(EndpointInUse, match="manager of cell line"):
            run_manager(cell, ZenohOptions(), tmp_path, threading.Event())


def test_a_second_manager_elsewhere_is_told_about_the_first(cell: CellSettings, tmp_path: Path) -> None:
    with cell_of(cell, tmp_path) as robots:
        robots.until(lambda _: True)
        options = ZenohOptions(listen=("tcp/127.0.0.1:0",), connect=(cell.manager_endpoint,))
        with pytest.raises(SecondManager, match="a cell has exactly one"):
            run_manager(cell, options, tmp_path, threading.Event())
