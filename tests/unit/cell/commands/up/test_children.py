"""Processes of `cell up`: their order at the end, and what is said about one that dies."""

import threading
from pathlib import Path

import pytest

from cell.commands.up.children import Child, ChildProgram, Children, programs
from cell.config import load_cell
from tests.unit.config_world import TWO_ARMS
from tests.unit.repository import ROOT

WAITS_FOR_ITS_PARENT = """
import os, signal, sys
from cell.commands.processes.stop import stop_event
stop = stop_event(int(sys.argv[sys.argv.index("--parent-pipe") + 1]))
print("up", flush=True)
stop.wait()
with open("order", "a") as order:
    order.write(sys.argv[1] + "\\n")
"""
STUBBORN = "import signal; signal.signal(signal.SIGTERM, signal.SIG_IGN); print('up', flush=True); signal.pause()"
DIES = "import sys; print('first'); sys.exit('no such bus')"
FAILS = """
import signal, sys
def fail(*_):
    sys.exit("not at rest")
signal.signal(signal.SIGTERM, fail)
print("up", flush=True)
while True:
    signal.pause()
"""
LEAVES = "print('up')"
SILENT = "import sys; sys.exit(1)"
DEADLINE_S = 20.0


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    kinds = {
        "waiting": WAITS_FOR_ITS_PARENT,
        "stubborn": STUBBORN,
        "dying": DIES,
        "failing": FAILS,
        "leaving": LEAVES,
        "silent": SILENT,
    }
    for name, text in kinds.items():
        (tmp_path / f"child_{name}.py").write_text(text)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    return tmp_path


def program(part: str, kind: str) -> ChildProgram:
    return ChildProgram(part, f"child_{kind}", (part,), f"{kind} {part}")


def wait_until_up(folder: Path, part: str) -> None:
    log = folder / f"{part.replace(' ', '-')}.log"
    pause = threading.Event()
    for _ in range(int(DEADLINE_S / 0.02)):
        if "up" in log.read_text():
            return
        pause.wait(0.02)
    raise AssertionError(f"{part} is not up after {DEADLINE_S} s")


def test_agents_end_before_gateways_before_the_manager(folder: Path) -> None:
    parts = ["manager", "gateway bus", "robot left"]
    with Children([program(part, "waiting") for part in parts], folder, threading.Event(), print):
        for part in parts:
            wait_until_up(folder, part)
    assert (folder / "order").read_text().splitlines() == ["robot left", "gateway bus", "manager"]


def test_one_that_does_not_end_is_killed_and_named(folder: Path) -> None:
    said: list[str] = []
    hurry = threading.Event()
    hurry.set()
    with Children([program("manager", "stubborn")], folder, hurry, said.append):
        wait_until_up(folder, "manager")
    assert "manager did not end" in said[0]


def test_the_log_of_the_run_before_is_kept_and_not_shown_as_the_last_lines(folder: Path) -> None:
    log = folder / "manager.log"
    log.write_text("long ago\n")
    with Children([program("manager", "dying")], folder, threading.Event(), print) as children:
        pause = threading.Event()
        for _ in range(int(DEADLINE_S / 0.02)):
            if dead := children.deaths():
                break
            pause.wait(0.02)
    assert log.read_text().splitlines() == ["long ago", "first", "no such bus"]
    assert "long ago" not in dead[0].death_notice()


def test_one_that_had_to_be_killed_did_not_end_in_order(folder: Path) -> None:
    hurry = threading.Event()
    hurry.set()
    with Children([program("manager", "stubborn")], folder, hurry, print) as children:
        wait_until_up(folder, "manager")
    assert children.out_of_order() == ["manager"]


def test_one_that_ends_with_an_error_when_it_is_told_to_end_is_named(folder: Path) -> None:
    said: list[str] = []
    with Children([program("robot left", "failing")], folder, threading.Event(), said.append) as children:
        wait_until_up(folder, "robot left")
    assert children.out_of_order() == ["robot left"]
    assert "robot left ended with exit code 1" in said[0]
    assert "| not at rest" in said[0]


def test_those_who_end_as_they_are_told_ended_in_order(folder: Path) -> None:
    with Children([program("manager", "waiting")], folder, threading.Event(), print) as children:
        wait_until_up(folder, "manager")
    assert children.out_of_order() == []


def test_one_that_died_before_the_end_did_not_end_in_order_whatever_its_exit_code(folder: Path) -> None:
    with Children([program("manager", "leaving")], folder, threading.Event(), print) as children:
        pause = threading.Event()
        for _ in range(int(DEADLINE_S / 0.02)):
            if children.all_dead():
                break
            pause.wait(0.02)
    assert children.out_of_order() == ["manager"]


def death(folder: Path, kind: str) -> str:
    """What is said of a manager that ends by itself."""
    with Children([program("manager", kind)], folder, threading.Event(), print) as children:
        pause = threading.Event()
        dead: list[Child] = []
        for _ in range(int(DEADLINE_S / 0.02)):
            if dead := children.deaths():
                break
            pause.wait(0.02)
        return dead[0].death_notice()


def test_a_death_without_a_word_names_the_log_and_its_disk(folder: Path) -> None:
    notice = death(folder, "silent")
    assert (
        f"manager ended with exit code 1; {folder / 'manager.log'} has nothing of this run; has its disk room?"
        in notice
    )


def test_a_death_shows_the_last_lines_and_the_command(folder: Path) -> None:
    notice = death(folder, "dying")
    assert "manager ended with exit code 1" in notice
    assert "| no such bus" in notice
    assert "start it again with: dying manager" in notice


def test_the_end_of_the_parent_reaches_the_child(folder: Path) -> None:
    child = Child(program("manager", "waiting"), folder)
    wait_until_up(folder, "manager")
    child.close()
    pause = threading.Event()
    for _ in range(int(DEADLINE_S / 0.02)):
        if child.exit_code() is not None:
            break
        pause.wait(0.02)
    assert child.exit_code() == 0


def test_every_process_logs_json_where_the_cell_is_to_and_says_so_in_the_command_that_starts_it_again() -> None:
    started = programs(load_cell(TWO_ARMS), None, simulate=True, log_json=True)
    assert len(started) == 5
    assert all("--log-json" in each.arguments and each.command.endswith(" --log-json") for each in started)
    assert not any("--log-json" in each.arguments for each in programs(load_cell(TWO_ARMS), None, simulate=True))
