"""The one form in which lists are told to programs."""

import json

from cell.commands.client.cell_view import Snapshot
from cell.commands.client.json_lines import json_line, status_lines
from cell.messages import ManagerState, MeetingStatus, Mode, ProgramState, ProgramStatus, RobotState, ZoneState
from cell.messages.manager_state import ZoneStatus
from cell.net.codec import decode
from tests.unit.cell.recording.recordings import TWO_ARMS

PROGRAM = ProgramStatus("p", ProgramState.LOADED, 1, "")
LEFT = RobotState("left", "b", 1, Mode.READY, PROGRAM, (0.5, 1.0), None, None, None, None)
ZONE = ZoneStatus(ZoneState.GRANTED, "left", None, ("right",), 1, 0.0)


def test_a_line_has_kind_and_name_and_then_the_fields_of_the_message() -> None:
    line = json.loads(json_line("robot", "left", LEFT, silent=False))
    assert list(line)[:3] == ["kind", "name", "silent"]
    fields = {name: value for name, value in line.items() if name not in ("kind", "name", "silent")}
    assert decode(RobotState, json.dumps(fields).encode()) == LEFT


def test_a_line_is_one_line_whatever_people_wrote() -> None:
    assert len(json_line("event", "a\nb", {"text": "two\nlines\u2028and Ü"}).splitlines()) == 1


def test_a_status_names_everybody_also_who_is_silent() -> None:
    manager = ManagerState(
        "two_arms", "m", 1, 1, 0.0, "d", zones={"handover": ZONE}, meetings={"swap": MeetingStatus((), {})}
    )
    lines = [json.loads(line) for line in status_lines(TWO_ARMS, Snapshot({"left": LEFT}, manager=manager))]
    assert [(line["kind"], line["name"], line.get("silent")) for line in lines] == [
        ("manager", "two_arms", False),
        ("robot", "left", False),
        ("robot", "right", True),
        ("gateway", "left_bus", True),
        ("gateway", "right_bus", True),
        ("zone", "handover", None),
        ("meeting", "swap", None),
    ]
    assert lines[5]["holder"] == "left"
