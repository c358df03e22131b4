"""I/O nodes in the cycle: brought up, supervised, and what becomes of the robots that use one which falls silent."""

from collections.abc import Collection, Iterator

from cell.core import Effect
from drive_gateway.gateway.drives.power import PowerState
from drive_gateway.gateway.effects import Frame
from drive_gateway.gateway.event_log import EventLog
from drive_gateway.gateway.io.io_node import IoNode
from drive_gateway.gateway.robots.group import DriveGroup
from drive_gateway.gateway.robots.robot import Robot
from drive_gateway.gateway.trouble import Trouble
from drive_gateway.gateway.watch.watch import attend


class IoWatch:
    """A robot that names an input or output of a node stops when that is lost, unless `on_loss` of it is `tell`."""

    def __init__(self, io_nodes: Collection[IoNode], robots: Collection[Robot], log: EventLog) -> None:
        groups = [robot.group for robot in robots]
        self._users = [(io, [group for group in groups if io in group.io_nodes]) for io in io_nodes]
        self._log = log

    def observe(self, now: float, tick: int) -> list[Effect]:
        """After the SYNC numbered `tick`, before the robots: what the nodes need, after the RPDOs."""
        after: list[Effect] = []
        for io, users in self._users:
            after += io.node.step(now, tick - 1)
            for trouble in io.node.check():
                self._troubled(io, users, trouble, now)
            attend(io.node, _idle(io, users), now, self._log)
        return after

    def command(self, now: float) -> Iterator[Effect]:
        """Once all robots have played their sample: the outputs, for the next SYNC."""
        for io, _ in self._users:
            frame = io.due(now)
            if frame is not None:
                yield Frame(frame)

    def _troubled(self, io: IoNode, users: Collection[DriveGroup], trouble: Trouble, now: float) -> None:
        if not io.operational:
            for group in users:
                group.outputs.lost(io.io.name, f"{io.label} was lost")
        if not trouble.stops:
            self._log.warn_repeated("io_warning", trouble.text, trouble.remedy, trouble.text, now)
        elif io.io.stops and users:
            for group in users:
                group.fault(trouble, now)
        else:
            self._log.warn(trouble.code, trouble.text, trouble.remedy)


def _idle(io: IoNode, users: Collection[DriveGroup]) -> bool:
    """Nothing moves that relies on it."""
    return not io.io.stops or all(group.power.state in (PowerState.OFF, PowerState.FAULT) for group in users)
