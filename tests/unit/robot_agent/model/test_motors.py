"""The motors of a robot file: read, against themselves, against the joints, and against the drives of a cell."""

from pathlib import Path

import numpy as np
import pytest

from cell.commands.checks import check_cell
from cell.config import ConfigError
from drive_gateway.sim.axis.dc_bus import DcBusData
from drive_gateway.sim.axis.motor_data import MOTORS
from robot_agent.model import load_description
from tests.unit.config_world import CONFIGS, DRIVES, ROBOT, Copy

MODELS = sorted((CONFIGS / "models").glob("*.yaml"))
GANTRY = "models/gantry.yaml"
PLACER = "mixed/placer_drives.yaml"
PALLETIZER = "models/palletizer.yaml"


@pytest.mark.parametrize("path", MODELS, ids=lambda path: path.stem)
def test_every_robot_has_a_motor_for_each_axis_and_says_where_its_numbers_are_from(path: Path) -> None:
    robot = load_description(path)
    assert tuple(robot.motors) == robot.joint_names
    assert all(motor.source for motor in robot.motors.values())
    assert [motor.feed_m is not None for motor in robot.motors.values()] == list(robot.linear)


def test_speeds_and_torques_go_through_the_gear() -> None:
    motor = load_description(CONFIGS / ROBOT).motors["J1"]
    assert motor.rpm(np.radians(110)) == pytest.approx(110 / 360 * 60 * 180)
    assert np.degrees(motor.fastest) == pytest.approx(6000 / 60 * 360 / 180)
    assert motor.rotor_torque_nm(2.0) == pytest.approx(2.0e-3 * 180 * 2.0)
    assert motor.peak_current_a == pytest.approx(33.0)


def test_of_a_linear_axis_through_its_feed_too() -> None:
    motor = load_description(CONFIGS / GANTRY).motors["J1"]
    assert motor.rpm(0.6) == pytest.approx(0.6 / 0.1 * 5 * 60)
    assert motor.fastest == pytest.approx(6000 / 60 / 5 * 0.1)
    # Power at the shaft is power at the axis.
    assert motor.ratio * 4.6 * motor.fastest == pytest.approx(4.6 * 6000 * np.pi / 30)


def test_a_robot_may_say_nothing_about_its_motors(tmp_path: Path) -> None:
    copy = Copy(tmp_path)
    text = copy.robot.read_text()
    copy.robot.write_text(text[: text.index("motors:")] + text[text.index("path:") :])
    assert load_description(copy.robot).motors == {}
    assert check_cell(copy.cell)[1] == []


J1 = "  J1:\n    {type: joint-large, gear: 180, pole_pairs: 4, rated_speed_rpm: 4000, maximum_speed_rpm: "


@pytest.mark.parametrize(
    ("name", "old", "new", "problem"),
    [
        (ROBOT, f"{J1}6000", f"{J1}3200", "motors.J1.maximum_speed_rpm: found 3200, allowed 4000 or more, the rated "
         "speed"),
        (ROBOT, f"{J1}6000", f"{J1}3200", "motors.J1.maximum_speed_rpm: found 3200, allowed 3300 or more, for axis J1 "
         "at 110 deg/s through gear 180"),
        (ROBOT, "gear: 80", "gear: 480", "motors.J6.maximum_speed_rpm: found 6000, allowed 19200 or more, for axis J6 "
         "at 240 deg/s through gear 480"),
        (GANTRY, "EMMS-AS-55-S-TM, gear: 5, feed: 100", "EMMS-AS-55-S-TM, gear: 5, feed: 20",
         "motors.J2.maximum_speed_rpm: found 6000, allowed 9000 or more, for axis J2 at 600 mm/s through gear 5"),
        # Axis 3 also follows axis 2: 110 and 120 deg/s.
        (PALLETIZER, "gear: 90", "gear: 110", "motors.J3.maximum_speed_rpm: found 3900, allowed 4217 or more, for axis "
         "J3 at 230 deg/s through gear 110"),
        (ROBOT, "rated_torque_nm: 1.3, peak_torque_nm: 4.8", "rated_torque_nm: 1.3, peak_torque_nm: 1.2",
         "motors.J6.peak_torque_nm: found 1.2, allowed 1.3 or more, the rated torque"),
        (ROBOT, "inertia_kg_m2: 8.0e-5", "inertia_kg_m2: 8.0e-3",
         "motors.J6.peak_torque_nm: found 4.8, allowed 10.1 or more, for its rotor alone in a ramp of axis J6 with 900 "
         "deg/s2"),
        (ROBOT, "gear: 80", "gear: -80", "motors.J6.gear: found -80, allowed more than 0"),
        (ROBOT, "gear: 80", "feed: 20, gear: 80", "motors.J6.feed: found a feed, allowed a feed for a linear axis, "
         "none for a rotary one"),
        (GANTRY, "EMMS-AS-55-S-TM, gear: 5, feed: 100", "EMMS-AS-55-S-TM, gear: 5",
         "motors.J2: found no feed, allowed a feed for a linear axis, none for a rotary one"),
        (ROBOT, "  J6:\n    {type: joint-small", "  J7:\n    {type: joint-small",
         "motors: found J1, J2, J3, J4, J5, J7, allowed each of J1, J2, J3, J4, J5, J6"),
    ],
)  # fmt: skip
def test_a_motor_that_cannot_be_or_cannot_move_its_axis_is_refused_by_name(
    tmp_path: Path, name: str, old: str, new: str, problem: str
) -> None:
    copy = Copy(tmp_path).change(name, old, new)
    with pytest.raises(ConfigError) as caught:
        load_description(copy.folder / name)
    assert problem in [copy.shown(found).split(": ", 1)[1] for found in caught.value.problems]


