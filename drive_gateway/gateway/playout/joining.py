"""The rules by which a set-point block may join what is queued (docs/architecture.md, section 5.1).

A block that passes begins with the queued position and velocity of its first tick, changes its velocity nowhere, the
place where it joins included, by more than the axis' acceleration allows, and ends at rest. The differences are taken
over the spliced series, so no later sample can break what was checked here. Velocities must be those of the positions,
because drives may be fed with them.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from cell.messages.setpoints import MOST_EVENTS, SetpointBlock
from drive_gateway.cia402.units import AxisUnits
from drive_gateway.config.settings import AxisSettings

Floats = NDArray[np.float64]

POSITION_TOLERANCE = 1e-7
"""[rad or m] between the first sample of a block and the queued sample of the same tick."""
VELOCITY_TOLERANCE = 1e-5
"""[rad/s or m/s] the same for velocities, and at the end of a block."""
RELATIVE_TOLERANCE = 0.01
"""Share by which finite differences may pass a limit."""
LONGEST_S = 10.0
"""A block and its lead are shorter than this, which bounds the time of a check; the longest ramp of a cell is 5 s."""


class JoinRule(Enum):
    """The rule that a block broke."""

    OWNER = "owner"
    SEQUENCE = "sequence"
    LATE = "late"
    FAR = "far"
    SHAPE = "shape"
    CYCLE = "cycle"
    VALUES = "values"
    RANGE = "range"
    POSITION = "position"
    VELOCITY = "velocity"
    SPEED = "speed"
    TORQUE = "torque"
    ACCELERATION = "acceleration"
    END = "end"
    EVENTS = "events"
    CLOSING = "closing"


@dataclass(frozen=True, slots=True)
class RefusedBlock:
    """A dropped block: the rule and, for people, what was found and what is allowed."""

    reason: JoinRule
    text: str


@dataclass(frozen=True, slots=True)
class Before:
    """The queue around a block's first tick: the two samples before it and the sample of that tick, each `(n,)`."""

    positions: tuple[Floats, Floats, Floats]
    velocity: Floats


