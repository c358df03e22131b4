"""Faults on command from outside: refused for real drives, carried out on simulated ones, and over in time."""

import pytest
from gateway_world import World
from sim_drive_world import CYCLE_S, NODE, Bench

from cell.messages import Fault, FaultDrive
from drive_gateway.gateway.fault_orders import FaultOrders
from drive_gateway.sim.ordered_faults import OrderedFaults
from drive_gateway.sim.power_state import DriveState

VALUES = {Fault.EMERGENCY: 0x5112, Fault.ENCODER_JUMP: 4000, Fault.LATE_TPDOS: 60}


def order(fault: Fault, seconds: float | None = None) -> FaultDrive:
    return FaultDrive(NODE, 1, fault, VALUES.get(fault), seconds)


class Rig(Bench):
    """A node, enabled and standing, to which faults are ordered."""

    def __init__(self) -> None:
        super().__init__()
        self.prepare()
        self.enable()
        self.faults = OrderedFaults([self.node])
        self.drive(0.1, 0.0)

    def suffer(self, fault: Fault, seconds: float | None = None) -> None:
        self.faults.order(order(fault, seconds))
        self.faults.step(self.now)

    def over(self, seconds: float) -> None:
        self.faults.step(self.now + seconds)


@pytest.mark.parametrize("fault", Fault)
def test_drives_that_may_be_real_never_fail_on_command(fault: Fault) -> None:
    reply = World().ask(FaultDrive(1, 1, fault, VALUES.get(fault)))
    assert not reply.ok
    assert "does not simulate its drives, they may be real" in reply.text


@pytest.mark.parametrize(
    ("wrong", "found"),
    [
        (FaultDrive(9, 1, Fault.BLOCKED), "no axis 1 of node 9"),
        (FaultDrive(NODE, 1, Fault.EMERGENCY), "needs a value, the code of an error, 1 to 65535; found None"),
        (FaultDrive(NODE, 1, Fault.BLOCKED, 3), "takes no value; found 3"),
        (FaultDrive(NODE, 1, Fault.EMERGENCY, 0x5112, 1.0), "over when the drive is reset"),
        (FaultDrive(NODE, 1, Fault.DROP_OUT, None, -1.0), "above 0 and up to 3600 s; found -1"),
    ],
)
def test_an_order_that_cannot_be_says_why(wrong: FaultDrive, found: str) -> None:
    ok, text = FaultOrders("left_bus", {(NODE, 1)}, simulated=True).judged(wrong)
    assert not ok
    assert found in text


def test_a_cable_that_is_out_and_tpdos_that_are_late_are_so_for_the_ordered_time() -> None:
    for fault in (Fault.DROP_OUT, Fault.LATE_TPDOS):
        rig = Rig()
        rig.suffer(fault, seconds=0.5)
        rig.over(0.4)
        assert rig.send(0x080, b"") == []
        rig.over(0.6)
        assert len(rig.send(0x080, b"")) == 1


def test_an_encoder_jumps_and_jumps_back() -> None:
    rig = Rig()
    before = rig.node.position
    rig.suffer(Fault.ENCODER_JUMP, seconds=1.0)
    assert rig.node.position == before + 4000
    rig.over(1.1)
    assert rig.node.position == before


@pytest.mark.parametrize("fault", [Fault.EMERGENCY, Fault.BLOCKED, Fault.STUCK_BRAKE, Fault.HOT_MOTOR])
def test_a_drive_that_was_told_to_fail_is_in_fault_until_the_cause_is_gone(fault: Fault) -> None:
    rig = Rig()
    rig.suffer(fault, seconds=None if fault is Fault.EMERGENCY else 1.0)
    target, cycles = rig.node.position, 0
    while rig.node.state is not DriveState.FAULT:
        target, cycles = target + 0.2 * 10_000.0 * CYCLE_S, cycles + 1
        assert cycles < 500
        rig.cycle(0x0F, target)
    rig.over(10.0)
    for word in (0, 0x80, 0x80, 0, 0):
        rig.cycle(word, rig.node.position)
    assert rig.node.state is DriveState.SWITCH_ON_DISABLED
