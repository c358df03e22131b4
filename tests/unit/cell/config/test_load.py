"""The cell file: SI settings of a good one, all problems of a bad one, each with its printed line."""

from pathlib import Path

import pytest

from cell.config import ConfigError, load_cell, load_cell_alone
from cell.config.settings import OnManagerReturn, SeparationSettings, Times
from tests.unit.config_world import CELL, TIMES, TWO_ARMS, Copy


def lines(copy: Copy) -> list[str]:
    with pytest.raises(ConfigError) as caught:
        load_cell(copy.cell)
    return [copy.shown(problem) for problem in caught.value.problems]


def test_the_example_is_in_si_with_absolute_paths_and_defaults() -> None:
    cell = load_cell(TWO_ARMS)
    assert (cell.name, cell.times, cell.on_manager_return) == (
        "two_arms",
        Times(feedback_lost_s=0.8, owner_silent_s=2.0),
        OnManagerReturn.CONTINUE,
    )
    assert cell.robots["right"].base.position_m == (1.8, 0.0, 0.0)
    assert cell.robots["right"].base.quaternion_xyzw == pytest.approx((0, 0, 1, 0))
    assert cell.zones["handover"].size_m == (0.9, 2.6, 2.6)
    assert cell.robots["left"].model == TWO_ARMS.parents[1] / "models" / "six_axis.yaml"
    assert all(gateway.drives.is_absolute() for gateway in cell.gateways.values())


def test_angles_turn_about_the_fixed_axes(tmp_path: Path) -> None:
    copy = Copy(tmp_path).change(CELL, "A: 0, B: 0, C: 180", "A: 90, B: 0, C: 90")
    # First +90 deg about X, then +90 deg about the fixed Z: (0, 0, s, s) * (s, 0, 0, s).
    assert load_cell(copy.cell).robots["right"].base.quaternion_xyzw == pytest.approx((0.5, 0.5, 0.5, 0.5))


def test_metres_and_millimetres_mean_the_same_and_have_the_same_digest(tmp_path: Path) -> None:
    copy = Copy(tmp_path).change(CELL, "length: mm", "length: m")
    copy.change(CELL, "X: -1800", "X: -1.8").change(CELL, "X: 1800", "X: 1.8")
    copy.change(CELL, "[900, 2600, 2600]", "[0.9, 2.6, 2.6]").change(CELL, "Z: 1400", "Z: 1.4")
    assert load_cell(copy.cell).digest == load_cell(TWO_ARMS).digest


@pytest.mark.parametrize(
    ("name", "old", "new", "same"),
    [
        (CELL, "# Run it:", "# Start it:", True),
        ("models/six_axis.yaml", "a1z: 650", "a1z:    650.0", True),
        ("models/six_axis.yaml", "a1z: 650", "a1z: 651", False),
        ("two_arms/left_drives.yaml", "boot_timeout_s: 5", "boot_timeout_s: 6", False),
        ("two_arms/left_drives.sim.yaml", "level: fast", "level: full", True),
        ("two_arms/programs/left.prog", "WAIT 0.3", "WAIT 0.4", True),
        (CELL, "size: [900, 2600, 2600]", "sphere: 900", True),
        (CELL, "robots: [left, right]", "robots: [left]", False),
        (CELL, "on_manager_return: continue", "on_manager_return: operator", False),
    ],
)
def test_the_digest_follows_the_meaning_of_all_files(tmp_path: Path, name: str, old: str, new: str, same: bool) -> None:
    changed = load_cell(Copy(tmp_path).change(name, old, new).cell).digest
    assert (changed == load_cell(TWO_ARMS).digest) is same
    assert len(changed) == 16


