"""The smallest world around one fully simulated axis: a master that gives set points on virtual time."""

from collections.abc import Callable
from dataclasses import replace
from math import pi
from typing import Any

from drive_gateway.sim.axis.axis_data import AxisData
from drive_gateway.sim.axis.dc_bus import DcBus, DcBusData
from drive_gateway.sim.axis.encoder import EncoderData
from drive_gateway.sim.axis.full_servo import FullServo
from drive_gateway.sim.axis.gains import ServoData
from drive_gateway.sim.axis.load import constant
from drive_gateway.sim.axis.mechanics import LoadData
from drive_gateway.sim.axis.motor_data import MOTORS

CYCLE_S = 0.004
LAG_S = 0.008
GEAR = 100.0
COUNTS = 131072 * GEAR / (2 * pi)
"""Counts per rad of the axis."""
QUICK_STOP = 10.0 * COUNTS

AXIS = AxisData(
    motor=MOTORS["joint-large"],
    gear=GEAR,
    direction=1,
    offset=0.0,
    load=LoadData(20.0, coulomb_nm=5.0, viscous_nm_s=5.0),
    torque=constant(0.0),
    encoder=EncoderData(131072, noise_counts=0.5),
    servo=ServoData(),
    top_speed=2.4 * GEAR,
    seed=1,
)


class Rig:
    """One axis and its DC bus. `codes` is all that its protections found."""

    def __init__(self, bus: DcBus | None = None, start: float = 1e6, **changes: Any) -> None:
        self.bus = bus or DcBus(DcBusData())
        self.servo = FullServo(replace(AXIS, **changes), start, LAG_S, self.bus)
        self.target = self.servo.position
        self.codes: list[int] = []

    def follow(self, seconds: float, speed: float = 0.0) -> None:
        """Give set points of a constant speed [rad/s of the axis]."""
        for _ in range(round(seconds / CYCLE_S)):
            self.target += speed * COUNTS * CYCLE_S
            self.servo.interpolate(self.target, CYCLE_S)
            self.step(lambda: self.servo.follow(CYCLE_S))

    def accelerate(self, speed: float, seconds: float = 0.4) -> None:
        """Give set points from rest to `speed` [rad/s of the axis]."""
        steps = round(seconds / CYCLE_S)
        for k in range(steps):
            self.follow(CYCLE_S, speed * (k + 1) / steps)

    def enable(self) -> None:
        """Until the brake has opened."""
        self.follow(0.2)

    def brake(self, seconds: float) -> None:
        for _ in range(round(seconds / CYCLE_S)):
            self.step(lambda: self.servo.brake(CYCLE_S, QUICK_STOP))

    def rest(self, seconds: float) -> None:
        for _ in range(round(seconds / CYCLE_S)):
            self.step(lambda: self.servo.rest(CYCLE_S, QUICK_STOP))

    def step(self, act: Callable[[], None]) -> None:
        act()
        self.codes += self.servo.trips()