class JoinRules:
    """The checks for one group of axes; `problem` is pure and keeps nothing."""

    def __init__(self, axes: Sequence[AxisSettings], units: AxisUnits, cycle_s: float, outputs: int = 0) -> None:
        """`outputs`: how many digital outputs the robot has."""
        self._outputs = outputs
        self._names = tuple(axis.name for axis in axes)
        self._units = units
        self._cycle_s = cycle_s
        self._speed: Floats = np.array([axis.speed for axis in axes])
        self._acceleration: Floats = np.array([axis.acceleration for axis in axes])
        slack = 2.0 * POSITION_TOLERANCE / cycle_s
        self._speed_bound = self._speed * (1.0 + RELATIVE_TOLERANCE) + slack
        self._acceleration_bound = self._acceleration * (1.0 + RELATIVE_TOLERANCE) + slack / cycle_s
        # Within its acceleration an axis is half of this beside the mean of the two steps around a sample.
        self._beside_bound = self._acceleration_bound * cycle_s
        self.longest = round(LONGEST_S / cycle_s)

    def form_problem(self, block: SetpointBlock) -> RefusedBlock | None:
        """What is wrong with the block by itself: shape, cycle, values, range, events."""
        shape = block.position.shape
        if len(shape) != 2 or shape[1] != len(self._names) or block.velocity.shape != shape:
            found = f"position {shape}, velocity {block.velocity.shape}"
            return RefusedBlock(JoinRule.SHAPE, f"{found}; allowed is (m, {len(self._names)}) for both")
        if not 1 <= shape[0] <= self.longest or not 0 <= block.nominal <= shape[0]:
            found = f"{shape[0]} samples, {block.nominal} of them nominal"
            return RefusedBlock(
                JoinRule.SHAPE, f"{found}; allowed are 1 to {self.longest}, nominal not more than there are"
            )
        if not abs(block.dt_s - self._cycle_s) <= 1e-9:
            return RefusedBlock(JoinRule.CYCLE, f"samples every {block.dt_s} s; the bus cycle is {self._cycle_s} s")
        if not (np.isfinite(block.position).all() and np.isfinite(block.velocity).all()):
            return RefusedBlock(JoinRule.VALUES, "a sample is not a finite number")
        if block.torque is not None and (problem := self._torque_problem(block.torque, shape)):
            return problem
        outside = (block.position < self._units.lowest) | (block.position > self._units.highest)
        if outside.any():
            return RefusedBlock(
                JoinRule.RANGE, self._at(outside, "has a position beyond its limits, or beyond the drive's counts")
            )
        return self._event_problem(block) if block.events else None

    def _event_problem(self, block: SetpointBlock) -> RefusedBlock | None:
        if len(block.events) > MOST_EVENTS:
            return RefusedBlock(JoinRule.EVENTS, f"{len(block.events)} events; allowed are {MOST_EVENTS}")
        end = block.first_tick + block.nominal
        tick, number = block.first_tick, 0
        for event in block.events:
            found = f"event {event.number} at tick {event.tick}"
            if not 0 <= event.output < self._outputs:
                return RefusedBlock(JoinRule.EVENTS, f"{found} is for output {event.output}; there are {self._outputs}")
            if not block.first_tick <= event.tick < end:
                allowed = f"allowed is a nominal sample, {block.first_tick} to {end - 1}"
                return RefusedBlock(JoinRule.EVENTS, f"{found}; {allowed}")
            if event.tick < tick or event.number <= number:
                return RefusedBlock(
                    JoinRule.EVENTS, f"{found} after event {number} at tick {tick}; numbers grow with ticks"
                )
            tick, number = event.tick, event.number
        return None

    def _torque_problem(self, torque: Floats, shape: tuple[int, ...]) -> RefusedBlock | None:
        if torque.shape != shape:
            return RefusedBlock(JoinRule.SHAPE, f"torque {torque.shape}; allowed is that of the positions, {shape}")
        # Not a number is not within a bound either.
        beyond = ~(np.abs(torque) <= self._units.most_torque)
        if not beyond.any():
            return None
        axis = int(beyond.any(axis=0).argmax())
        text = f"has a torque beyond {self._units.most_torque[axis]:.4g} Nm or N, what its drive can be told"
        return RefusedBlock(JoinRule.TORQUE, self._at(beyond, text))

    def join_problem(self, block: SetpointBlock, before: Before) -> RefusedBlock | None:
        """What is wrong with the block as the continuation of the queue."""
        gap = np.abs(block.position[0] - before.positions[2])
        if (gap > POSITION_TOLERANCE).any():
            text = f"starts {gap.max():.3g} beside the queued sample, allowed {POSITION_TOLERANCE}"
            return RefusedBlock(JoinRule.POSITION, self._at(gap[None] > POSITION_TOLERANCE, text))
        gap = np.abs(block.velocity[0] - before.velocity)
        if (gap > VELOCITY_TOLERANCE).any():
            text = f"starts with a velocity {gap.max():.3g} beside the queued one, allowed {VELOCITY_TOLERANCE}"
            return RefusedBlock(JoinRule.VELOCITY, self._at(gap[None] > VELOCITY_TOLERANCE, text))
        if (np.abs(block.velocity[-1]) > VELOCITY_TOLERANCE).any():
            return RefusedBlock(JoinRule.END, "the last sample has a velocity; a block ends at rest")
        end = block.position[-1:]
        series = np.concatenate([before.positions[0][None], before.positions[1][None], block.position, end])
        return self._limit_problem(block, series)

    def _limit_problem(self, block: SetpointBlock, series: Floats) -> RefusedBlock | None:
        step = (series[1:] - series[:-1]) / self._cycle_s
        fast = np.abs(step) > self._speed_bound
        fast[1:-1] |= np.abs(block.velocity) > self._speed_bound
        if fast.any():
            axis = int(fast.any(axis=0).argmax())
            found = max(np.abs(step[:, axis]).max(), np.abs(block.velocity[:, axis]).max())
            return RefusedBlock(
                JoinRule.SPEED, self._at(fast, f"reaches {found:.4g}/s, allowed {self._speed[axis]:.4g}")
            )
        change = np.abs(step[1:] - step[:-1]) / self._cycle_s
        hard = change > self._acceleration_bound
        if not hard.any():
            return self._foreign_velocities(block, step)
        axis = int(hard.any(axis=0).argmax())
        sample = int(hard[:, axis].argmax())
        text = f"accelerates with {change[sample, axis]:.4g}/s^2, allowed {self._acceleration[axis]:.4g}"
        if sample == len(change) - 1:
            return RefusedBlock(JoinRule.END, self._at(hard, f"{text}: the block does not end at rest"))
        return RefusedBlock(JoinRule.ACCELERATION, self._at(hard, f"{text}, at tick {block.first_tick + sample - 1}"))

    def _foreign_velocities(self, block: SetpointBlock, step: Floats) -> RefusedBlock | None:
        """`step`: mean velocity from each sample to the next, from the two before the block to the one after it."""
        beside = np.abs(block.velocity - 0.5 * (step[1:-1] + step[2:])) > self._beside_bound
        if not beside.any():
            return None
        return RefusedBlock(JoinRule.VALUES, self._at(beside, "has velocities that are not those of its positions"))

    def _at(self, found: NDArray[np.bool_], text: str) -> str:
        return f"axis {self._names[int(found.any(axis=0).argmax())]} {text}"