@pytest.mark.parametrize(
    ("old", "new", "at", "problem"),
    [
        ("cell: two_arms", "cell: Two arms", "cell: §Two",
         "cell: found 'Two arms', allowed text matching [a-z][a-z0-9_]{0,31}"),
        ("length: mm", "length: inch", "§inch", "units.length: found 'inch', allowed 'mm' or 'm'"),
        ("units: {length: mm, angle: deg}", "", "§cell: two",
         "units: found nothing, allowed units of lengths and angles: {length: mm, angle: deg}"),
        ('"tcp/127.0.0.1:7450"', "7450", "§7450", "manager.endpoint: found 7450, allowed text"),
        ("tcp/127.0.0.1:7450", "tcp/127.0.0.1:70000", '§"tcp/127.0.0.1:70000',
         "manager.endpoint: found 'tcp/127.0.0.1:70000', allowed tcp/HOST:PORT with a port of 1 to 65535"),
        ("7452", "7451", '§"tcp/127.0.0.1:7451", drives: right', "gateways.right_bus.endpoint: found "
         "'tcp/127.0.0.1:7451', where gateway left_bus listens too, allowed an endpoint of its own"),
        ("127.0.0.1:7452", "localhost:7450", '§"tcp/localhost', "gateways.right_bus.endpoint: found "
         "'tcp/localhost:7450', where the manager listens too, allowed an endpoint of its own"),
        ("gateway: left_bus", "gateway: middle", "§middle",
         "robots.left.gateway: found unknown gateway 'middle', allowed one of left_bus, right_bus"),
        ("X: -1800", "x: -1800", "§x: -1800",
         "robots.left.base.x: found unknown key 'x', allowed one of X, Y, Z, A, B, C"),
        ("X: -1800", "x: -1800", "§base: {x", "robots.left.base.X: found nothing, allowed position along X, in "
         "units.length"),
        ("X: -1800", "X: .inf", "§.inf", "robots.left.base.X: found inf, allowed a finite number"),
        ("X: -1800", "X: far", "§far", "robots.left.base.X: found 'far', allowed a number"),
        ("X: -1800", "X: true", "§true", "robots.left.base.X: found true, allowed a number"),
        ("X: -1800", "X: null", "§null", "robots.left.base.X: found nothing, allowed a number"),
        ("left.prog", "lift.prog", "§programs/lift.prog", "robots.left.program: found 'programs/lift.prog': no such "
         "file, allowed a readable file, relative to this one"),
        ("programs/left.prog", "programs", "§programs\n", "robots.left.program: found 'programs': a folder, allowed a "
         "readable file, relative to this one"),
        ("left_drives.yaml", "drives.yaml", "drives: §drives.yaml", "gateways.left_bus.drives: found 'drives.yaml': no "
         "such file, allowed a readable file, relative to this one"),
        ("[900, 2600, 2600]", "[900, 2600]", "§[900", "zones.handover.size: found 2 values, allowed a box as well: "
         "edge lengths [x, y, z], as older files have it"),
        ("[900, 2600, 2600]", "[900, 0, 2600]", "900, §0", "zones.handover.size[1]: found 0, allowed more than 0"),
        ("robots: [left, right]", "robots: []", "§[]", "zones.handover.robots: found an empty list, allowed 1 or more"),
        ("127.0.0.1:7450", "0.0.0.0:7450", '§"tcp/0.0', "manager.endpoint: found 'tcp/0.0.0.0:7450', allowed an "
         "address under which the others reach it; it listens on all of its own with -l tcp/0.0.0.0:7450"),
        ("robots: [left, right]", "robots: [left, up]", "§up]",
         "zones.handover.robots[1]: found unknown robot 'up', allowed one of left, right"),
        ("robots: [left, right]", "robots: [left, left]", "[left, §left",
         "zones.handover.robots[1]: found 'left' a second time, allowed each robot once"),
        ("times: {", "meetings: {load: [left, up]}\ntimes: {", "§up]",
         "meetings.load[1]: found unknown robot 'up', allowed one of left, right"),
        ("times: {", "meetings: {load: [left, left]}\ntimes: {", "§left]}",
         "meetings.load[1]: found 'left' a second time, allowed each robot once"),
        ("times: {", "meetings: {load: [left]}\ntimes: {", "§[left]}",
         "meetings.load: found 1 entries, allowed 2 or more"),
        ("times: {", "times: {clock_error_s: 2, ", "§2,", "times.clock_error_s: found 2, allowed 1 or less"),
        ("on_manager_return: continue", "on_manager_return: go", "§go\n",
         "on_manager_return: found 'go', allowed 'continue' or 'operator'"),
    ],
)  # fmt: skip
def test_each_mistake_is_one_line_at_its_place(tmp_path: Path, old: str, new: str, at: str, problem: str) -> None:
    copy = Copy(tmp_path).change(CELL, old, new)
    assert f"{copy.place(CELL, at)}: {problem}" in lines(copy)


