"""How drives are simulated, in the file beside a drives file: levels, motors, loads, and every mistake at its place."""

import math
from pathlib import Path

import numpy as np
import pytest

from cell.commands.checks import check_cell
from cell.config import ConfigError
from drive_gateway.config import load_drives
from drive_gateway.sim.axis.full_servo import FullServo
from drive_gateway.sim.axis.servo import Servo
from drive_gateway.sim.config.load import load_simulation
from drive_gateway.sim.config.simulation import LAG_S, Level, Simulation
from drive_gateway.sim.nodes.node import SimulatedNode
from drive_gateway.sim.shell import Robots, simulated_nodes
from tests.unit.config_world import CONFIGS, DRIVES, SIMULATION, Copy

PLACES = "starts: {left: {J1: 10, J2: -20, J3: 30, J4: 0, J5: 90, J6: -5}}\n"


def lines(copy: Copy) -> list[str]:
    with pytest.raises(ConfigError) as caught:
        load_simulation(copy.drives)
    return [copy.shown(problem) for problem in caught.value.problems]


def nodes_of(file: Path, simulation: Simulation, robots: Robots | None = None) -> list[SimulatedNode]:
    nodes = simulated_nodes(load_drives(file, "left_bus"), simulation, robots)
    return [node for node in nodes if isinstance(node, SimulatedNode)]


def test_motor_and_load_come_with_what_the_axis_says() -> None:
    data = load_simulation(CONFIGS / DRIVES).axes["left", "J3"]
    assert (data.motor.name, data.gear, data.direction) == ("joint-large", 190.0, -1)
    assert data.encoder.counts_per_turn == 131072
    assert data.torque(data.axis_angle(0.0)) == pytest.approx(0.0, abs=1e-9)


def test_fast_level_is_the_default_and_full_level_is_one_word(tmp_path: Path) -> None:
    fast = load_simulation(CONFIGS / DRIVES)
    assert fast.level is Level.FAST
    assert all(isinstance(node.servo, Servo) for node in nodes_of(CONFIGS / DRIVES, fast))
    copy = Copy(tmp_path).change(SIMULATION, "level: fast", f"level: full\n{PLACES}")
    nodes = nodes_of(copy.drives, load_simulation(copy.drives))
    assert all(isinstance(node.servo, FullServo) for node in nodes)
    axes = load_drives(copy.drives, "left_bus").robots["left"].axes
    places = np.radians([10, -20, 30, 0, 90, -5])
    counts = [(place - axis.offset) * axis.counts_per_unit for place, axis in zip(places, axes, strict=True)]
    assert [node.position for node in nodes] == pytest.approx(counts, abs=1.0)


def test_the_load_of_a_whole_robot_is_asked_for_where_its_axes_are(tmp_path: Path) -> None:
    copy = Copy(tmp_path).change(SIMULATION, "level: fast", f"level: full\n{PLACES}")
    asked: list[np.ndarray] = []

    def weight(axes: np.ndarray, _speeds: np.ndarray, _accelerations: np.ndarray) -> np.ndarray:
        asked.append(axes[0])
        return np.zeros_like(axes)

    for node in nodes_of(copy.drives, load_simulation(copy.drives), {"left": weight}):
        node.step(0.0)
        node.step(0.003)
    np.testing.assert_allclose(asked, np.radians([[10, -20, 30, 0, 90, -5]]), atol=1e-6)


def test_without_a_file_the_axes_stand_at_home_and_lag_a_little(tmp_path: Path) -> None:
    copy = Copy(tmp_path)
    (copy.folder / SIMULATION).unlink()
    bundle, problems = check_cell(copy.cell)
    assert bundle is not None, problems
    simulation = bundle.simulations["left_bus"]
    assert (simulation.level, simulation.lag_s, simulation.axes) == (Level.FAST, LAG_S, {})
    axes = bundle.gateways["left_bus"].robots["left"].axes
    assert [simulation.start("left", axis) for axis in axes] == pytest.approx(bundle.robots["left"].model.home)


def test_without_a_robot_an_axis_stands_in_the_middle_of_its_limits(tmp_path: Path) -> None:
    copy = Copy(tmp_path).change(DRIVES, "{node: 1, gear: 180", "{limits: [-40, 100], node: 1, gear: 180")
    first, second, *_ = load_drives(copy.drives, "left_bus").robots["left"].axes
    simulation = load_simulation(copy.drives)
    assert simulation.start("left", first) == pytest.approx(math.radians(30))
    assert simulation.start("left", second) == 0.0


