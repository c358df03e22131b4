"""An I/O node (CiA 401) beside the drives: brought up, switched on the path, supervised, and its inputs told."""

from dataclasses import replace

import numpy as np
import pytest

from cell.core import Shutdown
from cell.messages import (
    Claim,
    DisableDrives,
    EnableDrives,
    Estop,
    Fault,
    FaultDrive,
    OutputEvent,
    PlayoutState,
    ReadObject,
    ResetDrives,
    ScanBus,
    SetpointBlock,
    SimulateInput,
    SwitchOutput,
    WriteObject,
)
from drive_gateway.canopen.emcy import Meaning
from drive_gateway.canopen.frame import CanFrame
from drive_gateway.config.settings import IoSettings, NamedInput, OutputSettings, RobotDrives
from drive_gateway.gateway.drives.output_frames import REPEAT_S
from drive_gateway.sim.services.dictionary import Dictionary, key_of
from tests.sim.gateway_bench import CYCLE_S, GatewayBench, axis, settings

COUPLER = 20
GRIPPER, GLUE, VALVE = range(3)
OUTPUTS = (
    OutputSettings("gripper", "", 3, keep=True, io="coupler"),
    OutputSettings("glue", "", 9, lead_s=3 * CYCLE_S, io="coupler"),
    OutputSettings("valve", "J1", 16),
)
INPUTS = (
    NamedInput("part_present", "", 0, io="coupler"),
    NamedInput("full", "", 15, io="coupler"),
    NamedInput("pressure", "J1", 20),
)
GRIPPER_BIT, GLUE_BIT = 1 << 3, 1 << 9
BOTH = GRIPPER_BIT | GLUE_BIT
IO = IoSettings("coupler", COUPLER, input_bytes=2, output_bytes=2, kept=GRIPPER_BIT)
SILENT_S = 0.3


class IoBench(GatewayBench):
    """Two axes, and an I/O node with two of the robot's three outputs and two of its three inputs."""

    def __init__(self, io: IoSettings = IO) -> None:
        axes = (axis("J1", 1, output_mask=1 << 16, input_mask=1 << 20), axis("J2", 2))
        robots = {"left": RobotDrives("left", axes, OUTPUTS, INPUTS)}
        super().__init__(replace(settings(*axes), robots=robots, io_nodes=(io,)))
        self.owner = 0

    @property
    def coupler(self):
        return self.bus.nodes[COUPLER]

    @property
    def inputs(self) -> dict[str, bool | None]:
        return self.state.inputs["left"]

    @property
    def status(self):
        (status,) = self.state.io_nodes
        return status

    def move(self, *events: tuple[int, int, bool], nominal: int = 400) -> int:
        """A slow move of 2 s; events are (ticks from its first, output, value). Answers its first tick."""
        s = np.arange(0.0, 2.0 + CYCLE_S / 2, CYCLE_S) / 2.0
        position = self.feedback.commanded + np.outer(s**3 * (10 - 15 * s + 6 * s**2), [0.5, 0.5])
        velocity = np.outer(7.5 * s**2 * (1 - s) ** 2, [0.5, 0.5]) * 2
        first = self.feedback.tick + 5
        said = tuple(OutputEvent(first + tick, number, *rest) for number, (tick, *rest) in enumerate(events, start=1))
        self.tell(SetpointBlock("left", self.owner, 1, 0, first, CYCLE_S, nominal, position, velocity, None, said))
        return first

    def to(self, tick: int) -> None:
        self.until(lambda: self.feedback.tick >= tick)

    def pull_cable(self) -> None:
        self.coupler.silence()

    def plug_cable(self) -> None:
        self.coupler.silence(False)

    def events_of(self, code: str) -> list[str]:
        return [event.text for event in self.events if event.code == code]


def ready(io: IoSettings = IO) -> IoBench:
    world = IoBench(io)
    world.ready()
    return world


def moving(io: IoSettings = IO) -> IoBench:
    """Gripper and glue are on, and the gripper is soon to open."""
    world = ready(io)
    world.owner = world.enabled()
    first = world.move((50, GRIPPER, True), (60, GLUE, True), (60, VALVE, True), (300, GRIPPER, False))
    world.to(first + 100)
    assert world.coupler.outputs == BOTH
    world.events.clear()
    return world