@pytest.mark.parametrize(
    ("name", "old", "new", "problem"),
    [
        (DRIVES, "gear: 180", "gear: 18", "robots.left.axes.J1.gear: found 18, allowed 180, that of the motor of J1 in "
         "the file of BOOK6"),
        (PLACER, "feed: 20", "feed: 25", "robots.placer.axes.J3.feed: found 25, allowed 20, that of the motor of J3 in "
         "the file of SCARA"),
        (PLACER, "speed: 990", "speed: 2990", "robots.placer.axes.J3.speed: found 2990, allowed 2000 or less: its "
         "motor makes 6000 turns per minute"),
        (DRIVES, "speed: 121", "speed: 221", "robots.left.axes.J1.speed: found 221, allowed 200 or less: its motor "
         "makes 6000 turns per minute"),
    ],
)  # fmt: skip
def test_drives_count_through_the_gear_of_the_robot_and_take_no_more_than_its_motor_gives(
    tmp_path: Path, name: str, old: str, new: str, problem: str
) -> None:
    copy = Copy(tmp_path).change(name, old, new)
    _, found = check_cell(copy.folder / Path(name).parent / "cell.yaml")
    assert copy.shown(found[0]) == f"{copy.place(name, new.replace(': ', ': §'))}: {problem}"


def test_torques_are_told_in_per_mille_of_the_torque_that_the_robots_motor_has(tmp_path: Path) -> None:
    copy = Copy(tmp_path).change(DRIVES, "gear: 180", "feed_forward: torque, rated_torque_nm: 8, gear: 180")
    _, found = check_cell(copy.cell)
    assert copy.shown(found[0]) == (
        f"{copy.place(DRIVES, 'rated_torque_nm: §8')}: robots.left.axes.J1.rated_torque_nm: found 8, allowed 9, that "
        "of the motor of J1 in the file of BOOK6"
    )


def test_torque_feed_forward_needs_a_robot_whose_torques_are_known(tmp_path: Path) -> None:
    copy = Copy(tmp_path).change(DRIVES, "gear: 180", "feed_forward: torque, rated_torque_nm: 9, gear: 180")
    text = copy.robot.read_text()
    copy.robot.write_text(text[: text.index("motors:")] + text[text.index("path:") :])
    _, found = check_cell(copy.cell)
    assert (
        "J1.feed_forward: found torque, allowed velocity or none: the file of BOOK6 has neither masses nor motors"
        in (copy.shown(found[0]))
    )


@pytest.mark.parametrize("path", MODELS, ids=lambda path: path.stem)
def test_motors_with_the_name_of_a_simulated_one_have_its_numbers(path: Path) -> None:
    for motor in load_description(path).motors.values():
        same = MOTORS.get(motor.type)
        if same is None:
            continue
        assert (motor.pole_pairs, motor.rated_speed_rpm) == (same.pole_pairs, same.rated_speed_rpm)
        assert (motor.rated_torque_nm, motor.torque_constant_nm_a) == (same.rated_torque_nm, same.torque_constant_nm_a)
        assert motor.inertia_kg_m2 == pytest.approx(same.inertia_kg_m2)
        assert motor.peak_torque_nm == pytest.approx(same.peak_factor * same.stall_torque_nm)
        # The highest speed is below that at which the induced voltage is that of the DC bus.
        assert motor.maximum_speed_rpm < 30 / np.pi * DcBusData().supply_v / (np.sqrt(3) * same.emf)
