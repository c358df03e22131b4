"""What robots, models, drives, buses and times say about each other, and the example cell itself."""

from pathlib import Path

import pytest

from cell.commands.checks import check_cell
from cell.config import Severity, load_cell
from robot_agent.model import load_description
from tests.unit.config_world import CELL, CONFIGS, DRIVES, ROBOT, SIMULATION, TIMES, TWO_ARMS, Copy

RIGHT = "two_arms/right_drives.yaml"
PROGRAM = "two_arms/programs/left.prog"


def lines(copy: Copy) -> list[str]:
    bundle, problems = check_cell(copy.cell)
    assert bundle is None
    return [copy.shown(problem) for problem in problems]


def test_a_good_cell_gives_everything_its_processes_need() -> None:
    bundle, problems = check_cell(TWO_ARMS)
    assert problems == []
    assert bundle is not None
    assert bundle.cell == load_cell(TWO_ARMS)
    assert bundle.robots["left"].model.description.name == load_description(bundle.cell.robots["left"].model).name
    assert {name: list(gateway.robots) for name, gateway in bundle.gateways.items()} == {
        "left_bus": ["left"],
        "right_bus": ["right"],
    }


@pytest.mark.parametrize("path", sorted(CONFIGS.glob("*/cell.yaml")), ids=lambda path: path.parent.name)
def test_every_example_cell_is_good(path: Path) -> None:
    bundle, problems = check_cell(path)
    assert problems == []
    assert bundle is not None


@pytest.mark.parametrize(
    ("name", "old", "new", "at", "problem"),
    [
        (CELL, "gateway: right_bus", "gateway: left_bus", (CELL, "§left_bus\n    base: {X: 1800"),
         "robots.right.gateway: found 'left_bus', which drives left, allowed the gateway that drives right"),
        (CELL, "gateway: right_bus", "gateway: left_bus", (RIGHT, "robots:\n  §right"),
         "robots.right: found robot 'right', which the cell gives to gateway left_bus, allowed robots of gateway "
         "right_bus: none"),
        (DRIVES, "\n  left:\n", "\n  middle:\n", (DRIVES, "§middle:"),
         "robots.middle: found unknown robot 'middle', allowed robots of gateway left_bus: left"),
        (DRIVES, "      J6:\n", "      J7:\n", (DRIVES, "    §axes:"),
         "robots.left.axes: found the axes J1, J2, J3, J4, J5, J7, allowed the joints of BOOK6, in order: J1, J2, J3, "
         "J4, J5, J6"),
        (DRIVES, "speed: 121", "speed: 115", (DRIVES, "§115"),
         "robots.left.axes.J1.speed: found 115, allowed 115.5 or more, 1.05 times the speed of J1"),
        (DRIVES, "acceleration: 413", "acceleration: 375", (DRIVES, "§375"),
         "robots.left.axes.J2.acceleration: found 375, allowed 393.75 or more, 1.05 times the ramp of J2 (ramp_factor "
         "times its acceleration)"),
        (SIMULATION, "level: fast", "starts: {left: {J3: 76}}", (SIMULATION, "§76"),
         "starts.left.J3: found 76, allowed -170 to 75, the limits of J3"),
        (DRIVES, "gear: 80, counts_per_turn: 131072", "gear: 80, counts_per_turn: 33554432", (DRIVES, "gear: §80"),
         "robots.left.axes.J6.gear: found 80 times 33554432 counts per turn: 32 bits reach from -288 to 288, allowed a "
         "counter that reaches from -453 to 453, the limits of J6 and its following error"),
        (DRIVES, "cycle_s: 0.004", "cycle_s: 0.0041235", (DRIVES, "cycle_s: §0"),
         "cycle_s: found 0.0041235, allowed 1 to 255 times 1 ms, 0.1 ms, 10 us or 1 us (60C2h)"),
        (RIGHT, "two_arms_right", "two_arms_left", (RIGHT, "channel: §two_arms_left"),
         "bus.channel: found 'two_arms_left', the bus of gateway left_bus on the same host, allowed a bus of its own "
         "for gateway right_bus"),
        (CELL, TIMES, "times: {lead_s: 0.005}", (CELL, "§0.005"),
         "times.lead_s: found 0.005, allowed 0.008 or more, 2 cycles of gateway left_bus"),
        (CELL, TIMES, "times: {feedback_lost_s: 0.4}", (CELL, "§0.4}"),
         "times.feedback_lost_s: found 0.4, allowed more than 0.5, by which gateway left_bus may be late "
         "(overrun_limit_s)"),
        (DRIVES, "cycle_s: 0.004", "cycle_s: 0.18", (CELL, "feedback_lost_s: §0.8"),
         "times.feedback_lost_s: found 0.8, allowed 0.9 or more, 5 cycles of gateway left_bus"),
        (CELL, TIMES, "times: {estop_delay_s: 0.48}", (CELL, "§0.48"),
         "times.estop_delay_s: found 0.48, allowed 0.487 or more: nominal_s, 0.12, and the longest ramp, 0.367 of "
         "right.J6"),
        (ROBOT, "280, jerk: 2800", "280, acceleration_down: 30, jerk: 2800", (CELL, f"§{TIMES}"),
         "times.estop_delay_s: found 2, allowed 2.576 or more: nominal_s, 0.12, and the longest ramp, 2.46 of "
         "right.J1"),
        (PROGRAM, "RESET DO gripper", "RESET DO laser", (PROGRAM, "RESET DO §laser"),
         "program: found unknown output `laser`, allowed only gripper"),
        (PROGRAM, "WAIT 0.3", "WAIT DI door", (PROGRAM, "WAIT DI §door"),
         "program: found unknown input `door`, allowed none: this robot has none in its drives file"),
        (PROGRAM, "HOME F=80", "MEET load", (PROGRAM, "MEET §load"),
         "program: found unknown meeting `load`, allowed none: this robot is in none in the cell file"),
        (PROGRAM, "WAIT 0.3", "WAIT soon", (PROGRAM, "WAIT §soon"), "program: found `soon`, allowed a finite number"),
    ],
)  # fmt: skip
def test_each_contradiction_between_files_is_one_line_at_its_place(
    tmp_path: Path, name: str, old: str, new: str, at: tuple[str, str], problem: str
) -> None:
    copy = Copy(tmp_path).change(name, old, new)
    assert f"{copy.place(*at)}: {problem}" in lines(copy)