def enabling(world: IoBench) -> str:
    """Empty when the robot can be enabled after a reset, else why not."""
    owner = world.ask(Claim("left", "again", "d")).claim.owner
    reset = world.ask(ResetDrives("left", owner))
    reply = world.ask(EnableDrives("left", owner)) if reset.ok else reset
    return "" if reply.ok else reply.text


def test_it_is_configured_like_a_drive_and_its_outputs_know_what_to_do_without_a_master() -> None:
    world = ready()
    asked = [(r.index, r.sub, r.data and r.data.hex()) for r in world.requests if r.node_id == COUPLER]
    assert asked[:2] == [(0x1018, 1, None), (0x1000, 0, None)]
    written = [item for item in asked if item[2] is not None]
    assert [item for item in written if item[0] in (0x1016, 0x1017)] == [(0x1017, 0, "3200"), (0x1016, 1, "c8007f00")]
    assert [item for item in written if item[0] >= 0x6200] == [
        (0x6207, 1, "00"), (0x6207, 2, "00"), (0x6206, 1, "f7"), (0x6206, 2, "ff"),
        (0x6200, 1, "00"), (0x6200, 2, "00"),
    ]  # fmt: skip
    assert [item for item in written if item[0] in (0x1600, 0x1A00)] == [
        (0x1600, 0, "00"), (0x1600, 1, "08010062"), (0x1600, 2, "08020062"), (0x1600, 0, "02"),
        (0x1A00, 0, "00"), (0x1A00, 1, "08010060"), (0x1A00, 2, "08020060"), (0x1A00, 0, "02"),
    ]  # fmt: skip
    assert (world.status.name, world.status.nmt, world.status.operational) == ("coupler", "Operational", True)


@pytest.mark.parametrize(
    ("objects", "found"),
    [
        ({(0x1000, 0): 0x00020192}, "device profile (1000h:00) is 402, the drives file says 401"),
        ({(0x1018, 1): 7}, "vendor-ID (1018h:01) is 7h, the drives file says 5h"),
    ],
)
def test_another_device_on_its_node_id_is_named_and_not_configured(objects: dict, found: str) -> None:
    world = IoBench(replace(IO, identity=replace(IO.identity, vendor=5 if (0x1018, 1) in objects else None)))
    for (index, sub), value in objects.items():
        world.coupler._objects.numbers[index << 8 | sub] = value
    world.until(lambda: world.state is not None and "another device" in world.state.problem)
    assert found in world.state.problem
    assert not world.state.ready
    written = [request for request in world.requests if request.node_id == COUPLER and request.data is not None]
    assert written == []


def test_outputs_switch_in_the_sync_of_exactly_their_tick_and_so_much_earlier_as_their_lead_says() -> None:
    world = ready()
    world.owner = world.enabled()
    first = world.move((50, GRIPPER, True), (60, GLUE, True), (60, VALVE, True), (70, GRIPPER, False))
    seen: dict[int, tuple[int, int]] = {}
    while world.feedback.tick < first + 80:
        world.cycle()
        seen[world.feedback.tick] = (world.coupler.outputs, world.bus.nodes[1].outputs[0].on >> 16)
    changes = [(tick - first, seen[tick]) for tick in seen if seen[tick] != seen.get(tick - 1, (0, 0))]
    assert changes == [(50, (GRIPPER_BIT, 0)), (57, (BOTH, 0)), (60, (BOTH, 1)), (70, (GLUE_BIT, 1))]
    world.run(0.3)
    assert world.status.outputs == {"left": {"gripper": False, "glue": True}}


def test_a_frame_is_sent_when_an_output_changes_and_every_now_and_then() -> None:
    world = ready()
    world.frames.clear()
    world.run(1.0)
    frames = [frame.data.hex() for frame in world.frames if frame.id == 0x200 + COUPLER]
    assert len(frames) == pytest.approx(1.0 / REPEAT_S, abs=1)
    assert set(frames) == {"0000"}


def test_an_emergency_stop_of_the_cell_switches_off_at_once_what_must_not_stay_on() -> None:
    world = moving()
    world.tell(Estop("e1", True, "operator", "test"))
    world.run(3 * CYCLE_S)
    assert world.coupler.outputs == GRIPPER_BIT
    assert world.feedback.level > 0


def test_inputs_are_unknown_until_measured_and_told_as_soon_as_they_change() -> None:
    world = IoBench()
    world.coupler.set_input(0, True)
    world.until(lambda: world.state is not None)
    assert world.inputs == {"part_present": None, "full": None, "pressure": None}
    world.ready()
    assert world.inputs == {"part_present": True, "full": False, "pressure": True}
    world.coupler.set_input(15, True)
    world.bus.nodes[1].set_input(20, False)
    world.run(0.04)
    assert world.inputs == {"part_present": True, "full": True, "pressure": False}


