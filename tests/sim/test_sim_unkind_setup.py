"""Set-up with drives that have habits: units of their own, bits that stay, late statuswords, loops that hunt."""

import numpy as np
import pytest

from cell.messages import AxisStatus, DisableDrives, Home, MoveAxes
from drive_gateway.config.drive_units import drive_units
from drive_gateway.config.settings import AxisSettings
from drive_gateway.sim.drives.power_state import DriveState
from tests.sim.gateway_bench import GatewayBench, axis, homing, settings
from tests.sim.unkind.traits.homing import HOMING
from tests.sim.unkind.traits.trait import Trait
from tests.sim.unkind.traits.units import UNITS
from tests.sim.unkind.traits.values import VALUES

PER_TURN = 10_000
DEGREE = np.radians(1.0)
BY_NAME = {trait.name: trait for trait in (*HOMING, *UNITS, *VALUES)}
COASTS = "coasts at disable voltage in its reaction to a fault"
SPEAKS = {
    "speeds in rpm": ("rpm", "counts/s^2"),
    "speeds in rpm, as 60A9h says": ("rpm", "rpm/s"),
    "speeds in 0.0001 rpm": ("0.0001 rpm", "counts/s^2"),
    "accelerations in deg/s^2": ("counts/s", "deg/s^2"),
    "accelerations in 0.1 rpm/s": ("rpm", "0.1 rpm/s"),
}


def speaking(velocity: str, acceleration: str = "counts/s^2", **changes: object) -> AxisSettings:
    units = drive_units(velocity, acceleration, PER_TURN, 0.0)
    return axis("J1", 1, units=units, index_counts=PER_TURN, incremental=True, homing=homing(17, -0.5), **changes)


def world_of(axis_settings: AxisSettings, *names: str) -> GatewayBench:
    world = GatewayBench(settings(axis_settings))
    for name in names:
        BY_NAME[name].give(world.bus.nodes[1])
    return world


def place(world: GatewayBench) -> float:
    """Where the axis really is [rad]."""
    (node,) = world.bus.nodes.values()
    return node.position / 100_000.0 + 0.25


def farthest_while(world: GatewayBench, command: Home | MoveAxes) -> tuple[str, float, float]:
    """Set up; answers how it ended, how far the axis was from its start [rad] and how fast [rad/s]."""
    start, far, fast, before = place(world), 0.0, 0.0, place(world)
    assert world.ask(command).ok
    world.holder, world.said = "left", ("", "moving")
    while world.said[1] == "moving":
        world.cycle()
        far, fast = max(far, abs(place(world) - start)), max(fast, abs(place(world) - before) / 0.004)
        before = place(world)
    world.holder = ""
    world.run(0.5)
    return world.said[1], max(far, abs(place(world) - start)), fast


@pytest.mark.parametrize("name", SPEAKS)
def test_a_drive_homes_and_moves_in_its_own_units_when_the_file_says_them(name: str) -> None:
    world = world_of(speaking(*SPEAKS[name]), name)
    world.ready()
    assert world.set_up(Home("left", ())) == "done", world.said
    assert world.feedback.position == pytest.approx([place(world)], abs=1e-3)
    before = place(world)
    assert world.set_up(MoveAxes("left", {"J1": 0.3}, True, 1.0, False)) == "done", world.said
    assert place(world) - before == pytest.approx(0.3, abs=2e-3)
    world.enabled()


@pytest.mark.parametrize(
    ("name", "units", "text"),
    [
        ("speeds in rpm", ("counts/s", "counts/s^2"), "moves faster than it was told"),
        ("speeds in 0.0001 rpm", ("counts/s", "counts/s^2"), "moves slower than it was told"),
        ("speeds in 0.0001 rpm", ("rpm", "counts/s^2"), "moves slower than it was told"),
        ("accelerations in 0.1 rpm/s", ("counts/s", "0.1 rpm/s"), "moves faster than it was told"),
        ("velocities against positions", ("counts/s", "counts/s^2"), "moves against the direction that it was told"),
    ],
)
@pytest.mark.parametrize("by", ["homing", "position", "velocity"])
def test_a_drive_that_means_another_unit_is_found_by_its_first_motion_within_a_degree(
    name: str, units: tuple[str, str], text: str, by: str
) -> None:
    world = world_of(speaking(*units), name)
    world.ready()
    command = Home("left", ()) if by == "homing" else MoveAxes("left", {"J1": 0.3}, True, 1.0, by == "velocity")
    ended, far, fast = farthest_while(world, command)
    assert ended == "stopped"
    assert text in world.said[0]
    assert "in the drives file" in world.said[0]
    assert far <= DEGREE
    assert fast < 0.1
    assert not world.feedback.referenced


def test_a_wrong_unit_is_found_again_at_the_next_order_and_no_motion_follows() -> None:
    world = world_of(speaking("counts/s"), "speeds in rpm")
    world.ready()
    for _ in range(3):
        ended, far, _ = farthest_while(world, Home("left", ()))
        assert (ended, far <= DEGREE) == ("stopped", True)


