"""Digital outputs of simulated drives, from events of blocks to 60FEh of the node, on virtual time."""

from dataclasses import replace

import numpy as np
import pytest

from cell.messages import Claim, Estop, OutputEvent, SetpointBlock, SwitchOutput
from drive_gateway.canopen.sdo import Sdo
from drive_gateway.config.settings import OutputSettings, RobotDrives
from drive_gateway.gateway.drives.output_frames import REPEAT_S
from tests.sim.gateway_bench import CYCLE_S, GatewayBench, axis, settings

GRIPPER, GLUE, LAMP = range(3)
OUTPUTS = (
    OutputSettings("gripper", "J2", 16, keep=True),
    OutputSettings("glue", "J2", 3, lead_s=3 * CYCLE_S),
    OutputSettings("lamp", "J1", 31),
)
GRIPPER_BIT, GLUE_BIT, LAMP_BIT = 1 << 16, 1 << 3, 1 << 31
MASK = GRIPPER_BIT | GLUE_BIT
OUTPUT_FRAME = 0x400


class OutputBench(GatewayBench):
    """Two nodes; the second has two outputs, the first one."""

    def __init__(self) -> None:
        axes = (axis("J1", 1, output_mask=LAMP_BIT), axis("J2", 2, output_mask=MASK))
        super().__init__(replace(settings(*axes), robots={"left": RobotDrives("left", axes, OUTPUTS)}))
        self.ready()

    def on(self, node: int) -> int:
        return self.bus.nodes[node].outputs[0].on

    def move(self, owner: int, *events: tuple[int, int, bool], nominal: int = 400) -> int:
        """A slow move of 2 s; events are (ticks from its first, output, value). Answers its first tick."""
        s = np.arange(0.0, 2.0 + CYCLE_S / 2, CYCLE_S) / 2.0
        position = self.feedback.commanded + np.outer(s**3 * (10 - 15 * s + 6 * s**2), [0.5, 0.5])
        velocity = np.outer(7.5 * s**2 * (1 - s) ** 2, [0.5, 0.5]) * 2
        first = self.feedback.tick + 5
        said = tuple(OutputEvent(first + tick, number, *rest) for number, (tick, *rest) in enumerate(events, start=1))
        self.tell(SetpointBlock("left", owner, 1, 0, first, CYCLE_S, nominal, position, velocity, None, said))
        return first

    def to(self, tick: int) -> None:
        self.until(lambda: self.feedback.tick >= tick)


def test_the_owner_is_told_the_outputs_in_their_order() -> None:
    claim = OutputBench().ask(Claim("left", "a", "d")).claim
    assert claim.outputs == ("gripper", "glue", "lamp")


def test_at_the_start_they_are_written_off_then_unmasked_and_both_are_read_back() -> None:
    world = OutputBench()
    asked = [
        (request.sub, request.data) for request in world.requests if (request.node_id, request.index) == (2, 0x60FE)
    ]
    mask = MASK.to_bytes(4, "little")
    assert asked == [(1, bytes(4)), (1, None), (2, mask), (2, None)]
    mapped = [(r.index, r.sub, r.data.hex()) for r in world.requests if r.node_id == 2 and r.data and r.index & 15 == 2]
    rpdo = [item for item in mapped if item[0] in (0x1402, 0x1602)]
    assert rpdo == [
        (0x1402, 1, "02040080"), (0x1402, 2, "01"), (0x1602, 0, "00"), (0x1602, 1, "2001fe60"), (0x1602, 0, "01"),
        (0x1402, 1, "02040000"),
    ]  # fmt: skip
    assert (world.on(1), world.on(2)) == (0, 0)


def test_a_drive_switches_in_the_sync_of_exactly_that_tick_and_so_much_earlier_as_its_lead_says() -> None:
    world = OutputBench()
    first = world.move(world.enabled(), (50, GRIPPER, True), (60, GLUE, True), (60, LAMP, True), (70, GRIPPER, False))
    seen: dict[int, tuple[int, int]] = {}
    told: dict[int, int] = {}
    while world.feedback.tick < first + 80:
        world.cycle()
        seen[world.feedback.tick] = (world.on(1), world.on(2))
        told[world.feedback.tick] = world.feedback.outputs
    changes = [(tick - first, seen[tick]) for tick in seen if seen[tick] != seen.get(tick - 1, (0, 0))]
    assert changes == [
        (50, (0, GRIPPER_BIT)), (57, (0, MASK)), (60, (LAMP_BIT, MASK)), (70, (LAMP_BIT, GLUE_BIT)),
    ]  # fmt: skip
    assert [(tick - first, told[tick]) for tick in told if told[tick] != told.get(tick - 1, 0)] == [
        (50, 0b001), (57, 0b011), (60, 0b111), (70, 0b110),
    ]  # fmt: skip


