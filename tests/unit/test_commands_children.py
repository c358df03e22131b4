"""Processes of `cell up`: their order at the end, and what is said about one that dies."""

import threading
from pathlib import Path

import pytest

from cell.commands.children import Child, Children, Program

WAITS_FOR_ITS_PARENT = """
import os, signal, sys
from cell.commands.stop import stop_event
stop = stop_event(int(sys.argv[sys.argv.index("--parent-pipe") + 1]))
print("up", flush=True)
stop.wait()
with open("order", "a") as order:
    order.write(sys.argv[1] + "\\n")
"""
STUBBORN = "import signal; signal.signal(signal.SIGTERM, signal.SIG_IGN); print('up', flush=True); signal.pause()"
DIES = "import sys; print('first'); sys.exit('no such bus')"
DEADLINE_S = 20.0


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    for name, text in {"waiting": WAITS_FOR_ITS_PARENT, "stubborn": STUBBORN, "dying": DIES}.items():
        (tmp_path / f"child_{name}.py").write_text(text)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("PYTHONPATH", str(Path(__file__).parents[2]))
    return tmp_path


def program(part: str, kind: str) -> Program:
    return Program(part, f"child_{kind}", (part,), f"{kind} {part}")


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


def test_a_death_shows_the_last_lines_and_the_command(folder: Path) -> None:
    with Children([program("manager", "dying")], folder, threading.Event(), print) as children:
        pause = threading.Event()
        dead: list[Child] = []
        for _ in range(int(DEADLINE_S / 0.02)):
            if dead := children.deaths():
                break
            pause.wait(0.02)
        notice = dead[0].death_notice()
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
