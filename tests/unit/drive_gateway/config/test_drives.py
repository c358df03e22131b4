"""The file of a bus and its drives: SI settings of a good one, all problems of a bad one."""

import math
from pathlib import Path

import pytest

from cell.config import ConfigError
from drive_gateway.config import BusSettings, load_drives
from drive_gateway.config.load import read_drives
from tests.unit.config_world import CONFIGS, DRIVES, Copy

GRIPPER = "gripper: {axis: J6, bit: 16, at_stop: keep}"


def lines(copy: Copy) -> list[str]:
    with pytest.raises(ConfigError) as caught:
        load_drives(copy.drives, "left_bus")
    return [copy.shown(problem) for problem in caught.value.problems]


def test_the_settings_are_in_si_and_count_through_the_gear() -> None:
    gateway = load_drives(CONFIGS / DRIVES, "left_bus")
    assert gateway.name == "left_bus"
    assert gateway.bus == BusSettings("virtual", "two_arms_left", 1_000_000, {})
    axes = gateway.robots["left"].axes
    assert [axis.name for axis in axes] == ["J1", "J2", "J3", "J4", "J5", "J6"]
    assert axes[0].counts_per_unit == pytest.approx(131072 * 180 / (2 * math.pi))
    assert axes[2].counts_per_unit == pytest.approx(-131072 * 190 / (2 * math.pi))
    assert axes[4].offset == pytest.approx(math.radians(15))
    assert axes[5].acceleration == pytest.approx(math.radians(990))


def test_options_of_the_bus_go_through_as_they_are(tmp_path: Path) -> None:
    copy = Copy(tmp_path).change(
        DRIVES, "bitrate: 1000000}\n\ncycle", "bitrate: 1000000, options: {port: 4, fd: no, f: false}}\n\ncycle"
    )
    assert load_drives(copy.drives, "left_bus").bus.options == {"port": 4, "fd": "no", "f": False}


def test_an_option_that_is_a_list_is_refused_once_with_all_that_is_allowed(tmp_path: Path) -> None:
    copy = Copy(tmp_path).change(
        DRIVES, "bitrate: 1000000}\n\ncycle", "bitrate: 1000000, options: {port: [4]}}\n\ncycle"
    )
    place = copy.place(DRIVES, "port: §[4]")
    allowed = "text or a whole number or a number or true or false"
    assert lines(copy) == [f"{place}: bus.options.port: found a list, allowed {allowed}"]


def test_patience_for_simulated_drives_is_warned_of_on_a_real_bus(tmp_path: Path) -> None:
    inside = "bus: {interface: virtual, channel: two_arms_left, bitrate: 1000000}\n"
    wire = "bus: {interface: socketcan, channel: can0, bitrate: 1000000}\n\n"
    copy = Copy(tmp_path).change(DRIVES, inside, wire)
    (warning,) = read_drives(copy.drives).problems
    place = copy.place(DRIVES, "overrun_limit_s: §0.5")
    assert copy.shown(warning) == (
        f"{place}: warning: overrun_limit_s: found 0.5 on a bus of real drives: the gateway may be late for so long, "
        "allowed 0.02 advised"
    )
    copy.change(DRIVES, wire, wire.replace("can0", "vcan0"))
    assert read_drives(copy.drives).problems == []


