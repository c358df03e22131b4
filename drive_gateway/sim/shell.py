"""The shell of simulated drives: their connection to the bus and one thread that carries frames and time to them."""

import logging
import threading
import time
from collections.abc import Callable, Mapping
from math import ceil
from types import TracebackType
from typing import Self

import can

from cell.net.runner import Priority, scheduling
from drive_gateway.canopen.frame import CanFrame
from drive_gateway.config.settings import AxisSettings, GatewaySettings
from drive_gateway.gateway.bus.bus_news import BusBack, BusDisturbed, BusFailed, BusNews, SecondMaster, name_of
from drive_gateway.gateway.bus.opening import BusError
from drive_gateway.gateway.bus.steady_bus import SteadyBus
from drive_gateway.sim.axis.dc_bus import DcBus
from drive_gateway.sim.axis.full_servo import FullServo
from drive_gateway.sim.axis.robot_load import RobotLoad, RobotTorques, Shaft
from drive_gateway.sim.bus import SimulatedBus
from drive_gateway.sim.config.simulation import Level, Simulation
from drive_gateway.sim.nodes.io_node import SimulatedIoNode
from drive_gateway.sim.nodes.node import NodeServices, SimulatedNode
from drive_gateway.sim.pace import REMEDY, ComputingTime

_log = logging.getLogger(__name__)

Robots = Mapping[str, RobotTorques]
"""What moves the links of each robot, by its name."""

STEP_S = 0.005
"""Period of the nodes' own timers, and longest wait for a frame."""
_OLDEST_S = 1.0
"""A frame that seems older was stamped by a clock that jumped."""
_GRAIN_S = 0.0005
"""Frames that come through the wire within this time are handed over together; their own times stay exact."""
_CLOSE_TIMEOUT_S = 2.0
_LONGEST_SETPOINT_TIMEOUT = 255


class SimulatedDrives:
    """Context manager: all drives of one bus, on their own python-can bus of the same channel.

    The thread takes the time of a frame from its time stamp, so a host that stalls this thread does not look like a
    master that sends irregularly. What stops the thread is logged and kept in `problem`; `ended` is set then.

    Raises:
        BusError: the bus cannot be opened (on entering).
    """

    def __init__(self, settings: GatewaySettings, simulation: Simulation, robots: Robots | None = None) -> None:
        self._settings = settings.bus
        self.nodes = simulated_nodes(settings, simulation, robots)
        self._carrier = SimulatedBus(self.nodes, settings.bus.bitrate if simulation.wire_time else None)
        self.on_slow: Callable[[str], None] = _say_slow
        """Called by the drives' thread when they do not keep up with the clock."""
        self.problem = ""
        self.ended = threading.Event()
        self._closing = threading.Event()
        self._bus: SteadyBus | None = None
        self._thread: threading.Thread | None = None

    def __enter__(self) -> Self:
        bus = self._bus = SteadyBus(self._settings, self._tell)
        self._thread = threading.Thread(target=self._run, args=(bus,), name="simulated drives", daemon=True)
        self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._closing.set()
        if self._thread is not None:
            self._thread.join(_CLOSE_TIMEOUT_S)
        if self._bus is not None:
            self._bus.close()

    def _run(self, bus: SteadyBus) -> None:
        try:
            # Drives are computers of their own: they must not wait for this one more than their master does.
            with scheduling(Priority.BUS):
                self._serve(bus)
        except Exception as error:
            self.problem = f"simulated drives on {self._settings.interface} {self._settings.channel} stopped: {error!r}"
            _log.exception("%s", self.problem)
        finally:
            self.ended.set()

    def _serve(self, bus: SteadyBus) -> None:
        stepped, pace = 0.0, ComputingTime()
        while not self._closing.is_set():
            message = bus.receive(self._patience(stepped + STEP_S))
            begin = now = time.monotonic()
            if message is not None:
                now -= _age(message)
                if not message.is_extended_id:
                    frame = CanFrame(message.arbitration_id, bytes(message.data), message.is_remote_frame)
                    _send(bus, self._carrier.receive(frame, now))
            if now - stepped >= STEP_S:
                stepped = now
                _send(bus, self._carrier.step(now))
            else:
                _send(bus, self._carrier.carry(now))
            slow = pace.worked(begin, time.monotonic())
            if slow:
                self.on_slow(slow)

    def _tell(self, news: BusNews) -> None:
        """Drives live on without a bus and miss their master; only people need to know why."""
        name = name_of(self._settings)
        match news:
            case BusFailed(text) | BusDisturbed(text) | SecondMaster(text):
                _log.warning("simulated drives: %s: %s", name, text)
            case BusBack():
                _log.warning("simulated drives: %s works again", name)

    def _patience(self, step_at: float) -> float:
        """How long to wait for a frame of the master: until the nodes' timers or one of their own frames are due."""
        arrival = self._carrier.next_at
        due = step_at if arrival is None else min(step_at, arrival)
        return min(max(due - time.monotonic(), _GRAIN_S), STEP_S)


