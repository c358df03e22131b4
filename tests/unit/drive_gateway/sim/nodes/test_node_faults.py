"""Faults on command, at both levels of the simulation: the drive stops, says its code, and can be reset afterwards."""

from collections.abc import Callable
from dataclasses import replace
from math import pi

import pytest

from drive_gateway.config.settings import AxisSettings
from drive_gateway.sim.axis.axis_data import AxisData
from drive_gateway.sim.axis.dc_bus import DcBus, DcBusData
from drive_gateway.sim.axis.encoder import EncoderData
from drive_gateway.sim.axis.full_servo import FullServo
from drive_gateway.sim.axis.gains import ServoData
from drive_gateway.sim.axis.load import constant
from drive_gateway.sim.axis.mechanics import LoadData
from drive_gateway.sim.axis.motor_data import MOTORS
from drive_gateway.sim.drives.power_state import DriveState
from drive_gateway.sim.nodes.node import SimulatedNode
from drive_gateway.sim.services.emergency import FOLLOWING_ERROR
from tests.unit.sim_drive_world import AXIS, COUNTS, CYCLE_S, LAG_S, NODE, START, Bench

FINE = 10.0
"""The full level's encoder is finer than that of the fast level's axis."""
FULL_AXIS: AxisSettings = replace(AXIS, counts_per_unit=FINE * AXIS.counts_per_unit)
GEAR = 50.0
DATA = AxisData(
    motor=MOTORS["joint-medium"],
    gear=GEAR,
    direction=1,
    offset=0.0,
    load=LoadData(1.0, coulomb_nm=2.0),
    torque=constant(0.0),
    encoder=EncoderData(round(2 * pi * FULL_AXIS.counts_per_unit / GEAR)),
    servo=ServoData(),
    top_speed=1.2 * AXIS.speed * GEAR,
    seed=NODE,
)
SPEED = 0.2
"""[rad/s]"""
RESET = 0x80


class Rig(Bench):
    """A node at one of the levels, enabled and moving."""

    def __init__(self, full: bool) -> None:
        super().__init__()
        self.scale = FINE if full else 1.0
        if full:
            servo = FullServo(DATA, FINE * START, LAG_S, DcBus(DcBusData()))
            self.node = SimulatedNode([FULL_AXIS], [START / COUNTS], CYCLE_S, LAG_S, servos=[servo])
        self.prepare(x6065_0=round(1000 * self.scale), x6085_0=round(300_000 * self.scale))
        self.enable()
        self.target = self.drive(0.2, 0.0)
        self.move(0.3)

    def move(self, seconds: float) -> None:
        self.target = self.drive(seconds, SPEED * AXIS.counts_per_unit * self.scale, self.target)

    def until_fault(self) -> int:
        """The code of the first emergency; the master sends on."""
        for _ in range(500):
            self.move(CYCLE_S)
            if self.node.state is DriveState.FAULT:
                return int.from_bytes(self.sent_on(0x080 + NODE)[0][:2], "little")
        raise AssertionError(f"no fault, {self.node.state.name}")

    def reset(self) -> DriveState:
        for word in (0, RESET, RESET, 0, 0):
            self.cycle(word, self.node.position)
        return self.node.state


LEVELS = pytest.mark.parametrize("full", [False, True], ids=["fast", "full"])


@LEVELS
@pytest.mark.parametrize(
    ("fault", "allowed"),
    [
        (lambda node: node.raise_emergency(0x5114), {0x5114}),
        (lambda node: node.raise_emergency(0xFF07), {0xFF07}),
        (lambda node: node.servo.jump(50_000), {FOLLOWING_ERROR, 0x7380}),
        (lambda node: node.servo.block(True), {FOLLOWING_ERROR, 0x7121}),
    ],
    ids=["EMCY", "EMCY of the maker", "encoder jump", "overload"],
)
def test_fault_stops_the_axis_under_its_name(
    full: bool, fault: Callable[[SimulatedNode], None], allowed: set[int]
) -> None:
    rig = Rig(full)
    assert rig.node.state is DriveState.OPERATION_ENABLED
    fault(rig.node)
    assert rig.until_fault() in allowed
    rig.node.servo.block(False)
    assert rig.reset() is DriveState.SWITCH_ON_DISABLED


@LEVELS
def test_hot_motor_is_not_reset_before_it_has_cooled(full: bool) -> None:
    rig = Rig(full)
    rig.node.servo.heat(True)
    assert rig.until_fault() == 0x4310
    assert rig.reset() is DriveState.FAULT
    rig.node.servo.heat(False)
    assert rig.reset() is DriveState.SWITCH_ON_DISABLED


@LEVELS
def test_stuck_brake_is_a_following_error_or_a_blocked_axis(full: bool) -> None:
    rig = Rig(full)
    rig.node.servo.stick_brake(True)
    assert rig.until_fault() in {FOLLOWING_ERROR, 0x7121, 0x2310}


@LEVELS
def test_node_that_drops_out_stops_by_itself(full: bool) -> None:
    rig = Rig(full)
    rig.node.silence()
    rig.wait(0.4)
    assert rig.node.state is DriveState.FAULT
    assert rig.node.servo.standing


def test_late_process_data_come_late_and_stop_with_the_node() -> None:
    rig = Rig(False)
    rig.node.delay_tpdos(0.01)
    before = len(rig.sent_on(0x180 + NODE))
    rig.wait(CYCLE_S)
    rig.send(0x080, b"")
    rig.wait(0.009)
    assert len(rig.sent_on(0x180 + NODE)) == before
    rig.wait(0.002)
    assert len(rig.sent_on(0x180 + NODE)) == before + 1
    rig.send(0x080, b"")
    rig.nmt(0x02)
    rig.wait(0.02)
    assert len(rig.sent_on(0x180 + NODE)) == before + 1