@pytest.mark.parametrize("host", ["0", "00.0.0.0", "0x0", "*", "[::]", "[0:0::0]", "[::ffff:0.0.0.0]"])
def test_every_address_of_a_computer_is_refused_however_it_is_written(tmp_path: Path, host: str) -> None:
    copy = Copy(tmp_path).change(CELL, "127.0.0.1:7450", f"{host}:7450")
    (line,) = lines(copy)
    assert line.endswith(f"it listens on all of its own with -l tcp/{host}:7450")


@pytest.mark.parametrize(
    ("times", "at", "problem"),
    [
        ("{nominal_s: 0.08, lead_s: 0.01}", "§0.08",
         "times.nominal_s: found 0.08, allowed 0.1 or more, so that blocks may be lost"),
        ("{lead_s: 0.12}", "§0.12", "times.lead_s: found 0.12, allowed less than 0.1 (nominal_s 0.12 less one block "
         "period of 0.02), so that a block joins before its predecessor brakes"),
        ("{fresh_s: 0.1}", "§0.1}", "times.fresh_s: found 0.1, allowed 0.15 or more, 3 periods of the manager's state"),
        ("{command_s: 0.05}", "§0.05",
         "times.command_s: found 0.05, allowed 0.06 or more, 3 periods of a robot's state"),
        ("{feedback_lost_s: 0.02}", "{feedback_lost_s: §0.02}",
         "times.feedback_lost_s: found 0.02, allowed more than lead_s, 0.032"),
        ("{owner_silent_s: 0.1}", "§0.1}", "times.owner_silent_s: found 0.1, allowed more than nominal_s, 0.12, so "
         "that lost blocks do not end a claim"),
        ("{fresh_s: 10}", "§10}", "times.fresh_s: found 10, allowed 2 or less"),
        ("{command_s: 30}", "§30}", "times.command_s: found 30, allowed 2 or less"),
        ("{nominal_s: 40, owner_silent_s: 50}", "nominal_s: §40", "times.nominal_s: found 40, allowed 1 or less"),
        ("{estop_delay_s: 60}", "§60}", "times.estop_delay_s: found 60, allowed 5 or less"),
        ("{fresh_s: -1}", "§-1}", "times.fresh_s: found -1, allowed more than 0"),
        ("{fresh: 1}", "§fresh:", "times.fresh: found unknown key 'fresh', allowed one of fresh_s, command_s, "
         "nominal_s, lead_s, feedback_lost_s, owner_silent_s, estop_delay_s, clock_error_s, idle_off_s"),
    ],
)  # fmt: skip
def test_times_that_contradict_each_other_are_refused(tmp_path: Path, times: str, at: str, problem: str) -> None:
    copy = Copy(tmp_path).change(CELL, TIMES, f"times: {times}")
    assert lines(copy) == [f"{copy.place(CELL, at)}: {problem}"]


@pytest.mark.parametrize(
    ("old", "new", "at", "problem"),
    [
        ("robots: [left, right]", "robots: [5]", "§5]", "zones.handover.robots[0]: found 5, allowed text"),
        ("[900, 2600, 2600]", "[]", "§[]", "zones.handover.size: found 0 values, allowed a box as well: edge "
         "lengths [x, y, z], as older files have it"),
        ("cell: two_arms", "cell: 5", "cell: §5", "cell: found 5, allowed text"),
        ("[900, 2600, 2600]", "far", "§far", "zones.handover.size: found 'far', allowed a list"),
    ],
)  # fmt: skip
def test_a_wrong_value_is_one_problem(tmp_path: Path, old: str, new: str, at: str, problem: str) -> None:
    copy = Copy(tmp_path).change(CELL, old, new)
    assert lines(copy) == [f"{copy.place(CELL, at)}: {problem}"]


def test_all_problems_come_at_once(tmp_path: Path) -> None:
    copy = Copy(tmp_path).add(CELL, "colour: red").change(CELL, "cell: two_arms", "cell: 5")
    copy.change(CELL, "7452", "7450").change(CELL, "X: -1800", "X: near").change(CELL, "[left, right]", "[nobody]")
    paths = [line.split(": ")[1] for line in lines(copy)]
    assert sorted(paths) == [
        "cell",
        "colour",
        "gateways.right_bus.endpoint",
        "robots.left.base.X",
        "zones.handover.robots[0]",
    ]


