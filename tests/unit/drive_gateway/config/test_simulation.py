"""How drives are simulated, in the file of a bus: levels, motors, loads, and every mistake at its place."""

from pathlib import Path

import numpy as np
import pytest

from cell.config import ConfigError
from drive_gateway.config import load_drives
from drive_gateway.config.simulation import Level
from drive_gateway.sim.axis.full_servo import FullServo
from drive_gateway.sim.axis.servo import Servo
from drive_gateway.sim.shell import simulated_nodes
from tests.unit.config_world import CONFIGS, DRIVES, Copy


def lines(copy: Copy) -> list[str]:
    with pytest.raises(ConfigError) as caught:
        load_drives(copy.drives, "left_bus")
    return [copy.shown(problem) for problem in caught.value.problems]


def test_motor_and_load_come_with_what_the_axis_says() -> None:
    data = load_drives(CONFIGS / DRIVES, "left_bus").simulation.axes["left", "J3"]
    assert (data.motor.name, data.gear, data.direction) == ("joint-large", 190.0, -1)
    assert data.encoder.counts_per_turn == 131072
    assert data.torque(data.axis_angle(0.0)) == pytest.approx(0.0, abs=1e-9)


def test_fast_level_is_the_default_and_full_level_is_one_word(tmp_path: Path) -> None:
    fast = load_drives(CONFIGS / DRIVES, "left_bus")
    assert fast.simulation.level is Level.FAST
    assert all(isinstance(node.servo, Servo) for node in simulated_nodes(fast))
    full = load_drives(Copy(tmp_path).change(DRIVES, "level: fast", "level: full").drives, "left_bus")
    nodes = simulated_nodes(full)
    assert all(isinstance(node.servo, FullServo) for node in nodes)
    axes = full.robots["left"].axes
    starts = [(axis.simulated_start - axis.offset) * axis.counts_per_unit for axis in axes]
    assert [node.position for node in nodes] == pytest.approx(starts, abs=1.0)


def test_the_load_of_a_whole_robot_is_asked_for_where_its_axes_are(tmp_path: Path) -> None:
    full = load_drives(Copy(tmp_path).change(DRIVES, "level: fast", "level: full").drives, "left_bus")
    asked: list[np.ndarray] = []

    def weight(axes: np.ndarray, _speeds: np.ndarray, _accelerations: np.ndarray) -> np.ndarray:
        asked.append(axes[0])
        return np.zeros_like(axes)

    for node in simulated_nodes(full, {"left": weight}):
        node.step(0.0)
        node.step(0.003)
    starts = [axis.simulated_start for axis in full.robots["left"].axes]
    np.testing.assert_allclose(asked, [starts], atol=1e-6)


def test_file_without_a_simulation_is_good(tmp_path: Path) -> None:
    copy = Copy(tmp_path)
    text = copy.drives.read_text()
    copy.drives.write_text(text[: text.index("simulation:")])
    assert load_drives(copy.drives, "left_bus").simulation.axes == {}


@pytest.mark.parametrize(
    ("old", "new", "problem"),
    [
        ("level: fast", "level: exact", "simulation.level: found 'exact', allowed 'fast' or 'full'"),
        ("J1: {motor: joint-large", "J1: {motor: steam",
         "simulation.axes.left.J1.motor: found 'steam', allowed one of 83-220,"),
        ("J1: {motor: joint-large", "J1: {motor: 85-150",
         "simulation.axes.left.J1.motor: found 85-150, which moves the axis with up to 67, allowed a motor that "
         "reaches the speed of this axis, 121"),
        ("inertia_kg_m2: 30, coulomb_nm: 20, viscous_nm_s: 30}", "inertia_kg_m2: 0.01, stiffness_nm_rad: 1e6}",
         "simulation.axes.left.J1.stiffness_nm_rad: found a resonance at 1592 Hz, allowed up to 700 Hz"),
        ("  wire_time: true", "  dc_bus: {chopper_v: 500}",
         "simulation.dc_bus: found 400, 560, 500, 780, allowed low_v, supply_v, chopper_v, high_v each above the one"),
        ("  axes:\n    left:\n      J1: {motor", "  axes:\n    middle:\n      J1: {motor",
         "simulation.axes.middle: found 'middle', allowed a robot of this file: left"),
        ("  wire_time: true", "  masses: robot",
         "simulation.axes.left.J2.gravity: found a mass on an arm, allowed none with masses: robot, which are those"),
        ("J1: {motor: joint-large,", "J1: {motor: joint-large, stops: [10, -10],",
         "simulation.axes.left.J1.stops: found the higher position first, allowed the lower one first"),
        ("      J6: {motor: joint-small", "      J7: {motor: joint-small",
         "simulation.axes.left.J7: found 'J7', allowed an axis of left: J1, J2, J3, J4, J5, J6"),
    ],
)  # fmt: skip
def test_each_mistake_is_named(tmp_path: Path, old: str, new: str, problem: str) -> None:
    copy = Copy(tmp_path).change(DRIVES, old, new)
    assert any(problem in line for line in lines(copy)), lines(copy)


def test_full_level_needs_every_axis(tmp_path: Path) -> None:
    copy = (
        Copy(tmp_path)
        .change(DRIVES, "level: fast", "level: full")
        .change(DRIVES, "      J6: {motor: joint-small, inertia_kg_m2: 0.1, coulomb_nm: 3, viscous_nm_s: 3}\n", "")
    )
    allowed = "motor and load of every axis; missing in simulation.axes: left.J6"
    assert any(f"simulation.level: found full, allowed {allowed}" in line for line in lines(copy)), lines(copy)
