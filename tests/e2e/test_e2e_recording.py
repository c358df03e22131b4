"""A live cell is recorded: a fault replays to the same last state, and a killed recorder loses less than a second."""

import json
import signal
import time
from pathlib import Path
from typing import Any

import pytest
from live_cell import LiveCell, Process, wait_until
from mcap.reader import make_reader

from cell.messages import Event, Mode, RobotState
from cell.recording.reader import Recorded
from cell.recording.summary import summary
from tests.unit.message_kinds import same

KINDS_OF_A_CELL = {
    "DriveFeedback",
    "GatewayState",
    "ManagerState",
    "Presence",
    "RobotState",
    "SetpointBlock",
    "ZoneGeometry",
}


def recorder(live: LiveCell, path: Path) -> Process:
    process = live.start("cell", "record", str(path), "-f", str(live.file))
    process.wait_for_output("recording cell two_arms", 20.0)
    return process


def replayed(path: Path, live: LiveCell) -> dict[tuple[str, str], Any]:
    """What `cell replay --json` says last, by kind and name."""
    process = live.start("cell", "replay", str(path), "--json")
    assert process.wait(60.0) == 0, process.output
    lines = [json.loads(line) for line in process.output.splitlines()]
    return {(line["kind"], line["name"]): line for line in lines}


@pytest.fixture
def running(live: LiveCell) -> Process:
    """The two arms run their programs."""
    up = live.up("--run")
    up.wait_for_output("all robots enabled", 30.0)
    return up


def test_a_fault_is_recorded_kept_and_replayed(live: LiveCell, running: Process, tmp_path: Path) -> None:
    path, killed = tmp_path / "a.mcap", tmp_path / "killed.mcap"
    recording, victim = recorder(live, path), recorder(live, killed)
    with live.client() as session:
        states = session.watch("robot/left/state")
        kept = wait_until(lambda: _fresh(killed), 60.0, "a file with all but the last second")
        victim.signal(signal.SIGKILL)
        victim.wait(20.0)
        live.obeyed("estop", "--reason", "test")
        last = wait_until(lambda: _in_mode(states.take_new(), Mode.ESTOP), 20.0, "left under the emergency stop")
        running.wait_for_output("what happened before the alarm is kept", 60.0)
    recording.signal(signal.SIGINT)
    assert recording.wait(60.0) == 0, recording.output  # it writes all that it has heard
    status = replayed(path, live)
    assert status["robot", "left"]["mode"] == status["robot", "right"]["mode"] == "estop"
    assert [stop["reason"] for stop in status["manager", "two_arms"]["estops"]] == ["test"]
    _complete(path, last)
    _cut(killed, kept)
    _kept(live)


def _in_mode(messages: list[object], mode: Mode) -> RobotState | None:
    return next((each for each in messages if isinstance(each, RobotState) and each.mode is mode), None)


def _complete(path: Path, seen: RobotState) -> None:
    """The closed file is valid, has every kind of message of such a cell, and what somebody else heard meanwhile."""
    with path.open("rb") as file:
        statistics = make_reader(file, validate_crcs=True).get_summary()
    assert statistics is not None
    assert statistics.statistics is not None
    messages = [message for message, _ in Recorded(path).messages()]
    assert {type(each).__name__ for each in messages} >= KINDS_OF_A_CELL
    assert any(same(seen, each) for each in messages)
    for robot in ("left", "right"):
        sequences = [each.sequence for each in messages if isinstance(each, RobotState) and each.robot == robot]
        assert len(sequences) > 0.9 * (sequences[-1] - sequences[0] + 1)


def _fresh(path: Path) -> float | None:
    """When the newest message in a file that is being written was heard, if that is hardly more than a second ago."""
    began, newest = Recorded(path).span()
    return newest if newest > began and newest > time.time() - 1.5 else None


def _cut(path: Path, kept: float) -> None:
    """What was in the file before its recorder was killed can still be read."""
    recorded = Recorded(path)
    times = [at for _, at in recorded.messages()]
    assert recorded.cut
    assert times[-1] >= kept


def _kept(live: LiveCell) -> None:
    """`cell up` has kept what came before the alarm, where the zone is included."""
    (file,) = (live.state_dir / "recordings").iterdir()
    messages = list(Recorded(file).messages())
    assert {type(message).__name__ for message, _ in messages} >= KINDS_OF_A_CELL
    alarms = [at for message, at in messages if isinstance(message, Event) and message.code == "estop"]
    assert messages[0][1] < alarms[0] < messages[-1][1]
    found = summary(messages, messages[0][1])
    assert {span.what for span in found.modes["left"]} >= {"running", "estop"}
    assert found.alarms


def test_nobody_to_record_is_one_sentence(live: LiveCell, tmp_path: Path) -> None:
    nobody = live.start("cell", "record", str(tmp_path / "a.mcap"), "-f", str(live.file))
    assert nobody.wait(20.0) == 1
    assert "nobody of cell two_arms answers" in nobody.output
    assert not (tmp_path / "a.mcap").exists()