@pytest.mark.parametrize(
    ("old", "new", "at", "problem"),
    [
        ("channel: two_arms_left, bitrate: 1000000", "channel: two_arms_left, bitrate: 9600", "§9600",
         "bus.bitrate: found 9600, allowed 10000, 20000, 50000, 125000, 250000, 500000, 800000 or 1000000"),
        ("node: 3", "node: 2", "node: §2, gear: 190",
         "robots.left.axes.J3.node: found 2, axis 1, those of left.J2 too, allowed each axis of a node once"),
        ("node: 3", "node: 4, axis: 2", "axis: §2",
         "robots.left.axes.J3.axis: found axis 2 of node 4, whose PDOs have the identifiers of Node-ID 5, of left.J5, "
         "allowed Node-IDs that leave room for all axes of each node"),
        ("node: 3", "node: 126, axis: 3", "axis: §3",
         "robots.left.axes.J3.axis: found axis 3 of node 126, whose PDOs have the identifiers of Node-ID 128, beyond"),
        ("node: 3", "node: 3, axis: 2", "axis: §2",
         "robots.left.axes.J3.axis: found axis 2 of node 3 without its axis 1, allowed the axes of a node from 1 on"),
        ("node: 3", "node: 2, axis: 2, error_control: guarding", "node: §2, axis",
         "robots.left.axes.J3.node: found another error_control than that of left.J2, on the same node, allowed"),
        ("node: 3", "node: 3, axis: 4", "axis: §4", "robots.left.axes.J3.axis: found 4, allowed 3 or less"),
        ("node: 3", "node: 127", "§127",
         "robots.left.axes.J3.node: found 127, under which the gateway itself sends its heartbeat, allowed 1 to 127 "
         "but for gateway_node, 127"),
        ("node: 3", "node: 2, axis: 2, waive: ['1016']", "node: §2, axis",
         "robots.left.axes.J3.node: found 1016h waived by one of left.J2 and left.J3, on the same node, allowed"),
        ("node: 3", "node: 128", "§128", "robots.left.axes.J3.node: found 128, allowed 127 or less"),
        ("node: 3", "node: 3.0", "§3.0", "robots.left.axes.J3.node: found 3.0, allowed a whole number"),
        ("cycle_s: 0.004", "cycle_s: 0.002", "cycle_s: §0.002",
         "cycle_s: found a bus load of 87 % (6 axes every 2 ms at 1000 kbit/s: 77 % with worst-case stuffing, and 10 "
         "% kept for SDO and EMCY), allowed up to 80 %"),
        ("overrun_limit_s: 0.5", "overrun_limit_s: 0.003", "§0.003",
         "overrun_limit_s: found 0.003, allowed cycle_s, 0.004, or more"),
        ("heartbeat_timeout_s: 1.0", "heartbeat_timeout_s: 0.6", "heartbeat_timeout_s: §0.6",
         "heartbeat_timeout_s: found 0.6, allowed more than 0.6: heartbeat_producer_s, 0.1, and overrun_limit_s, 0.5, "
         "by which the gateway may be late"),
        ("heartbeat_timeout_s: 1.0", "heartbeat_timeout_s: 66", "§66",
         "heartbeat_timeout_s: found 66, allowed 0.001 to 65.535, 16 bits of milliseconds"),
        ("tpdo_timeout_s: 0.6", "tpdo_timeout_s: 0.007", "§0.007",
         "tpdo_timeout_s: found 0.007, allowed 0.008 or more, two cycles"),
        ("boot_timeout_s: 5", "boot_timeout_s: 0.1", "boot_timeout_s: §0.1",
         "boot_timeout_s: found 0.1, allowed more than 0.5: sdo_timeout_s, 0.5, and heartbeat_producer_s, 0.1, "
         "with 3 cycles"),
        ("cycle_s: 0.004", "cycle_s: 0.004\nsimulated_lag_s: 0.008", "§simulated_lag_s",
         "simulated_lag_s: found unknown key 'simulated_lag_s', allowed keys of real drives; this one goes into "
         "left_drives.sim.yaml beside this file, as lag_s (docs/simulated_drives.md)"),
        ("quick_stop: 600", "simulated_start: 5, quick_stop: 600", "§simulated_start",
         "robots.left.axes.J1.simulated_start: found unknown key 'simulated_start', allowed keys of real drives; this "
         "one goes into left_drives.sim.yaml beside this file, as starts: {ROBOT: {AXIS: ...}} "
         "(docs/simulated_drives.md)"),
        ("cycle_s: 0.004", "cycle_s: 0.004\nsimulation: {level: full}", "§simulation",
         "simulation: found unknown key 'simulation', allowed keys of real drives; this one goes into "
         "left_drives.sim.yaml beside this file, its keys without this one around them (docs/simulated_drives.md)"),
        ("quick_stop: 600", "quick_stop: 462", "quick_stop: §462",
         "robots.left.axes.J1.quick_stop: found 462, allowed more than this axis' acceleration, 462"),
        ("quick_stop: 600", "quick_stop: 1e5", "§1e5",
         "robots.left.axes.J1.quick_stop: found 100000.0, allowed 65536 or less, 32 bits of encoder counts"),
        ("robots:\n  left:\n    axes:", "robots: {}\nwas:\n  left:\n    axes:", "robots: §{}",
         "robots: found an empty mapping, allowed one or more"),
        ("direction: 1, offset: 0, speed: 121", "direction: 0, offset: 0, speed: 121", "direction: §0",
         "robots.left.axes.J1.direction: found 0, allowed 1 or -1"),
        ("gear: 200,", "gear: 200, feed_forward: torque,", "feed_forward: §torque",
         "robots.left.axes.J2.feed_forward: found torque without a rated torque, allowed rated_torque_nm of the motor"),
        ("gear: 200,", "gear: 200, delay_cycles: 0,", "delay_cycles: §0",
         "robots.left.axes.J2.delay_cycles: found 0, allowed 1 or more"),
        ("gear: 200,", "gear: 200, delay_cycles: 51,", "delay_cycles: §51",
         "robots.left.axes.J2.delay_cycles: found 51, allowed 50 or less"),
        ("gear: 200,", "gear: 200, rated_torque_nm: 0,", "rated_torque_nm: §0",
         "robots.left.axes.J2.rated_torque_nm: found 0, allowed 0.001 or more"),
        ("gear: 200, counts_per_turn: 131072, direction: 1, offset: 0, speed: 110",
         "gear: 1e6, rated_torque_nm: 9, counts_per_turn: 131072, direction: 1, offset: 0, speed: 1e6", "speed: §1e6",
         "robots.left.axes.J2.speed: found 1000000.0, allowed 21474.8 or less, 32 bits of motor turns per minute"),
        ("direction: 1, offset: 0, speed: 110", "direction: 1, offset: 0, speed: 1e6", "speed: §1e6",
         "robots.left.axes.J2.speed: found 1000000.0, allowed 28912.9 or less, 32 bits of encoder counts"),
        (GRIPPER, "gripper: {axis: J7, bit: 16, at_stop: keep}", "§J7",
         "robots.left.outputs.gripper.axis: found 'J7', allowed an axis of left: J1, J2, J3, J4, J5, J6"),
        (GRIPPER, f"{GRIPPER}\n      laser: {{axis: J6, bit: 16, at_stop: off}}", "bit: §16, at_stop: off",
         "robots.left.outputs.laser.bit: found 16, that of gripper too, allowed each bit of 60FEh of J6 once"),
        (GRIPPER, "gripper: {axis: J6, bit: 32, at_stop: keep}", "bit: §32",
         "robots.left.outputs.gripper.bit: found 32, allowed 31 or less"),
        (GRIPPER, "gripper: {axis: J6, bit: 16, lead_s: 0.09, at_stop: keep}", "§0.09",
         "robots.left.outputs.gripper.lead_s: found 0.09, allowed 0.08 or less"),
        (GRIPPER, "gripper: {axis: J6, bit: 16}", "§gripper: {",
         "robots.left.outputs.gripper.at_stop: found nothing, allowed off or keep"),
        (GRIPPER, "gripper: {axis: J6, bit: 16, at_stop: on}", "at_stop: §on",
         "robots.left.outputs.gripper.at_stop: found 'on', allowed 'off' or 'keep'"),
        (GRIPPER, "\n      ".join(f"o{n}: {{axis: J{n // 8 + 1}, bit: {n % 8}, at_stop: off}}" for n in range(33)),
         "§outputs", "robots.left.outputs: found 33 outputs, allowed up to 32"),
        ("gear: 80,", "gear: 80, objects: {'60FE:02': 1},", "objects: {§'60FE:02': 1}",
         "robots.left.axes.J6.objects.60FE:02: found 60FE:02 beside outputs of this axis, with which the gateway "
         "writes it, allowed one of the two"),
        ("interface: virtual", "interface: token_ring", "§token_ring", "bus.interface: found 'token_ring', allowed "
         "one of python-can's: "),
    ],
)  # fmt: skip
def test_each_mistake_is_one_line_at_its_place(tmp_path: Path, old: str, new: str, at: str, problem: str) -> None:
    copy = Copy(tmp_path).change(DRIVES, old, new)
    assert any(line.startswith(f"{copy.place(DRIVES, at)}: {problem}") for line in lines(copy))


