"""All simulated nodes of one bus and the wire between them and their master."""

from collections.abc import Sequence

from drive_gateway.canopen.frame import CanFrame
from drive_gateway.sim.nodes.node import NodeServices
from drive_gateway.sim.wire import Wire

IN_STEP_S = 0.005
"""The axes of a bus that share a supply or a load are never farther apart in time than this."""


class SimulatedBus:
    """Carries frames between the master and the nodes; what it returns is on the way to the master.

    Args:
        nodes: all nodes of the bus.
        bitrate: of the wire [bit/s]; `None`: frames arrive at once.
        apart_s: how far apart in time its axes may be; they may be so only where they share nothing.
    """

    def __init__(self, nodes: Sequence[NodeServices], bitrate: int | None, apart_s: float = IN_STEP_S) -> None:
        self.nodes = nodes
        self._apart_s = apart_s
        self._moved: float | None = None
        self.wire = None if bitrate is None else Wire(bitrate)

    @property
    def next_at(self) -> float | None:
        """When the next frame arrives; `None` when nothing is on its way."""
        return None if self.wire is None else self.wire.next_at

    def receive(self, frame: CanFrame, now: float) -> list[CanFrame]:
        """The master sends a frame."""
        self._keep_in_step(now)
        if self.wire is None:
            hearing = [node for node in self.nodes if frame.id in node.handlers]
            return [answer for node in hearing for answer in node.receive(frame, now)]
        self.wire.send(frame, now, from_master=True)
        return self.carry(now)

    def step(self, now: float) -> list[CanFrame]:
        """Let the nodes' own timers run."""
        self._keep_in_step(now)
        return self._sent([frame for node in self.nodes for frame in node.step(now)], now)

    def timers(self, now: float) -> list[CanFrame]:
        """As `step`, but nodes that hear SYNC stay where their last frame brought them: no axis moves by it."""
        each = (node.timers() if node.hears_sync else node.step(now) for node in self.nodes)
        return self._sent([frame for frames in each for frame in frames], now)

    def _sent(self, frames: list[CanFrame], now: float) -> list[CanFrame]:
        """What the nodes sent is on its way."""
        if self.wire is None:
            return frames
        for frame in frames:
            self.wire.send(frame, now, from_master=False)
        return self.carry(now)

    def carry(self, now: float) -> list[CanFrame]:
        """Let the wire carry what it can until `now`."""
        if self.wire is None:
            return []
        arrived: list[CanFrame] = []
        while (delivered := self.wire.take(now)) is not None:
            if not delivered.from_master:
                arrived.append(delivered.frame)
                continue
            self._keep_in_step(delivered.at)
            for node in self.nodes:
                if delivered.frame.id not in node.handlers:
                    continue
                for answer in node.receive(delivered.frame, delivered.at):
                    self.wire.send(answer, delivered.at, from_master=False)
        return arrived

    def _keep_in_step(self, now: float) -> None:
        """After a pause no axis moves through all of it alone: they share a DC bus, or carry one robot."""
        moved = now if self._moved is None else self._moved
        while now - moved > self._apart_s:
            moved += self._apart_s
            for node in self.nodes:
                node.advance(moved)
        self._moved = max(moved, now)