def test_a_tight_following_window_makes_the_lag_smaller_and_is_not_refused(tmp_path: Path) -> None:
    tight = "quick_stop: 1300, following_window: 0.264"
    copy = Copy(tmp_path).change(DRIVES, "quick_stop: 1300, following_window: 3", tight)
    assert load_simulation(copy.drives).lag_s == pytest.approx(0.75 * 0.264 / 264)


def test_a_file_beside_no_drives_file_is_warned_of(tmp_path: Path) -> None:
    copy = Copy(tmp_path)
    (copy.folder / SIMULATION).rename(copy.folder / "two_arms" / "left_drive.sim.yaml")
    bundle, problems = check_cell(copy.cell)
    assert bundle is not None
    assert [copy.shown(problem) for problem in problems] == [
        "two_arms/left_drive.sim.yaml:1:1: warning: file: found left_drive.sim.yaml, beside no drives file of that "
        "name, allowed left_drives.sim.yaml for left_drives.yaml"
    ]


@pytest.mark.parametrize(
    ("old", "new", "place", "problem"),
    [
        ("level: fast", "level: exact", "level: §exact", "level: found 'exact', allowed 'fast' or 'full'"),
        ("level: fast", "lag_s: 0.0115", "lag_s: §0.0115",
         "lag_s: found 0.0115, allowed less than 0.01136: the following_window of left.J6 over its speed"),
        ("J1: {motor: joint-large", "J1: {motor: steam", "J1: {motor: §steam",
         "axes.left.J1.motor: found 'steam', allowed one of 83-220,"),
        ("J1: {motor: joint-large", "J1: {motor: 85-150", "§85-150",
         "axes.left.J1.motor: found 85-150, which moves the axis with up to 67, allowed a motor that "
         "reaches the speed of this axis, 121"),
        ("inertia_kg_m2: 30, coulomb_nm: 20, viscous_nm_s: 30}", "inertia_kg_m2: 0.01, stiffness_nm_rad: 1e6}",
         "stiffness_nm_rad: §1e6",
         "axes.left.J1.stiffness_nm_rad: found a resonance at 1592 Hz, allowed up to 700 Hz"),
        ("level: fast", "dc_bus: {chopper_v: 500}", "§{chopper_v",
         "dc_bus: found 400, 560, 500, 780, allowed low_v, supply_v, chopper_v, high_v each above the one"),
        ("axes:\n  left:", "axes:\n  middle:", "§middle",
         "axes.middle: found 'middle', allowed a robot of the drives file: left"),
        ("level: fast", "masses: robot", "§gravity: {mass_kg: 55",
         "axes.left.J2.gravity: found a mass on an arm, allowed none with masses: robot, which are those"),
        ("J1: {motor: joint-large,", "J1: {motor: joint-large, stops: [10, -10],", "§[10, -10]",
         "axes.left.J1.stops: found the higher position first, allowed the lower one first"),
        ("    J6: {motor: joint-small", "    J7: {motor: joint-small", "§J7",
         "axes.left.J7: found 'J7', allowed an axis of left: J1, J2, J3, J4, J5, J6"),
        ("level: fast", "starts: {left: {J7: 1}}", "§J7",
         "starts.left.J7: found 'J7', allowed an axis of left: J1, J2, J3, J4, J5, J6"),
        ("units: {length: mm, angle: deg}", "", "§level: fast",
         "units: found nothing, allowed units of lengths and angles"),
        ("level: fast", "start: 3", "§start: 3", "start: found unknown key 'start', allowed one of units, level,"),
    ],
)  # fmt: skip
def test_each_mistake_is_named(tmp_path: Path, old: str, new: str, place: str, problem: str) -> None:
    copy = Copy(tmp_path).change(SIMULATION, old, new)
    found = [line for line in lines(copy) if problem in line]
    assert found, lines(copy)
    assert found[0].startswith(f"{copy.place(SIMULATION, place)}: ")


def test_full_level_needs_every_axis(tmp_path: Path) -> None:
    copy = (
        Copy(tmp_path)
        .change(SIMULATION, "level: fast", "level: full")
        .change(SIMULATION, "    J6: {motor: joint-small, inertia_kg_m2: 0.1, coulomb_nm: 3, viscous_nm_s: 3}\n", "")
    )
    allowed = "motor and load of every axis; missing in axes: left.J6"
    assert any(f"level: found full, allowed {allowed}" in line for line in lines(copy)), lines(copy)


def test_a_mistake_in_the_simulation_keeps_no_gateway_from_real_drives(tmp_path: Path) -> None:
    copy = Copy(tmp_path).change(SIMULATION, "level: fast", "level: exact")
    assert load_drives(copy.drives, "left_bus").robots
    assert any(SIMULATION in copy.shown(problem) for problem in check_cell(copy.cell)[1])