def test_a_guarded_node_must_be_able_to_count_the_polls_that_it_misses(tmp_path: Path) -> None:
    copy = Copy(tmp_path).change(DRIVES, "heartbeat_timeout_s: 1.0", "heartbeat_timeout_s: 30")
    load_drives(copy.drives, "left_bus")
    copy.change(DRIVES, "node: 3", "node: 3, error_control: guarding")
    place = copy.place(DRIVES, "heartbeat_timeout_s: §30")
    allowed = "2 to 255 times heartbeat_producer_s, 0.1, for nodes that are guarded"
    assert lines(copy) == [f"{place}: heartbeat_timeout_s: found 30, allowed {allowed}"]


def test_delay_of_a_drive_is_two_cycles_unless_its_axis_says_more(tmp_path: Path) -> None:
    copy = Copy(tmp_path).change(DRIVES, "gear: 200,", "gear: 200, delay_cycles: 5,")
    axes = load_drives(copy.drives, "left_bus").robots["left"].axes
    assert [axis.delay_cycles for axis in axes[:2]] == [2, 5]


def test_two_axes_on_one_node_are_a_valid_file(tmp_path: Path) -> None:
    copy = Copy(tmp_path).change(DRIVES, "node: 3", "node: 2, axis: 2")
    axes = load_drives(copy.drives, "left_bus").robots["left"].axes
    assert [(axis.node_id, axis.number) for axis in axes[:3]] == [(1, 1), (2, 1), (2, 2)]


