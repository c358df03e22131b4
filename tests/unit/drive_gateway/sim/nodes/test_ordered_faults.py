"""Faults on command of a simulated node: ordered by SDO, refused where they mean nothing, and over in time."""

import struct

import pytest

from cell.messages import Fault
from drive_gateway.canopen.fault_object import DURATION_SUB, FAULT_SUBS, MARK, MARK_SUB, fault_index
from drive_gateway.sim.drives.power_state import DriveState
from tests.unit.sim_drive_world import CYCLE_S, NODE, Bench, Refused

OBJECT = fault_index(1)
VALUES = {Fault.EMERGENCY: 0x5112, Fault.ENCODER_JUMP: 4000, Fault.LATE_TPDOS: 60}


class Rig(Bench):
    """A node that stands, to which faults are ordered."""

    def __init__(self) -> None:
        super().__init__()
        self.prepare()

    def order(self, fault: Fault, value: int | None = None, seconds: float = 0.0) -> None:
        self.write(OBJECT, DURATION_SUB, round(1000.0 * seconds), 4)
        sub, size = FAULT_SUBS[fault]
        self.write(OBJECT, sub, VALUES.get(fault, 1) if value is None else value, size)
        self.wait(0.001)

    def tpdos(self) -> int:
        return len(self.send(0x080, b""))


@pytest.mark.parametrize("fault", [Fault.DROP_OUT, Fault.LATE_TPDOS])
def test_a_cable_that_is_out_and_tpdos_that_are_late_are_so_for_the_ordered_time(fault: Fault) -> None:
    rig = Rig()
    rig.order(fault, seconds=0.5)
    rig.wait(0.4)
    assert rig.tpdos() == 0
    rig.wait(0.2)
    assert rig.tpdos() == 1


def test_a_node_that_is_out_hears_nothing_and_can_be_told_to_drop_out_again() -> None:
    rig = Rig()
    for _ in range(2):
        rig.order(Fault.DROP_OUT, seconds=0.5)
        assert rig.send(0x600 + NODE, struct.pack("<BHBI", 0x40, 0x6041, 0, 0)) == []
        rig.wait(0.6)
        rig.read(0x6041)


def test_an_encoder_jumps_and_jumps_back() -> None:
    rig = Rig()
    before = rig.node.position
    rig.order(Fault.ENCODER_JUMP, seconds=1.0)
    assert rig.node.position == before + 4000
    rig.wait(1.1)
    assert rig.node.position == before


@pytest.mark.parametrize("fault", [Fault.EMERGENCY, Fault.BLOCKED, Fault.STUCK_BRAKE, Fault.HOT_MOTOR])
def test_a_drive_that_was_told_to_fail_is_in_fault_until_the_cause_is_gone(fault: Fault) -> None:
    rig = Rig()
    rig.enable()
    rig.order(fault, seconds=0.0 if fault is Fault.EMERGENCY else 2.5)
    target, cycles = rig.node.position, 0
    while rig.node.state is not DriveState.FAULT:
        target, cycles = target + 0.2 * 10_000.0 * CYCLE_S, cycles + 1
        assert cycles < 500
        rig.cycle(0x0F, target)
    rig.wait(2.5)
    for word in (0, 0x80, 0x80, 0, 0):
        rig.cycle(word, rig.node.position)
    assert rig.node.state is DriveState.SWITCH_ON_DISABLED


def test_a_fault_stays_over_a_reset_until_it_is_taken_back() -> None:
    rig = Rig()
    rig.order(Fault.LATE_TPDOS)
    rig.nmt(0x81)
    rig.prepare()
    assert rig.tpdos() == 0
    rig.order(Fault.LATE_TPDOS, 0)
    assert rig.tpdos() == 1


def test_an_order_takes_the_place_of_one_that_lasts() -> None:
    rig = Rig()
    before = rig.node.position
    rig.order(Fault.ENCODER_JUMP, 4000, seconds=0.2)
    rig.order(Fault.ENCODER_JUMP, -300)
    rig.wait(0.4)
    assert rig.node.position == before - 300


@pytest.mark.parametrize(
    ("sub", "size", "value", "code"),
    [
        (DURATION_SUB, 4, 3_600_001, 0x06090031),
        (FAULT_SUBS[Fault.EMERGENCY][0], 2, 0, 0x06090032),
        (FAULT_SUBS[Fault.DROP_OUT][0], 1, 0, 0x06090032),
        (FAULT_SUBS[Fault.ENCODER_JUMP][0], 4, 0, 0x06090030),
        (FAULT_SUBS[Fault.BLOCKED][0], 1, 2, 0x06090031),
        (FAULT_SUBS[Fault.LATE_TPDOS][0], 2, 10_001, 0x06090031),
        (FAULT_SUBS[Fault.LATE_TPDOS][0], 4, 60, 0x06070012),
        (MARK_SUB, 4, 0, 0x06010002),
        (10, 1, 1, 0x06090011),
    ],
)
def test_what_means_nothing_is_refused_by_its_abort_code(sub: int, size: int, value: int, code: int) -> None:
    rig = Rig()
    with pytest.raises(Refused) as refused:
        rig.write(OBJECT, sub, value, size)
    assert refused.value.code == code


@pytest.mark.parametrize(("fault", "value"), [(Fault.EMERGENCY, 0x5112), (Fault.BLOCKED, 0)])
def test_a_duration_before_what_has_none_is_incompatible(fault: Fault, value: int) -> None:
    rig = Rig()
    with pytest.raises(Refused) as refused:
        rig.order(fault, value, seconds=1.0)
    assert refused.value.code == 0x06040043
    rig.order(fault, value)


def test_orders_are_not_read_and_not_stored_and_the_mark_says_what_the_node_is() -> None:
    rig = Rig()
    for sub in (DURATION_SUB, *(sub for sub, _ in FAULT_SUBS.values())):
        with pytest.raises(Refused) as refused:
            rig.read(OBJECT, sub)
        assert refused.value.code == 0x06010001
    assert rig.read(OBJECT, MARK_SUB).to_bytes(4, "little") == MARK
    rig.write(OBJECT, DURATION_SUB, 100, 4)
    rig.write(0x1010, 1, int.from_bytes(b"save", "little"), 4)
    rig.nmt(0x81)
    rig.prepare()
    rig.write(OBJECT, FAULT_SUBS[Fault.LATE_TPDOS][0], 60, 2)  # no duration is left: it stays
    rig.wait(0.5)
    assert rig.tpdos() == 0