def test_an_input_that_bounces_does_not_flood_the_network() -> None:
    world = ready()
    first = world.state.sequence
    for _ in range(100):
        world.coupler.set_input(0, not world.inputs["part_present"])
        world.run(2 * CYCLE_S)
    assert world.state.sequence - first <= 100 * 2 * CYCLE_S / 0.02 + 1


def test_inputs_that_are_not_heard_any_more_are_unknown_and_stop_the_robot() -> None:
    world = moving()
    world.coupler.set_input(0, True)
    world.run(0.1)
    assert world.inputs["part_present"] is True
    world.lost = lambda frame: frame.id == 0x180 + COUPLER
    world.run(0.1)
    assert world.inputs == {"part_present": None, "full": None, "pressure": True}
    (text,) = world.events_of("tpdo_silent")
    assert text.startswith(f"left: node {COUPLER} (I/O coupler) sent no TPDO")
    assert world.feedback.state in (PlayoutState.STOPPING, PlayoutState.FAULT)


def test_a_silent_io_node_stops_the_robots_that_use_it_and_keeps_them_off_until_it_is_back() -> None:
    world = moving()
    world.pull_cable()
    world.run(SILENT_S)
    assert world.feedback.state in (PlayoutState.STOPPING, PlayoutState.FAULT)
    assert world.feedback.outputs == 1 << GRIPPER
    world.run(1.0)
    assert not world.state.ready
    assert f"cannot be enabled without its I/O nodes: node {COUPLER} (I/O coupler)" in enabling(world)
    world.plug_cable()
    world.until(lambda: world.state.ready)
    assert enabling(world) == ""


def test_its_outputs_go_to_their_safe_state_by_themselves_and_return_as_they_are_to_be() -> None:
    world = moving()
    world.pull_cable()
    world.run(1.0)
    assert world.coupler.outputs == GRIPPER_BIT
    world.plug_cable()
    world.until(lambda: world.state.ready)
    world.run(0.5)
    assert world.coupler.outputs == GRIPPER_BIT


def test_a_node_that_was_power_cycled_gets_back_what_is_to_be_kept_and_nothing_else() -> None:
    world = moving()
    world.coupler.power_cycle()
    world.until(lambda: not world.state.ready)
    world.until(lambda: world.state.ready)
    assert world.coupler.outputs == GRIPPER_BIT
    assert world.feedback.state is PlayoutState.FAULT


def test_nodes_whose_gateway_is_gone_take_their_safe_state() -> None:
    world = moving()
    world.alive = False
    world.run(world.settings.heartbeat_timeout_s + 0.1)
    assert world.coupler.outputs == GRIPPER_BIT


def test_an_emergency_of_it_stops_the_robots_that_use_it() -> None:
    world = moving()
    world.coupler.raise_emergency(0x2310)
    world.run(0.1)
    assert world.events_of("emergency") == [
        f"left: node {COUPLER} (I/O coupler) reports 2310h: continuous over-current"
    ]
    assert world.feedback.state in (PlayoutState.STOPPING, PlayoutState.FAULT)
    world.run(0.3)
    assert world.status.emergency_code == 0x2310
    world.coupler.end_emergency(0x2310)
    world.run(0.3)
    assert world.status.emergency_code is None


def test_where_its_loss_is_only_told_the_robot_goes_on_and_what_was_on_stays_off_when_it_is_back() -> None:
    world = moving(replace(IO, stops=False))
    world.pull_cable()
    world.run(SILENT_S)
    assert world.feedback.state is PlayoutState.PLAYING
    assert world.inputs["part_present"] is None
    assert (world.state.ready, world.state.problem) == (True, "")
    world.until(lambda: world.status.problem.startswith(f"node {COUPLER} (I/O coupler) sent no boot-up"))
    assert (world.state.ready, world.state.problem) == (True, "")
    assert world.events_of("output_off") == [
        f"left: output glue was switched off, because node {COUPLER} (I/O coupler) was lost"
    ]
    world.plug_cable()
    world.until(lambda: world.status.operational)
    assert world.coupler.outputs == 0, "the program has opened the gripper meanwhile"
    assert world.feedback.state is not PlayoutState.FAULT