def simulated_nodes(
    settings: GatewaySettings, simulation: Simulation, robots: Robots | None = None
) -> list[NodeServices]:
    """One node per Node-ID, those with drives first; these wait for set points as long as a cycle may be late.

    `robots` put their loads on the axes beside those of the file, at the full level only.
    """
    timeout = min(_LONGEST_SETPOINT_TIMEOUT, max(2, ceil(settings.overrun_limit_s / settings.cycle_s) + 1))
    servos = _full_servos(settings, simulation, robots or {}) if simulation.level is Level.FULL else {}
    by_node: dict[int, list[tuple[str, AxisSettings]]] = {}
    for name, robot in settings.robots.items():
        for axis in robot.axes:
            by_node.setdefault(axis.node_id, []).append((name, axis))
    nodes: list[NodeServices] = []
    for named in by_node.values():
        named.sort(key=lambda pair: pair[1].number)
        behind = [servos.get((name, axis.name)) for name, axis in named]
        axes = [axis for _, axis in named]
        starts = [simulation.start(name, axis) for name, axis in named]
        nodes.append(SimulatedNode(axes, starts, settings.cycle_s, simulation.lag_s, timeout, behind))
    nodes += [SimulatedIoNode(io.node_id, io.input_bytes, io.output_bytes) for io in settings.io_nodes]
    return nodes


def _full_servos(settings: GatewaySettings, simulation: Simulation, robots: Robots) -> dict[tuple[str, str], FullServo]:
    """By robot and axis."""
    bus = DcBus(simulation.dc_bus)
    servos: dict[tuple[str, str], FullServo] = {}
    for name, robot in settings.robots.items():
        shafts = []
        for axis in robot.axes:
            data = simulation.axes[name, axis.name]
            start = (simulation.start(name, axis) - axis.offset) * axis.counts_per_unit
            servo = servos[name, axis.name] = FullServo(data, start, simulation.lag_s, bus)
            way_per_rad = data.counts_per_rad / axis.counts_per_unit
            shafts.append(Shaft(servo.machine.mechanics, way_per_rad, axis.offset))
        if name in robots:
            load = RobotLoad(robots[name], shafts)
            for number, axis in enumerate(robot.axes):
                servos[name, axis.name].machine.robot = load.of(number)
    return servos


def run_simulated_drives(
    settings: GatewaySettings, simulation: Simulation, stop: threading.Event, robots: Robots | None = None
) -> int:
    """Run the drives of a bus alone in this process until `stop` is set; returns the exit code of the command.

    Raises:
        BusError: the bus cannot be opened, or no other process can be on it.
    """
    if settings.bus.interface == "virtual":
        raise BusError(
            settings.bus,
            "it lives inside one process, drives alone on it would meet nobody",
            "start the gateway with --simulate, or choose a bus that processes share: udp_multicast, socketcan (vcan)",
        )
    with SimulatedDrives(settings, simulation, robots) as drives:
        numbers = ", ".join(str(node.node_id) for node in drives.nodes)
        print(f"simulated drives on {settings.bus.interface} {settings.bus.channel}: nodes {numbers}", flush=True)
        while not stop.wait(0.1):
            if drives.ended.is_set():
                return 1
    return 0


def _say_slow(text: str) -> None:
    _log.warning("%s; %s", text, REMEDY)


def _age(message: can.Message) -> float:
    """Seconds for which a frame waited to be read; 0 when its time stamp says nothing."""
    age_s = time.time() - message.timestamp
    return age_s if 0.0 < age_s < _OLDEST_S else 0.0


def _send(bus: SteadyBus, frames: list[CanFrame]) -> None:
    for frame in frames:
        bus.send(can.Message(arbitration_id=frame.id, data=frame.data, is_extended_id=False))
