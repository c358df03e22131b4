"""The wire: one frame at a time, lowest identifier first, each as long as its bits; nodes after it."""

from dataclasses import replace

from hypothesis import given
from hypothesis import strategies as st

from drive_gateway.canopen.frame import CanFrame
from drive_gateway.canopen.stuffing import exact_bits
from drive_gateway.sim.bus import IN_STEP_S, SimulatedBus
from drive_gateway.sim.nodes.node import SimulatedNode
from drive_gateway.sim.wire import Wire
from tests.unit.sim_drive_world import AXIS, COUNTS, CYCLE_S, LAG_S, NODE, START, Bench

BITRATE = 500_000


def frame(cob_id: int, size: int = 6) -> CanFrame:
    return CanFrame(cob_id, bytes(size))


def carried(wire: Wire) -> list[tuple[int, float]]:
    found = []
    while (delivered := wire.take(1e9)) is not None:
        found.append((delivered.frame.id, delivered.at))
    return found


def test_frame_arrives_when_its_last_bit_is_through() -> None:
    wire = Wire(BITRATE)
    wire.send(frame(0x181), 2.0, from_master=True)
    end = 2.0 + exact_bits(frame(0x181)) / BITRATE
    assert wire.take(end - 1e-6) is None
    delivered = wire.take(end + 1e-9)
    assert delivered is not None
    assert abs(delivered.at - end) < 1e-9


def test_lowest_identifier_wins_but_interrupts_nobody() -> None:
    wire = Wire(BITRATE)
    wire.send(frame(0x300), 0.0, from_master=True)
    wire.send(frame(0x200), 1e-5, from_master=True)
    wire.send(frame(0x080), 2e-5, from_master=True)
    assert [cob_id for cob_id, _ in carried(wire)] == [0x300, 0x080, 0x200]


def test_data_win_against_a_remote_frame_of_the_same_identifier() -> None:
    wire = Wire(BITRATE)
    wire.send(CanFrame(0x181, b"", remote=True), 0.0, from_master=True)
    wire.send(frame(0x181), 0.0, from_master=False)
    first = wire.take(1.0)
    assert first is not None
    assert not first.frame.remote


@given(st.lists(st.tuples(st.integers(0, 0x7FF), st.floats(0.0, 0.01)), max_size=30))
def test_frames_never_overlap_and_none_is_lost(sends: list[tuple[int, float]]) -> None:
    wire = Wire(BITRATE)
    for cob_id, at in sends:
        wire.send(frame(cob_id), at, from_master=True)
    ends = carried(wire)
    assert sorted(cob_id for cob_id, _ in ends) == sorted(cob_id for cob_id, _ in sends)
    before = 0.0
    for cob_id, end in ends:
        assert end - exact_bits(frame(cob_id)) / BITRATE >= before - 1e-9
        before = end


def test_answers_of_nodes_take_the_wire_before_what_is_less_urgent() -> None:
    bus = SimulatedBus([SimulatedNode([AXIS], [START / COUNTS], CYCLE_S, LAG_S)], BITRATE)
    now = 0.0
    arrived: list[CanFrame] = []
    while not arrived:
        now += 0.001
        arrived += bus.step(now)
    assert [sent.id for sent in arrived] == [0x700 + NODE]
    request = CanFrame(0x600 + NODE, bytes.fromhex("4018100100000000"))
    assert bus.receive(request, now) == []
    assert bus.carry(now + 1e-4) == []
    (answer,) = bus.carry(now + 1e-3)
    assert answer.id == 0x580 + NODE


def test_without_wire_time_frames_arrive_at_once() -> None:
    bus = SimulatedBus([SimulatedNode([AXIS], [START / COUNTS], CYCLE_S, LAG_S)], None)
    bus.step(0.0)
    bus.step(0.1)
    assert bus.next_at is None
    assert len(bus.receive(CanFrame(0x600 + NODE, bytes.fromhex("4018100100000000")), 0.1)) == 1


def test_after_a_pause_no_node_moves_far_ahead_of_another() -> None:
    class Watched(SimulatedNode):
        def advance(self, now: float) -> None:
            super().advance(now)
            moved[self.node_id] = now
            apart.append(max(moved.values()) - min(moved.values()))

    moved, apart = {1: 0.0, 2: 0.0}, list[float]()
    bus = SimulatedBus([Watched([replace(AXIS, node_id=number)], [0.0], CYCLE_S, LAG_S) for number in (1, 2)], None)
    bus.step(0.0)
    bus.step(0.2)
    assert moved == {1: 0.2, 2: 0.2}
    assert max(apart) <= IN_STEP_S + 1e-9


def test_a_node_whose_cable_is_pulled_in_motion_goes_on_by_itself() -> None:
    bench = Bench()
    bench.prepare()
    bus = SimulatedBus([bench.node], None)
    advanced = []
    bench.node.advance = advanced.append  # type: ignore[method-assign]
    bus.timers(bench.now + 0.1)
    assert advanced == []
    bench.node.silence()
    bus.timers(bench.now + 0.2)
    assert advanced == [bench.now + 0.2]