def test_torque_feed_forward_is_told_in_per_mille_through_the_gear(tmp_path: Path) -> None:
    copy = Copy(tmp_path).change(DRIVES, "gear: 190,", "gear: 190, feed_forward: torque, rated_torque_nm: 9,")
    axis = load_drives(copy.drives, "left_bus").robots["left"].axes[2]
    assert (axis.velocity_offset, axis.torque_offset) == (True, True)
    assert axis.torque is not None
    # J3 turns against its motor.
    assert axis.torque.per_mille * 190 * 9 == pytest.approx(-1000)
    assert axis.torque.rated_mnm == 9000


def test_of_a_slide_the_force_goes_through_its_feed(tmp_path: Path) -> None:
    placer = "mixed/placer_drives.yaml"
    copy = Copy(tmp_path).change(placer, "feed: 20,", "feed: 20, feed_forward: torque, rated_torque_nm: 1.3,")
    axis = load_drives(copy.folder / placer, "placer_bus").robots["placer"].axes[2]
    assert axis.torque is not None
    # 1.3 Nm at the shaft do 1.3 * 2 pi J in a turn; so does the force over its way.
    force_n = 1000 / abs(axis.torque.per_mille)
    way_m = axis.index_counts / abs(axis.counts_per_unit)
    assert force_n * way_m == pytest.approx(1.3 * 2 * math.pi)
