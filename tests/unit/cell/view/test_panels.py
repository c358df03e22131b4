"""What the panels say, and that nothing that came from outside becomes part of the page's code."""

import re
from dataclasses import replace

import numpy as np
import pytest

from cell.core import Arrived
from cell.messages import AxisStatus, DriveFeedback, Estop, Event, Mode, NodeStatus, PlayoutState, Severity
from cell.view import panels
from cell.view.curves import Curves, Quantity
from cell.view.newest import Newest
from cell.view.now import NowLines
from cell.view.panels import Axes
from cell.view.rows import AXIS_HEADING, axis_rows
from tests.unit.cell.view.room import CELL, gateway, held_by, manager, presence, robot, seen

AXES = {"left": Axes(("J1", "Z"), (False, True)), "right": Axes(("J1", "Z"), (False, True))}
EVIL = "<img src=x onerror=alert(1)>"


def feedback(position: float = 0.5, behind: float = 0.001) -> DriveFeedback:
    at = np.full(2, position)
    axes = (AxisStatus.OPERATION_ENABLED,) * 2
    return DriveFeedback(
        "left", "g", 1, 5, 1, 1, PlayoutState.PLAYING, 9, 0, True, True, at, at * 0, at + behind, axes, at * 10
    )


def test_simulated_and_real_are_told_apart_and_one_real_bus_is_real() -> None:
    assert "SIMULATED" in panels.header(CELL, seen(manager(), gateway()))
    mixed = panels.header(CELL, seen(manager(), gateway(), gateway("right_bus", "socketcan")))
    assert "REAL" in mixed
    assert "SIMULATED" not in mixed
    assert "nobody answers" in panels.header(CELL, seen())


def test_an_emergency_stop_lists_who_stands_and_who_has_not_said_so() -> None:
    stopped = replace(manager(), estops=(Estop("e", True, "joe", "door open"),))
    stands = replace(presence("left", 0.0), estop_acknowledged="e")
    html = panels.header(CELL, seen(stopped, stands, replace(gateway(), estop_confirmed="e")))
    assert "EMERGENCY STOP by joe: door open" in html
    assert "robot left stands" in html
    assert "gateway left_bus stands" in html
    assert "robot right has not confirmed" in html


def test_a_forced_output_is_told_with_who_forced_it() -> None:
    forced = replace(gateway(), forced={"left": {"gripper": EVIL}})
    html = panels.drives(CELL, seen(forced), AXES)
    assert "output gripper of left is FORCED by &lt;img" in html


def at_line(line: int, text: str) -> str:
    program = replace(robot("left").program, name="left.prog", line=line, text=text)
    lines = tuple(f"ML X={number} F=100 ; <{number}>" for number in range(1, 100))
    return panels.programs(CELL, seen(replace(robot("left"), program=program)), {"left": lines})


def test_the_program_is_shown_around_its_line_and_another_file_only_by_its_own_line() -> None:
    html = at_line(50, "ML X=50 F=100")
    assert re.findall(r"<span style='background[^>]*>([^<]*)</span>", html) == ["   50  ML X=50 F=100 ; &lt;50&gt;"]
    assert re.findall(r"X=(\d+)", html) == [str(number) for number in range(42, 59)]
    assert re.findall(r"X=(\d+)", at_line(50, "MJ J1=0 X=7")) == ["7"]
    assert re.findall(r"X=(\d+)", at_line(0, "")) == [str(number) for number in range(1, 17)]
    assert re.findall(r"X=(\d+)", at_line(500, "ML X=8")) == ["8"]


def test_current_and_temperature_stand_in_the_row_of_the_axis_and_are_empty_where_nobody_tells_them() -> None:
    node = NodeStatus(
        3, "left", "J1", "operational", AxisStatus.OPERATION_ENABLED, current_a=-1.254, temperature_c=45.6
    )
    silent = replace(node, axis="Z", current_a=None, temperature_c=None)
    rows = axis_rows("left", AXES["left"], seen(replace(gateway(), nodes=(node, silent))))
    assert AXIS_HEADING[-2:] == ("current", "temp.")
    assert [row.cells[-2:] for row in rows[:2]] == [("-1.25 A", "46 °C"), ("", "")]
    html = panels.drives(CELL, seen(replace(gateway(), nodes=(node,))), {"left": AXES["left"]}).replace("&nbsp;", " ")
    assert "-1.25 A" in html
    assert "46 °C" in html
    assert ">temp.</th>" in html
    assert ">torque</th>" not in html, "no drive tells one"