def test_more_than_16_robots_are_refused(tmp_path: Path) -> None:
    copy = Copy(tmp_path)
    robot = (
        "{model: ../models/six_axis.yaml, gateway: left_bus, base: {X: 0, Y: 0, Z: 0, A: 0, B: 0, C: 0}, program: p}"
    )
    more = "".join(f"  r{number}: {robot}\n" for number in range(15))
    copy.change(CELL, "robots:\n  left:", f"robots:\n{more}  left:")
    assert f"{copy.place(CELL, '§r0:')}: robots: found 17 entries, allowed 16 or less" in lines(copy)


@pytest.mark.parametrize("name", ["nowhere.yaml", "."])
def test_what_is_no_file_is_a_problem_and_no_traceback(tmp_path: Path, name: str) -> None:
    with pytest.raises(ConfigError) as caught:
        load_cell(tmp_path / name)
    assert [(p.line, p.column, p.path) for p in caught.value.problems] == [(1, 1, "file")]


def test_a_file_that_is_not_utf_8_names_the_byte(tmp_path: Path) -> None:
    file = tmp_path / "cell.yaml"
    file.write_bytes(b"cell: two\nunits: {\xff}\n")
    with pytest.raises(ConfigError, match=r"cell\.yaml:2:9: file: found the byte 0xff, allowed text in UTF-8"):
        load_cell(file)


def test_a_broken_named_file_is_reported_in_that_file(tmp_path: Path) -> None:
    copy = Copy(tmp_path).change("models/six_axis.yaml", "family: six_axis", "family: [six_axis")
    assert [line.split(" ")[0] for line in lines(copy)] == [copy.place("models/six_axis.yaml", "units§: {") + ":"]


def test_orders_need_the_cell_file_alone(tmp_path: Path) -> None:
    copy = Copy(tmp_path)
    copy.drives.write_text("colour: [")
    copy.robot.unlink()
    assert load_cell_alone(copy.cell).manager_endpoint == load_cell(TWO_ARMS).manager_endpoint


def test_orders_are_refused_with_every_problem_of_the_cell_file(tmp_path: Path) -> None:
    copy = Copy(tmp_path).add(CELL, "colour: red").change(CELL, "cell: two_arms", "cell: 5")
    with pytest.raises(ConfigError) as caught:
        load_cell_alone(copy.cell)
    assert len(caught.value.problems) == 2


@pytest.mark.parametrize(
    ("line", "kept_apart"),
    [
        ("", SeparationSettings(0.03)),
        ("separation: {}", SeparationSettings(0.03)),
        ("separation: {margin: 50}", SeparationSettings(0.05)),
        ("separation: off", None),
    ],
)
def test_robots_are_kept_apart_unless_the_file_says_off(
    tmp_path: Path, line: str, kept_apart: SeparationSettings | None
) -> None:
    cell = load_cell(Copy(tmp_path).add(CELL, line).cell)
    assert cell.separation == kept_apart
    assert {robot.kept_apart for robot in cell.robots.values()} == {kept_apart is not None}


def test_one_robot_has_nobody_to_keep_away_from(tmp_path: Path) -> None:
    copy = Copy(tmp_path)
    cell = load_cell(copy.add("belt/cell.yaml", "separation: {margin: 50}").folder / "belt" / "cell.yaml")
    assert cell.separation is None
    assert not cell.robots["left"].kept_apart


@pytest.mark.parametrize("value", ["on", "", "30", "[left, right]", "false"])
def test_what_is_neither_off_nor_a_margin_is_refused(tmp_path: Path, value: str) -> None:
    with pytest.raises(ConfigError) as error:
        load_cell(Copy(tmp_path).add(CELL, f"separation: {value}").cell)
    (problem,) = error.value.problems
    assert problem.path == "separation"
    assert problem.allowed == "off, or how far robots keep apart: {margin: 30}"


def test_a_wrong_margin_is_told_at_its_place(tmp_path: Path) -> None:
    with pytest.raises(ConfigError) as error:
        load_cell(Copy(tmp_path).add(CELL, "separation: {margin: 0}").cell)
    (problem,) = error.value.problems
    assert problem.path == "separation.margin"