def test_a_gateway_that_starts_again_begins_with_its_outputs_off() -> None:
    world = moving()
    world.restart_gateway()
    world.ready()
    assert world.coupler.outputs == 0


def test_a_gateway_that_ends_in_order_leaves_on_what_is_kept_and_no_error() -> None:
    world, emergencies = moving(), list[CanFrame]()
    world.lost = lambda frame: bool(frame.id == 0x080 + COUPLER and emergencies.append(frame))
    world.tell(Shutdown())
    world.until(lambda: world.ended)
    world.alive = False
    world.run(1.0)
    assert world.coupler.outputs == GRIPPER_BIT
    assert emergencies == [], "it does not miss the gateway"


def test_an_operator_switches_an_output_and_is_answered_when_the_node_shows_it() -> None:
    world = ready()
    reply = world.ask(SwitchOutput("left", "gripper", True, "anna@pc"))
    assert reply.ok, reply.text
    assert reply.text == f"left: output gripper is on: node {COUPLER} (I/O coupler) shows 6200h:01 = 08h"
    assert world.coupler.outputs == GRIPPER_BIT
    world.pull_cable()
    world.run(SILENT_S)
    refused = world.ask(SwitchOutput("left", "gripper", False, "anna@pc"))
    assert not refused.ok
    assert f"output gripper is at node {COUPLER} (I/O coupler)" in refused.text


def test_robots_share_a_node_and_each_stops_with_it() -> None:
    axes = axis("J1", 1), axis("J1", 2)
    robots = {
        name: RobotDrives(name, (each,), (OutputSettings("lamp", "", bit, keep=True, io="coupler"),))
        for bit, (name, each) in enumerate(zip(("left", "right"), axes, strict=True))
    }
    world = GatewayBench(replace(settings(*axes), robots=robots, io_nodes=(replace(IO, kept=3),)))
    world.ready()
    assert world.ask(SwitchOutput("left", "lamp", True, "me")).ok
    assert world.ask(SwitchOutput("right", "lamp", True, "me")).ok
    assert world.bus.nodes[COUPLER].outputs == 3
    world.bus.nodes[COUPLER].silence()
    world.run(SILENT_S)
    stopped = [event.data.get("robot") for event in world.events if event.code in ("heartbeat_lost", "tpdo_silent")]
    assert len(stopped) == 2


@pytest.mark.parametrize("code", [0x06010002, 0x06010000])
def test_a_node_with_a_fixed_mapping_is_taken_as_it_is(code: int) -> None:
    world = IoBench()
    _fix(world, code)
    world.ready()
    assert world.status.operational


def test_a_fixed_mapping_of_other_bytes_is_told_with_what_it_has() -> None:
    world = IoBench(replace(IO, input_bytes=1))
    _fix(world, 0x06010002)
    world.coupler._objects.numbers[0x1A00 << 8] = 2
    world.until(lambda: world.state is not None and "1A00h" in world.state.problem)
    assert "keeps 1A00h:00 (mapping of TPDO 1) at 2, needed is 1" in world.state.problem


def test_a_node_that_supports_no_remote_frames_keeps_bit_30_of_its_identifiers() -> None:
    world = IoBench()
    numbers = world.coupler.objects.numbers
    for number in range(4):
        key = key_of(0x1800 + number, 1)
        world.coupler.objects.followers[key] = lambda value, key=key: numbers.update({key: value | 1 << 30})
    world.ready()
    assert numbers[key_of(0x1800, 1)] == 0x40000000 | 0x180 + COUPLER


def test_an_emergency_that_is_only_a_warning_is_told_and_stops_nobody() -> None:
    world = moving(
        replace(IO, emergencies={0x2320: Meaning("an output at its limit", "look at its lamp", stops=False)})
    )
    world.coupler.raise_emergency(0x2320)
    world.run(0.2)
    assert world.feedback.state is PlayoutState.PLAYING
    assert ["an output at its limit" in text for text in world.events_of("io_warning")] == [True]


def _fix(world: IoBench, code: int) -> None:
    """Mapping parameters of the node can be read, not written."""
    answer = world.bus.sdo

    def sdo(request, now):
        if request.node_id == COUPLER and request.data is not None and request.index >> 8 in (0x16, 0x1A):
            return replace(answer(replace(request, data=None), now), data=b"", abort_code=code, problem="refused")
        return answer(request, now)

    world.bus.sdo = sdo


