"""The gateway of a virtual run: it plays exactly what it is sent, on no bus. Its drives are always on."""

import math

import numpy as np
from numpy.typing import NDArray

from cell.messages import AxisStatus, ClaimGrant, DriveFeedback, OutputEvent, PlayoutState, SetpointBlock

_ROUNDED = 1e-6
"""Of a cycle: a moment so little before a tick counts as it."""


class LoopedGateway:
    """Of one robot, under one claim; ticks begin with it."""

    def __init__(self, robot: str, grant: ClaimGrant, axes: NDArray[np.float64], outputs: int, now: float) -> None:
        """The robot stands at `axes` `(n,)`, bit i of `outputs` says whether the i-th one is on."""
        self.grant = grant
        self._robot = robot
        self._begun_at = now
        self._axes = axes
        self._blocks: list[SetpointBlock] = []
        """The one that is played, and those that come after it."""
        self._accepted = 0
        self._events: list[OutputEvent] = []
        self._outputs = outputs
        self._executed = 0
        self._sequence = 0

    def take(self, block: SetpointBlock) -> None:
        """Play a block from its first tick on; its events take the place of those that come after its beginning."""
        self._blocks.append(block)
        self._accepted = block.sequence
        self._events = [event for event in self._events if event.tick < block.first_tick] + list(block.events)

    def feedback(self, now: float) -> DriveFeedback:
        """Where the axes are at `now` [s], and what is switched by then."""
        tick = self.grant.tick + 1 + math.floor((now - self._begun_at) / self.grant.cycle_s + _ROUNDED)
        while len(self._blocks) > 1 and self._blocks[1].first_tick <= tick:
            self._blocks.pop(0)
        velocity = np.zeros_like(self._axes)
        if self._blocks and self._blocks[0].first_tick <= tick:
            block = self._blocks[0]
            row = min(tick - block.first_tick, len(block.position) - 1)
            self._axes, velocity = block.position[row], block.velocity[row]
        for event in self._events:
            if event.tick <= tick and event.number > self._executed:
                self._executed, bit = event.number, 1 << event.output
                self._outputs = self._outputs | bit if event.value else self._outputs & ~bit
        self._sequence += 1
        on = (AxisStatus.OPERATION_ENABLED,) * len(self._axes)
        return DriveFeedback(
            self._robot, self.grant.gateway_boot, self._sequence, tick, self.grant.owner, self._accepted,
            PlayoutState.PLAYING, 0, 0, True, True, self._axes, velocity, self._axes, on,
            outputs=self._outputs, event=self._executed,
        )  # fmt: skip

    @property
    def outputs(self) -> dict[str, bool]:
        """By name, whether it would be on."""
        return {name: bool(self._outputs >> index & 1) for index, name in enumerate(self.grant.outputs)}
