"""What a gateway makes of the news of its bus."""

from collections.abc import Collection

from drive_gateway.config.bus_load import bus_load
from drive_gateway.config.image import images_of
from drive_gateway.config.settings import GatewaySettings
from drive_gateway.gateway.bus.bus_news import (
    BusBack,
    BusDisturbed,
    BusFailed,
    BusNews,
    BusTraffic,
    SecondMaster,
    name_of,
    remedy_of,
)
from drive_gateway.gateway.cycle.measured_load import MeasuredLoad
from drive_gateway.gateway.event_log import EventLog
from drive_gateway.gateway.nodes.node import Node
from drive_gateway.gateway.robots.robot import Robot
from drive_gateway.gateway.trouble import SECOND_MASTER, Trouble


class BusWatch:
    """A bus that fails stops its robots at once; the drives stop by themselves, because they miss the gateway.

    When it is back, nodes that could not be reached are tried again without the wait for their boot-up.
    """

    def __init__(
        self, settings: GatewaySettings, robots: Collection[Robot], nodes: Collection[Node], log: EventLog
    ) -> None:
        self._bus = settings.bus
        self._robots = robots
        self._nodes = nodes
        self._log = log
        planned = bus_load(images_of(settings), settings.bus.bitrate, settings.cycle_s, settings.heartbeat_producer_s)
        self.planned = planned.cyclic
        """Share of the wire that what is configured takes."""
        self.load = MeasuredLoad(planned, settings.bus.bitrate, lambda: all(node.operational for node in nodes), log)
        self.problem = ""
        """Why nothing goes over the bus, for people; empty when it works."""

    def take(self, news: BusNews | BusTraffic, now: float) -> None:
        """The shell has found something on the bus."""
        match news:
            case BusTraffic(bits):
                self.load.counted(bits, now)
            case BusFailed(text):
                self._failed(text, now)
            case BusDisturbed(text):
                remedy = "check wiring, termination, bit rate and txqueuelen"
                self._log.warn("bus_disturbed", f"{name_of(self._bus)}: {text}", remedy)
            case SecondMaster(text):
                self._commanded_by_two(text, now)
            case BusBack():
                self.problem = ""
                self._log.info("bus_back", f"{name_of(self._bus)} works again")
                for node in self._nodes:
                    if not node.operational and not node.lost:
                        node.bring_up_again(now)

    def _commanded_by_two(self, text: str, now: float) -> None:
        """Nobody knows what drives do that two masters command: whatever has torque is stopped."""
        found, remedy = f"{name_of(self._bus)}: {text}", "look for a second master on the bus and take it off"
        trouble = Trouble(SECOND_MASTER, found, remedy)
        groups = [robot.group for robot in self._robots]
        moving = [group for group in groups if group.power.stoppable or group.setup.motion is not None]
        for group in moving:
            group.fault(trouble, now)
        if not moving:
            self._log.warn_repeated(trouble.code, trouble.text, trouble.remedy, "bus", now)

    def _failed(self, text: str, now: float) -> None:
        trouble = Trouble("bus_failed", f"{name_of(self._bus)} failed: {text}", remedy_of(self._bus))
        self.problem = f"{trouble.text}; {trouble.remedy}"
        running = [robot for robot in self._robots if robot.group.operational]
        for robot in running:
            robot.group.fault(trouble, now)
        if not running:
            self._log.warn(trouble.code, trouble.text, trouble.remedy)