def test_frames_are_sent_when_something_changes_and_every_now_and_then() -> None:
    world = OutputBench()
    owner = world.enabled()
    world.frames.clear()
    world.move(owner, (50, GLUE, True))
    world.run(1.0)
    frames = [frame.data.hex() for frame in world.frames if frame.id == OUTPUT_FRAME + 2]
    assert len(frames) == pytest.approx(1.0 / REPEAT_S + 1, abs=1)
    assert set(frames) == {"00000000", "08000000"}


def moving() -> GatewayBench:
    """Gripper, glue and lamp are on, and the gripper is soon to open."""
    world = OutputBench()
    first = world.move(world.enabled(), (50, GRIPPER, True), (60, GLUE, True), (60, LAMP, True), (200, GRIPPER, False))
    world.to(first + 100)
    assert (world.on(1), world.on(2)) == (LAMP_BIT, MASK)
    world.events.clear()
    return world


def stopped(world: GatewayBench) -> list[str]:
    return [event.text for event in world.events if event.code == "output_off"]


def test_a_fault_switches_off_what_must_not_stay_on_with_the_next_sync_and_holds_the_part() -> None:
    world = moving()
    world.bus.nodes[1].raise_emergency(0x5112)
    world.until(lambda: bool(stopped(world)))
    world.cycle()
    assert (world.on(1), world.on(2)) == (0, GRIPPER_BIT)
    assert stopped(world) == [
        f"left: output {name} was switched off, because its drives brake" for name in ("glue", "lamp")
    ]
    world.run(1.0)
    assert (world.on(1), world.on(2)) == (0, GRIPPER_BIT)


def test_while_a_program_runs_nobody_else_switches_them_also_where_the_robot_stands() -> None:
    world = OutputBench()
    owner = world.enabled()
    for sequence, runs in enumerate((True, False), start=1):
        there = world.feedback.commanded[None].repeat(50, axis=0)
        first = world.feedback.tick + 5
        block = SetpointBlock("left", owner, sequence, sequence - 1, first, CYCLE_S, 30, there, 0 * there, program=runs)
        world.tell(block)
        world.run(0.1)
        reply = world.ask(SwitchOutput("left", "gripper", True, "anna"))
        assert reply.ok is not runs, reply.text
        assert ("its program runs" in reply.text) is runs
        assert world.on(2) == (0 if runs else GRIPPER_BIT)


def test_where_blocks_stop_coming_they_go_off_while_the_robot_plays_on_to_its_end() -> None:
    world = OutputBench()
    first = world.move(world.enabled(), (50, GRIPPER, True), (60, GLUE, True), nominal=150)
    world.to(first + 149)
    assert world.on(2) == MASK
    world.to(first + 150)
    assert world.on(2) == GRIPPER_BIT
    assert world.feedback.level > 0
    assert stopped(world) == ["left: output glue was switched off, because no more blocks come"]


def test_an_emergency_stop_of_the_cell_switches_off_at_once() -> None:
    world = moving()
    world.tell(Estop("e1", True, "operator", "test"))
    world.run(3 * CYCLE_S)
    assert (world.on(1), world.on(2)) == (0, GRIPPER_BIT)
    assert world.feedback.level > 0


def test_a_node_that_was_power_cycled_gets_back_what_is_to_be_kept_and_nothing_else() -> None:
    world = moving()
    world.bus.nodes[2].power_cycle()
    assert world.on(2) == 0
    world.requests.clear()
    world.until(lambda: world.state is not None and not world.state.ready)
    world.until(lambda: world.state.ready)
    asked = [r.data for r in world.requests if (r.node_id, r.index, r.sub) == (2, 0x60FE, 1) and r.data is not None]
    assert asked == [GRIPPER_BIT.to_bytes(4, "little")]
    assert world.on(2) == GRIPPER_BIT
    assert world.bus.sdo(Sdo("", 2, 0x60FE, 1, None), world.now).data == GRIPPER_BIT.to_bytes(4, "little")


def test_drives_whose_gateway_is_gone_switch_their_outputs_off_by_themselves() -> None:
    world = moving()
    world.alive = False
    world.run(world.settings.heartbeat_timeout_s + 0.1)
    assert (world.on(1), world.on(2)) == (0, 0)


def test_a_gateway_that_starts_again_begins_with_outputs_off() -> None:
    world = moving()
    world.restart_gateway()
    world.ready()
    assert (world.on(1), world.on(2)) == (0, 0)
    assert world.feedback.outputs == 0


def test_the_state_of_the_bus_shows_each_output_at_its_axis() -> None:
    world = moving()
    world.run(0.3)
    shown = {node.axis: node.outputs for node in world.state.nodes}
    assert shown == {"J1": {"lamp": True}, "J2": {"gripper": True, "glue": True}}