def test_problems_of_all_files_come_at_once_each_once_in_order(tmp_path: Path) -> None:
    copy = Copy(tmp_path).add(CELL, "colour: red").change(DRIVES, "node: 3", "node: 2")
    copy.change(ROBOT, "J5: 90, J6", "J5: 190, J6").change(PROGRAM, "WAIT 0.3", "WAIT soon")
    found = lines(copy)
    assert [line.split(":")[0] for line in found] == [CELL, ROBOT, DRIVES, PROGRAM]


def test_files_are_checked_although_the_cell_file_is_unusable(tmp_path: Path) -> None:
    copy = Copy(tmp_path).change(CELL, "length: mm", "length: inch").change(DRIVES, "node: 3", "node: 2")
    assert [line.split(":")[0] for line in lines(copy)] == [CELL, DRIVES]


def test_a_high_bus_load_is_a_warning_and_the_cell_is_good(tmp_path: Path) -> None:
    copy = Copy(tmp_path).change(DRIVES, "cycle_s: 0.004", "cycle_s: 0.0024")
    bundle, problems = check_cell(copy.cell)
    assert bundle is not None
    assert [problem.severity for problem in problems] == [Severity.WARNING]
    assert copy.shown(problems[0]) == (
        f"{copy.place(DRIVES, 'cycle_s: §0.0024')}: warning: cycle_s: found a bus load of 74 % (6 axes every 2.4 ms "
        "at 1000 kbit/s: 64 % with worst-case stuffing, and 10 % kept for SDO and EMCY), allowed up to 80 %, advised "
        "up to 70 %"
    )
