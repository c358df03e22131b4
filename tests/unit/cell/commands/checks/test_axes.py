"""Drives against robots whose joints slide, or are coupled to axes before them."""

from pathlib import Path

import pytest

from cell.commands.checks import check_cell
from drive_gateway.config import load_drives
from robot_agent.model.axis_needs import axis_needs
from robot_agent.model.load import read_robot
from tests.unit.config_world import CELL, CONFIGS, DRIVES, ROBOT, SIMULATION, Copy

SLIDE = (
    "{node: 3, type: linear, feed: 20, gear: 4, counts_per_turn: 131072, direction: -1, offset: 100, speed: 950, "
    "acceleration: 13000,\n         quick_stop: 15000, following_window: 30, following_time_s: 0.1}\n"
)
J3 = (
    "{node: 3, gear: 190, counts_per_turn: 131072, direction: -1, offset: 0, speed: 116, acceleration: 495,\n"
    "         quick_stop: 650, following_window: 3, following_time_s: 0.1}\n"
)
J3_MOTOR = (
    "    J3: {motor: joint-large, inertia_kg_m2: 8, coulomb_nm: 15, viscous_nm_s: 20,\n"
    "         gravity: {mass_kg: 25, length: 400, hanging: 180}}\n"
)


def lines(copy: Copy) -> list[str]:
    return [copy.shown(problem) for problem in check_cell(copy.cell)[1]]


def test_an_axis_that_slides_counts_by_its_feed_and_speaks_metres(tmp_path: Path) -> None:
    copy = Copy(tmp_path).change(DRIVES, J3, SLIDE).change(SIMULATION, J3_MOTOR, "")
    axis = load_drives(copy.drives, "left_bus").robots["left"].axes[2]
    assert axis.counts_per_unit == pytest.approx(-131072 * 4 / 0.020)
    assert (axis.offset, axis.speed, axis.following_window) == pytest.approx((0.1, 0.95, 0.03))


def test_an_axis_that_slides_needs_a_feed_and_a_joint_that_slides(tmp_path: Path) -> None:
    copy = Copy(tmp_path).change(DRIVES, J3, SLIDE.replace("feed: 20, ", ""))
    place = copy.place(DRIVES, "type: §linear")
    assert f"{place}: robots.left.axes.J3.type: found linear, allowed rotary, as joint J3" in lines(copy)
    feed = "found linear and no feed, allowed a feed for a linear axis, none for a rotary one"
    assert f"{place}: robots.left.axes.J3.type: {feed}" in lines(copy)


def test_a_coupled_axis_must_also_follow_what_it_is_coupled_to(tmp_path: Path) -> None:
    copy = Copy(tmp_path).change(ROBOT, "ramp_factor: 1.5", "coupling: {J5: {J4: 0.5}}\nramp_factor: 1.5")
    found = [line for line in lines(copy) if DRIVES in line]
    assert found[0].endswith("robots.left.axes.J5.speed: found 198, allowed 283.5 or more, 1.05 times the speed of J5")
    assert any("robots.left.axes.J5.acceleration: found 825, allowed 1181.25 or more" in line for line in found)


def test_the_axes_of_a_palletizer_have_the_ranges_of_its_motors() -> None:
    file = read_robot(CONFIGS / "models/palletizer.yaml").content
    assert file is not None
    needs = axis_needs(file)
    joints = {name: joint.position for name, joint in file.joints.items()}
    assert needs["J2"].position == joints["J2"]
    assert needs["J3"].position == pytest.approx((joints["J3"][0] + joints["J2"][0], joints["J3"][1] + joints["J2"][1]))
    assert needs["J3"].speed == pytest.approx(file.joints["J2"].speed + file.joints["J3"].speed)


def test_a_coupling_to_an_unknown_joint_is_told_once_and_not_judged_further(tmp_path: Path) -> None:
    copy = Copy(tmp_path).change(ROBOT, "ramp_factor: 1.5", "coupling: {J5: {J7: 0.5}}\nramp_factor: 1.5")
    assert [line.split(": ", 1)[1] for line in lines(copy)] == [
        "coupling.J5.J7: found joint J5, coupled to axis J7, allowed one of the axes before it: J1, J2, J3, J4"
    ]
    assert CELL not in lines(copy)[0]


def test_the_limits_of_a_drive_hold_those_of_its_joint(tmp_path: Path) -> None:
    old = "counts_per_turn: 131072, direction: 1, offset: 0, speed: 121"
    copy = Copy(tmp_path).change(DRIVES, old, f"limits: [-90, 90], {old}")
    found = "robots.left.axes.J1.limits: found -90 to 90, allowed a range that holds -180 to 180, the limits of J1"
    assert any(line.endswith(found) for line in lines(copy))


def test_drives_that_carry_a_robots_masses_need_some_in_its_file(tmp_path: Path) -> None:
    copy = Copy(tmp_path)
    (copy.folder / "mixed/placer_drives.sim.yaml").write_text("units: {length: mm, angle: deg}\nmasses: robot\n")
    found = [copy.shown(problem) for problem in check_cell(copy.folder / "mixed" / "cell.yaml")[1]]
    place = copy.place("mixed/placer_drives.sim.yaml", "masses: §robot")
    allowed = "axes: the file of SCARA, robot placer, says nothing of masses"
    assert found == [f"{place}: masses: found robot, allowed {allowed}"]