def test_an_axis_is_tried_once_after_each_start_of_its_drive() -> None:
    world = world_of(speaking("counts/s"))
    world.ready()
    seen = []
    for _ in range(2):
        assert world.ask(Home("left", ())).ok
        world.holder, world.said = "left", ("", "moving")
        tried = False
        while world.said[1] == "moving":
            world.cycle()
            tried = tried or "tries its units" in world.said[0]
        world.holder = ""
        world.run(0.3)
        seen.append(tried)
    assert seen == [True, False]


def test_a_drive_whose_60a9h_says_another_unit_than_the_file_is_neither_moved_nor_enabled() -> None:
    world = world_of(speaking("counts/s"), "speeds in rpm, as 60A9h says")
    world.until(lambda: world.state is not None and "60A9h" in world.state.problem)
    assert not world.state.ready
    world.run(0.3)
    refused = world.ask(Home("left", ()))
    assert "node 1 (left J1) says by 60A9h (00B44700h)" in refused.text
    assert "correct velocity_unit" in refused.text


def test_homing_is_not_done_by_the_bits_of_the_one_before() -> None:
    world = world_of(speaking("counts/s"), "homing bits stay", "late statusword")
    world.ready()
    assert world.set_up(Home("left", ())) == "done"
    home = place(world)
    assert world.set_up(MoveAxes("left", {"J1": 0.8}, True, 1.0, False)) == "done", world.said
    assert world.set_up(Home("left", ())) == "done"
    assert place(world) == pytest.approx(home, abs=0.01)


def test_a_homing_error_of_before_does_not_end_the_next_homing() -> None:
    world = world_of(speaking("counts/s", brake_s=0.0), "homing bits stay", "late statusword")
    world.ready()
    world.bus.nodes[1].drives[0].setup.homing.start(99, 0.0)
    assert world.set_up(Home("left", ())) == "done", world.said


@pytest.mark.parametrize("trait", HOMING, ids=lambda trait: trait.name)
def test_homing_and_moves_end_where_they_should_with_every_habit(trait: Trait) -> None:
    world = world_of(speaking("counts/s", rest_window=1e-3), trait.name)
    world.ready()
    assert world.set_up(Home("left", ())) == "done", world.said
    for by_velocity in (False, True):
        before = place(world)
        assert world.set_up(MoveAxes("left", {"J1": 0.4}, True, 1.0, by_velocity)) == "done", world.said
        assert place(world) - before == pytest.approx(0.4, abs=0.01)
    owner = world.enabled()
    assert world.ask(DisableDrives("left", owner)).ok


def test_a_drive_that_hunts_is_at_rest_within_the_window_of_its_axis_and_not_without_it() -> None:
    for window, ok in ((1e-3, True), (2e-4, False)):
        world = world_of(axis("J1", 1, rest_window=window), "hunts at rest")
        world.ready()
        owner = world.enabled()
        world.run(0.3)
        reply = world.ask(DisableDrives("left", owner))
        assert reply.ok is ok


@pytest.mark.parametrize("names", [(), (COASTS,), (COASTS, "bits_of_states_alone")])
def test_a_drive_that_brakes_in_its_reaction_to_a_fault_hears_its_last_word_again(names: tuple[str, ...]) -> None:
    world = world_of(axis("J1", 1, quick_stop=11.0), *names)
    world.ready()
    assert world.ask(MoveAxes("left", {"J1": 1.0}, True, 1.0, False)).ok
    world.holder = "left"
    world.until(lambda: world.feedback.velocity[0] > 0.4)
    drive = world.bus.nodes[1].drives[0]
    world.bus.nodes[1].raise_emergency(0x4310)
    world.until(lambda: world.feedback.axes[0] in (AxisStatus.FAULT_REACTION_ACTIVE, AxisStatus.FAULT), within_s=0.1)
    braking = 0
    while drive.state is DriveState.FAULT_REACTION_ACTIVE:
        world.frames.clear()
        world.cycle()
        words = [frame.data[:2] for frame in world.frames if frame.id == 0x201]
        assert b"\0\0" not in words
        braking += len(words)
    assert braking > 5
    assert drive.servo.standing


def test_every_habit_says_what_it_does_and_where_that_is_known_from() -> None:
    assert len(BY_NAME) == len(HOMING) + len(UNITS) + len(VALUES)
    assert all(trait.says.endswith(".") and trait.source for trait in BY_NAME.values())


def test_two_axes_of_a_group_are_tried_together() -> None:
    both = settings(axis("J1", 1), axis("J2", 2, counts_per_unit=-80_000.0))
    world = GatewayBench(both)
    world.ready()
    began = world.now
    assert world.set_up(MoveAxes("left", {"J1": 0.05, "J2": 0.05}, True, 1.0, False)) == "done"
    assert world.now - began < 7.0
