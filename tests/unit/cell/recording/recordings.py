"""Recordings for tests: the cell with two arms, and messages of it."""

from functools import cache
from pathlib import Path

from hypothesis import strategies as st

from cell.config import load_cell
from cell.messages import Event, GovernorStatus, Mode, ProgramState, ProgramStatus, RobotState, Severity
from cell.recording.cell_files import RecordedCell, recorded_cell
from cell.recording.json_form import KINDS
from cell.recording.reader import Recorded
from cell.recording.summary import Heard
from cell.recording.writer import Recording
from tests.unit.message_kinds import messages
from tests.unit.repository import ROOT

TWO_ARMS = load_cell(ROOT / "cell_configs" / "two_arms" / "cell.yaml")
JOINTS = {robot: tuple(f"J{i}" for i in range(1, 7)) for robot in TWO_ARMS.robots}
BEGIN = 1.7e9
PROGRAM = ProgramStatus("left.prog", ProgramState.RUNNING, 6, "ML X=100")
LEFT = RobotState("left", "b", 1, Mode.RUNNING, PROGRAM, None, None, None, 0.0, GovernorStatus(1.0, 0.5, 2.0, ""))
FAULT = Event("robot/left", 1, Severity.ALARM, "fault", "J2 is hot", "let it cool")
ANY = st.sampled_from(sorted(KINDS)).flatmap(lambda name: messages(KINDS[name]))


@cache
def two_arms() -> RecordedCell:
    return recorded_cell(TWO_ARMS, JOINTS)


def record(path: Path, heard: list[Heard]) -> Path:
    """A closed recording of these messages."""
    with Recording(path, two_arms(), BEGIN) as recording:
        for message, at in heard:
            recording.add(message, at)
    return path


def read(path: Path, since: float | None = None) -> list[Heard]:
    return list(Recorded(path).messages(since))
