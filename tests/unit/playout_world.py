"""An agent against the gateway's own playout, over a network of which a test says when each message arrives."""

from collections.abc import Callable

import numpy as np

from cell.messages import AxisStatus, DriveFeedback, OutputEvent, SetpointBlock
from drive_gateway.config.settings import OutputSettings
from drive_gateway.gateway.playout.outputs import Outputs
from drive_gateway.gateway.playout.playout import Accepted, Playout
from tests.unit.agent_world import CYCLE_S, STEP_S, AgentWorld
from tests.unit.gateway_world import axis

STEP_TICKS = round(STEP_S / CYCLE_S)
OWNER = 7


class _Recorded(Outputs):
    """Outputs that tell what they execute: the output's place and its new value."""

    def __init__(self, names: tuple[str, ...], executed: Callable[[int, bool], None]) -> None:
        super().__init__([OutputSettings(name, "J6", bit, keep=True) for bit, name in enumerate(names)], CYCLE_S)
        self._executed = executed

    def _set(self, place: int, on: bool) -> None:
        super()._set(place, on)
        self._executed(place, on)


class PlayoutWorld(AgentWorld):
    """Feedback is `feedback_ticks` old when the agent steps; the copies of each block are on their way for `delays`.

    With delay 0 a block arrives in the cycle after the step in which it was sent; no delay at all is a lost block.
    """

    def __init__(self, program: str, outputs: tuple[str, ...] = ()) -> None:
        super().__init__(program)
        self.outputs = outputs
        self.feedback_ticks = STEP_TICKS
        self.delays: Callable[[SetpointBlock], list[int]] = lambda _: [0]
        self.gateway_outputs = _Recorded(outputs, self._executed)
        names = self.planner.model.joint_names
        axes = [axis(name, place, speed=10.0, acceleration=1000.0) for place, name in enumerate(names, start=1)]
        self.playout = Playout(axes, CYCLE_S, self.commanded, self.tick, self.gateway_outputs)
        self.playout.own(OWNER)
        self._under_way: list[tuple[int, SetpointBlock]] = []
        self._told = [self._present()]

    def _executed(self, place: int, on: bool) -> None:
        tick = self.playout.tick
        self.switched.append((tick, OutputEvent(tick, len(self.switched) + 1, place, on)))

    def _play(self) -> None:
        if self.enabled and not self.playout.live:
            self.playout.go_live()
        elif not self.enabled:
            self.playout.follow(self.commanded)
        arrived = [each for each in self._under_way if each[0] <= self.playout.tick]
        self._under_way = [each for each in self._under_way if each[0] > self.playout.tick]
        for _, block in arrived:
            if isinstance(self.playout.offer(block), Accepted):
                self.block = block
        self.commanded, _ = self.playout.advance()
        self.tick = self.playout.tick
        self.played.append(self.commanded)
        self._told.append(self._present())

    def _offer(self, block: SetpointBlock) -> None:
        self.blocks.append(block)
        self._under_way += [(self.playout.tick + delay, block) for delay in self.delays(block)]

    def _feedback(self) -> DriveFeedback:
        self._sequence += 1
        return self._told[max(-1 - self.feedback_ticks, -len(self._told))]

    def _present(self) -> DriveFeedback:
        playout, still = self.playout, np.zeros_like(self.commanded)
        status = AxisStatus.OPERATION_ENABLED if playout.live else AxisStatus.SWITCH_ON_DISABLED
        return DriveFeedback(
            "left", "gateway", playout.tick, playout.tick, OWNER, playout.block, playout.state, playout.level,
            playout.refused, True, playout.live, self.commanded, still, self.commanded, (status,) * len(still),
            outputs=self.gateway_outputs.on, event=self.gateway_outputs.played,
        )  # fmt: skip
