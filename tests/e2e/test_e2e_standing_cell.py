"""One cell that is up and stands, and who comes to it: second processes, wrong names, old orders, a view."""

import os
import re
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from live_cell import LiveCell, Process, Recorder, ask, echo, wait_until

from cell.messages import Mode, RobotState, Run

README = Path(__file__).parents[2] / "README.md"
FROZEN_S = 0.3
"""Longer than what counts as a freeze; with the pause of keep-alives before it shorter than the lease of a link."""

pytestmark = pytest.mark.usefixtures("up")


@pytest.fixture(scope="module")
def live(tmp_path_factory: pytest.TempPathFactory) -> Iterator[LiveCell]:
    """The cell of all tests here: none of them may disturb it."""
    with LiveCell(tmp_path_factory.mktemp("standing")) as cell:
        yield cell


@pytest.fixture(scope="module")
def up(live: LiveCell) -> Iterator[Process]:
    """Its `cell up`, which SIGTERM ends in order."""
    up = live.up()
    up.wait_for_output("all robots enabled", 60.0)
    yield up
    up.signal(signal.SIGTERM)
    assert up.wait(30.0) == 0, up.output


def test_a_second_agent_on_this_host_is_told_who_runs(live: LiveCell) -> None:
    second = live.agent("left")
    assert second.wait(60.0) == 1
    assert "robot-left is already running" in second.output
    assert "next: " in second.output


def test_a_second_agent_from_elsewhere_is_refused_by_the_gateway(live: LiveCell) -> None:
    second = live.start("robot-agent", str(live.file), "left", "--state-dir", str(live.folder / "elsewhere"))
    assert second.wait(60.0) == 1
    assert "is owned by boot" in second.output


def test_a_second_manager_of_the_same_cell_is_told_so(live: LiveCell) -> None:
    second = live.start("cell", "manager", str(live.file), "--state-dir", str(live.folder / "elsewhere"))
    assert second.wait(60.0) == 1
    assert f"{live.settings.manager_endpoint} is in use" in second.output
    assert "Traceback" not in second.output


def test_a_second_cell_up_is_told_who_runs(live: LiveCell, up: Process) -> None:
    second = live.up()
    assert second.wait(60.0) == 1
    assert f"process {up.pid}" in second.output
    assert "next: " in second.output


def test_wrong_names_are_answered_with_the_right_ones(live: LiveCell) -> None:
    robot = live.order("run", "lefty")
    assert "its robots are: left, right" in robot.output
    zone = live.order("zone", "clear", "attic")
    assert "its zones are: handover" in zone.output
    assert robot.exit_code() == zone.exit_code() == 1


def test_the_subscriber_of_the_readme_prints_both_robots(live: LiveCell, tmp_path: Path) -> None:
    program = next(
        block for block in re.findall(r"```python\n(.*?)```", README.read_text(), re.S) if "zenoh.open" in block
    )
    script = tmp_path / "watch.py"
    endpoint = live.settings.manager_endpoint
    script.write_text(program.replace("tcp/127.0.0.1:7450", endpoint))
    assert endpoint in script.read_text(), "the README's subscriber connects to the example cell's rendezvous"
    printed = tmp_path / "printed"
    with (
        printed.open("wb") as out,
        subprocess.Popen([sys.executable, "-u", str(script)], stdout=out, stderr=subprocess.STDOUT) as watcher,
    ):
        try:
            for robot in live.settings.robots:
                wait_until(lambda name=robot: name in printed.read_text(), 20.0, f"a line about {robot}")
        finally:
            watcher.kill()


def test_a_run_sent_to_a_frozen_agent_is_refused_as_old(live: LiveCell) -> None:
    agent = live.pid_of("robot_agent", "left")
    with live.client() as session, ThreadPoolExecutor(1) as pool:
        states = Recorder(session, "robot/left/state")
        seen = states.wait_for(RobotState, lambda state: state.mode is Mode.READY, 10.0, "left ready")
        os.kill(agent, signal.SIGSTOP)
        try:
            answer = pool.submit(ask, session, "robot/left", Run(), echo(seen))
            threading.Event().wait(FROZEN_S)
        finally:
            os.kill(agent, signal.SIGCONT)
        reply = answer.result(10.0)
        assert not reply.ok
        assert "too old" in reply.text
        after = states.wait_for(RobotState, lambda state: state.sequence > seen.sequence, 10.0, "left after its freeze")
    assert after.mode is Mode.READY