def test_drives_are_told_in_the_units_of_their_axes() -> None:
    html = panels.drives(CELL, seen(feedback()), AXES).replace("&nbsp;", " ")
    assert "28.65 °" in html
    assert "500.00 mm" in html
    assert "+1.000" in html
    assert "5.0 Nm" in html
    assert "5.0 N<" in html


def test_a_drive_in_trouble_says_what_it_has() -> None:
    node = NodeStatus(3, "left", "J1", "operational", AxisStatus.FAULT, 0x3210, "DC link over-voltage")
    html = panels.drives(CELL, seen(replace(gateway(), nodes=(node,))), AXES)
    assert "Fault; 3210h DC link over-voltage" in html


def test_events_are_newest_first_with_their_remedy_and_can_be_filtered() -> None:
    newest = seen()
    for i, severity in enumerate(Severity):
        newest.look([Arrived(Event("manager", i, severity, f"code_{i}", f"text {i}", "do it"), 10.0 + i)], 10.0 + i)
    every = panels.events(newest.events, Severity.INFO, newest.now)
    assert every.index("text 2") < every.index("text 0")
    assert "do it" in every
    assert "text 0" not in panels.events(newest.events, Severity.WARNING, newest.now)


def test_a_burst_of_events_that_differ_by_numbers_is_one_line() -> None:
    newest = seen()
    for i, (at, what) in enumerate(
        [(0.0, "block"), (20.0, "block"), (21.0, "pause"), (25.0, "block"), (30.0, "block")]
    ):
        event = Event("gateway", i, Severity.INFO, "late", f"{what} {i} late", "")
        newest.look([Arrived(event, 100.0 + at)], 100.0 + at)
    html = panels.events(newest.events, Severity.INFO, newest.now)
    assert re.findall(r"(block|pause) (\d) late", html) == [("block", "4"), ("pause", "2"), ("block", "0")]
    assert html.count("(3 times in 10 s)") == 1


def test_the_cell_says_who_has_which_zone() -> None:
    html = panels.cell(seen(manager(handover=held_by("right"))))
    assert "handover" in html
    assert "right" in html
    assert "occupied" in html


def test_places_are_told_in_mm_and_deg() -> None:
    html = panels.places(CELL, seen(replace(robot(), joints=(0.1, 0.2))), AXES)
    assert "5.7&deg;" in html
    assert "200.0 mm" in html
    assert "1000.0" in html


@pytest.mark.parametrize("axes", [AXES, {}])
def test_what_is_sent_as_text_stays_text(axes: dict[str, Axes]) -> None:
    state = robot(mode=Mode.FAULT)
    program = replace(state.program, text=EVIL, name=EVIL, error=EVIL)
    evil = replace(state, program=program, alarms=(EVIL,), waiting_for=EVIL, tool=EVIL, part=EVIL)
    zone = replace(held_by(EVIL), queue=(EVIL,), reason=EVIL)
    boss = replace(manager(**{EVIL: zone}), estops=(Estop("e", True, EVIL, EVIL),), refused={EVIL: EVIL})
    node = NodeStatus(3, "left", "J1", EVIL, AxisStatus.FAULT, 1, EVIL)
    bus = replace(gateway(interface=EVIL), nodes=(node,), problem=EVIL, inputs={"left": {EVIL: True}})
    event = Event(EVIL, 1, Severity.ALARM, EVIL, EVIL, EVIL)
    newest = seen(evil, boss, bus, event)
    html = panels.header(CELL, newest) + panels.now(NowLines(CELL).of(newest)) + panels.cell(newest) + panels.note(EVIL)
    html += panels.drives(CELL, newest, axes) + panels.places(CELL, newest, axes)
    html += panels.events(newest.events, Severity.INFO, newest.now)
    assert "&lt;img" in html
    assert "<img" not in html


def test_curves_keep_the_last_minute_and_no_more() -> None:
    curves, newest = Curves(), Newest()
    for i in range(1000):
        now = 0.125 * i
        newest.look([Arrived(feedback(float(i)), now)], now)
        curves.look(newest)
    times, values = curves.of("left", Quantity.POSITION)
    assert times[0] >= -60.0
    assert times[-1] == 0.0
    assert values[-1].tolist() == [999.0, 999.0]
    assert len(times) == 481
    assert curves.of("left", Quantity.BEHIND)[1][0] == pytest.approx([0.001, 0.001])
    assert len(curves.of("nobody", Quantity.SPEED)[0]) == 0
