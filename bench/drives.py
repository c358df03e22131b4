"""Simulated drives: how much of one core they need to keep up with the clock."""

import struct
import time
from dataclasses import replace
from pathlib import Path

from bench.timing import Row
from drive_gateway.canopen.cob_id import RPDO1, SDO_TO_NODE, SYNC
from drive_gateway.canopen.frame import CanFrame
from drive_gateway.cia402.preparation import preparations, supervision
from drive_gateway.config import GatewaySettings, load_drives
from drive_gateway.config.image import image_of
from drive_gateway.sim.bus import SimulatedBus
from drive_gateway.sim.config.load import load_simulation
from drive_gateway.sim.config.simulation import Level, Simulation
from drive_gateway.sim.drives.power_state import DriveState
from drive_gateway.sim.shell import simulated_nodes

CELL = Path(__file__).parents[1] / "cell_configs" / "two_arms"
SIDES = ("left", "right")
SECONDS = 2.0
"""Of the simulated axes' time."""
SPEED = 0.5
"""[rad/s] of every axis."""


class Drives:
    """All drives of one bus, enabled and in motion, on virtual time."""

    def __init__(self, settings: GatewaySettings, simulation: Simulation) -> None:
        self._settings = settings
        self._axes = [axis for robot in settings.robots.values() for axis in robot.axes]
        nodes = simulated_nodes(settings, simulation)
        self._bus = SimulatedBus(nodes, settings.bus.bitrate if simulation.wire_time else None)
        self._now = 0.0
        for _ in range(20):
            self._pass(0.005)
        for axis in self._axes:
            linked = [write for pdo in image_of(axis).pdos for write in pdo.writes()]
            prepared = [*supervision(axis, settings), *preparations(axis, settings)]
            for write in [*(item.write for item in prepared), *linked]:
                head = struct.pack("<BHB", 0x23 | (4 - len(write.data)) << 2, write.index, write.sub)
                self._bus.receive(CanFrame(SDO_TO_NODE + axis.node_id, head + write.data.ljust(4, b"\0")), self._now)
                self._pass(0.001)
        self._bus.receive(CanFrame(0, b"\x01\0"), self._now)
        self._targets = [node.position for node in nodes]
        for word in (0, 0, 6, 6, 7, 7, *[0x0F] * 60):
            self.cycle(word, 0.0)
        if any(node.state is not DriveState.OPERATION_ENABLED for node in nodes):
            raise RuntimeError("a simulated drive did not enable")

    def cycle(self, word: int, speed: float) -> None:
        """One bus cycle: SYNC, the answers, all set points."""
        self._pass(self._settings.cycle_s)
        self._bus.receive(CanFrame(SYNC, b""), self._now)
        for number, axis in enumerate(self._axes):
            self._targets[number] += speed * axis.counts_per_unit * self._settings.cycle_s
            data = struct.pack("<Hi", word, round(self._targets[number]))
            self._bus.receive(CanFrame(RPDO1 + axis.node_id, data), self._now)

    def _pass(self, seconds: float) -> None:
        self._now += seconds
        self._bus.step(self._now)


def simulated_drives() -> list[Row]:
    """Both levels for the twelve axes of the example cell, wire time included."""
    return [_level(level) for level in Level]


def _level(level: Level) -> Row:
    buses = []
    for side in SIDES:
        file = CELL / f"{side}_drives.yaml"
        buses.append(Drives(load_drives(file, f"{side}_bus"), replace(load_simulation(file), level=level)))
    cycles = round(SECONDS / 0.004)
    start = time.process_time()
    for number in range(cycles):
        for bus in buses:
            bus.cycle(0x0F, SPEED * min(1.0, number / 100))
    used = time.process_time() - start
    slower = "" if used < SECONDS else " (slower than real time)"
    return Row(
        f"12 simulated axes, {level.value} level, per cycle", used / cycles, used / SECONDS, f"of a core{slower}"
    )
