"""What the table says about a robot, a zone and a gateway."""

import dataclasses

from cell.commands.client.cell_view import Snapshot, at_rest
from cell.commands.client.state_table import (
    cell_table,
    clock_line,
    gateway_line,
    labelled_why,
    meeting_line,
    robot_line,
    zone_line,
)
from cell.config import load_cell
from cell.messages import (
    AxisStatus,
    BusCounters,
    ClockStatus,
    GatewayState,
    GovernorStatus,
    MeetingStatus,
    Mode,
    NodeStatus,
    ParameterStatus,
    ProgramState,
    ProgramStatus,
    RobotState,
    VirtualStatus,
    ZoneState,
    ZoneStatus,
)
from cell.view.words import unreferenced, waited_text, why
from tests.unit.cell.commands.client.running_robot import RUNNING
from tests.unit.repository import ROOT

CELL = load_cell(ROOT / "cell_configs" / "two_arms" / "cell.yaml")


def test_a_robot_that_waits_says_for_what() -> None:
    waiting = dataclasses.replace(RUNNING, waiting_for="zone handover: held by right")
    assert robot_line("left", waiting) == "left: running, line 8 ML X=1650, waits: zone handover: held by right"


def test_inputs_that_are_forced_are_shown_whatever_the_robot_does() -> None:
    forced = dataclasses.replace(RUNNING, forced={"part": True, "door": False})
    assert robot_line("left", forced).endswith("ML X=1650, forced for its programs: part on, door off")


def test_outputs_that_are_forced_are_shown_with_who_forced_them() -> None:
    counters = BusCounters(100, 0, 0.0, 0, 0, 0, 0.3)
    state = GatewayState("left_bus", "b", 1, 0.004, "virtual", True, "", {}, None, (), counters)
    forced = dataclasses.replace(state, forced={"left": {"gripper": "anna@pc"}})
    assert gateway_line("left_bus", state).endswith("late cycles 0 of 100")
    assert gateway_line("left_bus", forced).endswith("of 100, output gripper of left is FORCED by anna@pc")


def test_what_is_set_is_shown() -> None:
    set_to = {"filter": ParameterStatus(200.0, "ms", "ann@desk", 3.0)}
    assert robot_line("left", dataclasses.replace(RUNNING, parameters=set_to)).endswith("ML X=1650, set: filter 200 ms")


def test_a_virtual_run_is_shown_beside_what_the_robot_does() -> None:
    program = dataclasses.replace(RUNNING.program, state=ProgramState.LOADED, line=0, text="")
    picture = VirtualStatus(
        Mode.RUNNING, RUNNING.program, RUNNING.joints, (0.1, 0.0, 0.5), None, 0.2, None, waiting_for="M 7"
    )
    state = dataclasses.replace(RUNNING, mode=Mode.READY, program=program, virtual=picture)
    assert robot_line("left", state) == (
        "left: ready, line 0 left.prog (loaded), virtual run running, line 8 ML X=1650, waits: M 7"
    )
    assert ", TCP at 100.0 0.0 500.0" in cell_table(CELL, Snapshot({"left": state}), 400).plain


def test_a_wait_of_the_program_says_since_when() -> None:
    program = dataclasses.replace(RUNNING.program, flag=7, waits_s=12.4)
    waiting = dataclasses.replace(RUNNING, program=program, waiting_for="M 7 waits for an answer")
    assert waited_text(waiting) == " (since 12 s)"
    assert "M 7 waits for an answer (since 12 s)" in lines(200, waiting)[3]


def test_a_silent_robot_is_called_silent() -> None:
    assert robot_line("left", None) == "left: silent"


def test_what_a_robot_holds_is_shown_and_that_nobody_has_said_it() -> None:
    assert labelled_why(dataclasses.replace(RUNNING, part="casting")).endswith("holds casting")
    unsaid = labelled_why(dataclasses.replace(RUNNING, part=None))
    assert unsaid.endswith(f"what it holds is unknown: cell part {RUNNING.robot}")
    assert "holds" not in labelled_why(RUNNING)


def test_the_mounted_tool_is_shown_and_that_nobody_has_said_it() -> None:
    assert labelled_why(dataclasses.replace(RUNNING, tool="torch", part="casting")).endswith(
        "tool torch, holds casting"
    )
    unsaid = labelled_why(dataclasses.replace(RUNNING, tool=None))
    assert unsaid.endswith(f"its tool is unknown: cell tool {RUNNING.robot}")


def test_an_alarm_goes_before_what_is_waited_for_and_is_said_once() -> None:
    alarmed = dataclasses.replace(RUNNING, waiting_for="a zone", alarms=("door open", "emergency stop: door open"))
    assert why(alarmed) == "emergency stop: door open"


def test_why_a_program_ended_is_no_alarm_once_its_cause_is_cleared() -> None:
    error = "emergency stop by joe: door open"
    program = ProgramStatus("left.prog", ProgramState.FAILED, 8, "ML X=1650", error)
    stopped = dataclasses.replace(RUNNING, mode=Mode.ESTOP, program=program, alarms=(error,))
    cleared = dataclasses.replace(stopped, mode=Mode.DISABLED)
    assert robot_line("left", stopped).endswith(f"alarm: {error}")
    assert robot_line("left", cleared).endswith(f"program ended: {error}")