def test_frames_of_another_length_are_no_inputs() -> None:
    world = ready()
    world.lost = lambda frame: frame.id == 0x180 + COUPLER and len(frame.data) == 2
    for _ in range(30):
        world.tell(CanFrame(0x180 + COUPLER, b"\xff"))
        world.cycle()
    assert world.inputs["part_present"] is None
    assert any("1 bytes instead of 2" in text for text in world.events_of("tpdo_silent"))


@pytest.mark.parametrize(("name", "node"), [("full", "node 20 (I/O coupler)"), ("pressure", "node 1 (left J1)")])
def test_inputs_of_simulated_devices_are_set_over_the_bus(name: str, node: str) -> None:
    world = ready()
    for on, word in ((True, "on"), (False, "off")):
        reply = world.ask(SimulateInput("left", name, on))
        assert reply.text == f"left: input {name} is {word} at the simulated {node}"
        world.run(0.04)
        assert world.inputs[name] is on


def test_inputs_of_a_device_that_may_be_real_are_never_written() -> None:
    world = ready()
    world.coupler._objects.numbers[0x202001] = 1
    world.requests.clear()
    reply = world.ask(SimulateInput("left", "full", True))
    assert not reply.ok
    assert reply.text.startswith(f"node {COUPLER} (I/O coupler) is no simulated device of this project")
    assert [request for request in world.requests if request.data is not None] == []
    unknown = world.ask(SimulateInput("left", "empty", True))
    assert unknown.text == "left has no input empty; its inputs are part_present, full, pressure"


def test_an_operator_reads_its_objects_always_and_writes_them_when_its_robots_are_off() -> None:
    world = ready()
    world.owner = world.enabled()
    assert world.ask(ReadObject(COUPLER, 0x1000, 0)).data == "91010300"
    assert "is not at rest and switched off" in world.ask(WriteObject(COUPLER, 0x1029, 1, "01")).text
    world.ask(DisableDrives("left", world.owner))
    assert world.ask(WriteObject(COUPLER, 0x1029, 1, "01")).ok
    assert "is the gateway's; change it in the drives file" in world.ask(WriteObject(COUPLER, 0x6200, 1, "01")).text
    assert "node 20 (I/O coupler): operational" in world.ask(ScanBus()).text


def test_a_guarded_node_is_polled_and_missed() -> None:
    world = ready(replace(IO, guarded=True))
    assert any(frame.remote and frame.id == 0x700 + COUPLER for frame in world.frames)
    world.pull_cable()
    world.until(lambda: not world.state.ready)


def test_a_node_without_inputs_is_missed_by_its_heartbeat() -> None:
    axes = (axis("J1", 1),)
    robots = {"left": RobotDrives("left", axes, OUTPUTS[:1])}
    io = replace(IO, input_bytes=0)
    world = GatewayBench(replace(settings(*axes), robots=robots, io_nodes=(io,)))
    world.ready()
    world.bus.nodes[COUPLER].silence()
    world.run(SILENT_S)
    assert "heartbeat_lost" in world.codes()


def test_a_simulated_io_node_drops_out_on_command_and_has_no_axis_to_block() -> None:
    world = ready()
    assert world.ask(FaultDrive(COUPLER, 1, Fault.DROP_OUT, seconds=1.0)).ok
    world.until(lambda: not world.state.ready, within_s=1.0)
    world.until(lambda: world.state.ready)
    refused = world.ask(FaultDrive(COUPLER, 1, Fault.BLOCKED))
    assert "abort 06090011h, subindex does not exist" in refused.text


def test_an_object_that_it_lacks_is_refused_unless_waived_and_then_told_with_what_that_costs() -> None:
    world = IoBench()
    world.coupler._objects._dictionary = _without(world, 0x6206)
    world.until(lambda: world.state is not None and bool(world.state.problem))
    assert "refused write of 6206h:01 (error mode of the outputs" in world.state.problem
    world = IoBench(replace(IO, waived=frozenset({0x6206})))
    world.coupler._objects._dictionary = _without(world, 0x6206)
    world.ready()
    (text,) = world.events_of("object_missing")
    assert text.endswith("what its outputs do when the gateway is gone is its own setting")


def _without(world: IoBench, index: int) -> Dictionary:
    """The objects of the node but one."""
    whole = world.coupler._objects._dictionary
    left = {key: entry for key, entry in whole.entries.items() if key >> 8 != index}
    return Dictionary(left, whole.indices - {index})