def test_an_interrupted_program_says_what_is_possible_and_on_its_way_back_what_it_waits_for() -> None:
    error = "emergency stop by joe; J2 is 2.00 deg beside its path: `cell return left` brings it back slowly"
    program = ProgramStatus("left.prog", ProgramState.INTERRUPTED, 8, "ML X=1650", error)
    off_path = dataclasses.replace(RUNNING, mode=Mode.OFF_PATH, program=program, waiting_for="")
    returning = dataclasses.replace(off_path, mode=Mode.RETURNING, waiting_for="zone handover: held by right")
    assert robot_line("left", off_path).endswith(f"program interrupted: {error}")
    assert robot_line("left", returning).endswith("waits: zone handover: held by right")


def test_a_zone_names_its_holder_its_queue_and_its_reason() -> None:
    zone = ZoneStatus(ZoneState.ORPHANED, "left", None, ("right",), 1, 0.0, "left is silent")
    assert zone_line("handover", zone) == "zone handover: orphaned, last held by left, next right (left is silent)"


def test_a_meeting_names_who_waits_and_for_whom() -> None:
    meeting = MeetingStatus(("left", "third"), {"right": "which is halted"})
    assert meeting_line("load", meeting) == "meeting load: left, third wait for right, which is halted"
    assert meeting_line("load", MeetingStatus()) == "meeting load: nobody waits"


def test_it_says_what_each_process_takes_for_cell_time_and_how_well_it_knows() -> None:
    known = dataclasses.replace(RUNNING, clock=ClockStatus(-990.0, 0.0042))
    counters = BusCounters(1, 0, 0.0, 0, 0, 0, 0.3)
    gateway = GatewayState("left_bus", "g", 1, 0.004, "virtual", True, "", {}, None, (), counters)
    gateway = dataclasses.replace(gateway, clock=ClockStatus(-990.0, 0.0126))
    said = clock_line(CELL, Snapshot(robots={"left": known}, gateways={"left_bus": gateway}))
    assert said == (
        "cell time less own clock: left -990.000 s within 4 ms, right unknown, "
        "gateway left_bus -990.000 s within 13 ms, gateway right_bus unknown (50 ms allowed)"
    )


def lines(width: int, *robots: RobotState) -> list[str]:
    return cell_table(CELL, Snapshot(robots={state.robot: state for state in robots}), width).plain.splitlines()


def test_a_robot_that_must_home_has_no_place_and_is_told_what_to_do() -> None:
    nodes = tuple(
        NodeStatus(1 + k, "left", f"J{1 + k}", "operational", AxisStatus.SWITCH_ON_DISABLED) for k in range(3)
    )
    nodes = (
        nodes[0],
        *(
            dataclasses.replace(node, referenced=False, reference_missing="home it: cell home left")
            for node in nodes[1:]
        ),
    )
    counters = BusCounters(1, 0, 0.0, 0, 0, 0, 0.3)
    heard = GatewayState("left_bus", "g", 1, 0.004, "virtual", True, "", {}, None, nodes, counters)
    seen = Snapshot(robots={"left": dataclasses.replace(RUNNING, mode=Mode.DISABLED)}, gateways={"left_bus": heard})
    assert unreferenced(seen.gateways.values()) == {"left": "J2, J3: home it: cell home left"}
    shown = cell_table(CELL, seen, 120).plain.splitlines()
    assert "1000.0" not in shown[2]
    assert shown[3].strip() == "not referenced: J2, J3: home it: cell home left"
    starting = dataclasses.replace(heard, ready=False)
    assert unreferenced([starting]) == {}


def test_a_long_reason_goes_on_below_itself_and_in_one_line_where_there_is_room() -> None:
    where = "where right's link 4 may be; nearer than 30 mm they may only part"
    why_not = f"left's link 4 would come within 24.8 mm of {where}"
    waiting = dataclasses.replace(RUNNING, waiting_for=why_not)
    assert lines(80, waiting)[3:5] == [
        "       waits: left's link 4 would come within 24.8 mm of where right's link 4",
        "       may be; nearer than 30 mm they may only part",
    ]
    assert lines(1000, waiting)[3] == f"       waits: {why_not}"


def test_no_row_is_wider_than_the_terminal() -> None:
    program = ProgramStatus(
        "left.prog", ProgramState.RUNNING, 1008, "ML X=-1650.5 Y=-1000.5 Z=1350.25 A=10 B=90 C=0 F=900"
    )
    state = dataclasses.replace(RUNNING, program=program, zones=("handover",), tcp_position_m=(-1.6505, -1.0, 1.35))
    for width in (80, 100, 160):
        rows = [line for line in lines(width, state) if line.startswith(("robot", "left"))]
        assert len(rows) == 2
        assert max(map(len, rows)) <= width


def test_the_table_keeps_its_height_whatever_happens() -> None:
    waiting = dataclasses.replace(RUNNING, waiting_for="zone handover: held by right")
    assert len(lines(100)) == len(lines(100, RUNNING)) == len(lines(100, waiting))


def test_what_is_not_known_is_shown_as_such() -> None:
    row = next(line for line in lines(100, dataclasses.replace(RUNNING, tcp_position_m=None, tcp_speed_m_s=None))
               if line.startswith("left"))  # fmt: skip
    assert row.split()[-4:] == ["-", "-", "-", "-"]


def test_a_hand_that_turns_in_place_is_not_at_rest() -> None:
    assert not at_rest(dataclasses.replace(RUNNING, tcp_speed_m_s=0.0))


def test_path_time_that_stands_still_is_rest() -> None:
    stopped = GovernorStatus(0.0, 0.4, 2.0, "halted")
    assert at_rest(dataclasses.replace(RUNNING, tcp_speed_m_s=0.0, governor=stopped))


def test_the_end_of_a_motion_is_rest() -> None:
    ended = GovernorStatus(1.0, 2.0, 2.0, "")
    assert at_rest(dataclasses.replace(RUNNING, tcp_speed_m_s=0.0, governor=ended))
