"""Playout: what one robot's drives are told, one sample per SYNC, from blocks that each end at rest.

The queue is always a motion to standstill. A block replaces its tail or is dropped whole; when blocks stop coming, the
queue plays to its end and the last sample is held. Rules: docs/architecture.md, section 5.1.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum, auto

import numpy as np
from numpy.typing import NDArray

from cell.messages.drives import PlayoutState
from cell.messages.setpoints import SetpointBlock
from drive_gateway.cia402.units import AxisUnits
from drive_gateway.config.settings import AxisSettings
from drive_gateway.gateway.playout.joining import Before, JoinRule, JoinRules, RefusedBlock
from drive_gateway.gateway.playout.outputs import Outputs

Floats = NDArray[np.float64]

QUIET_S = 0.1
"""So long no block was accepted: the agent's blocks have stopped coming. In order there is one every 20 ms."""


@dataclass(frozen=True, slots=True)
class Accepted:
    """The block is queued."""

    sequence: int


@dataclass(frozen=True, slots=True)
class Ignored:
    """The drives are off or stopping: nothing is played, the block only shows that its sender lives."""


Outcome = Accepted | RefusedBlock | Ignored


class _Mode(Enum):
    FOLLOWING = auto()
    LIVE = auto()
    STOPPING = auto()
    FAULT = auto()


_STATE_OF_MODE = {
    _Mode.FOLLOWING: PlayoutState.FOLLOWING,
    _Mode.STOPPING: PlayoutState.STOPPING,
    _Mode.FAULT: PlayoutState.FAULT,
}
_WHY_NOT = {
    _Mode.FOLLOWING: "its drives are off",
    _Mode.STOPPING: "its drives brake",
    _Mode.FAULT: "it stands in a fault",
}


class Playout:
    """The queue of one robot. `tick` is the tick of the newest sample handed out; only later ones can be changed.

    Args:
        axes: the robot's axes, in the order of its blocks.
        cycle_s: bus cycle [s].
        position: `(n,)` [rad or m] commanded until something else is known.
        tick: tick of that first sample.
        outputs: what events of blocks switch; `None`: the robot has none.
    """

    def __init__(
        self,
        axes: Sequence[AxisSettings],
        cycle_s: float,
        position: Floats,
        tick: int = 0,
        outputs: Outputs | None = None,
    ) -> None:
        self._outputs = outputs or Outputs((), cycle_s)
        self._rules = JoinRules(axes, AxisUnits(axes), cycle_s, len(self._outputs.names))
        self._quiet = round(QUIET_S / cycle_s)
        self._taken_tick = tick
        self._program = False
        self._still: Floats = np.zeros((1, len(axes)))
        self._standing: Floats = self._still
        self._mode = _Mode.FOLLOWING
        self.tick = tick
        self.owner = 0
        self.block = 0
        self.accepted = 0
        self.refused = 0
        self.closing = False
        self._hold(position)

    @property
    def state(self) -> PlayoutState:
        if self._mode is not _Mode.LIVE:
            return _STATE_OF_MODE[self._mode]
        if self.level == 0:
            return PlayoutState.STARVED
        return PlayoutState.RAMP if self.tick >= self._ramp_tick else PlayoutState.PLAYING

    @property
    def live(self) -> bool:
        """Blocks are played."""
        return self._mode is _Mode.LIVE

    @property
    def why_stopped(self) -> str:
        """Why the robot does not do what its agent wants of it with the next sample; empty when it does."""
        if self._mode is not _Mode.LIVE:
            return _WHY_NOT[self._mode]
        tick = self.tick + 1
        if tick >= self._ramp_tick and tick - self._taken_tick > self._quiet:
            return "no more blocks come"
        return self._outputs.barred

    @property
    def programmed(self) -> bool:
        """A program runs, by the newest word of the owner: while it is silent it may still go on with it."""
        return self._mode is _Mode.LIVE and self._program

    @property
    def level(self) -> int:
        """Samples left before the newest block is played out."""
        return max(0, self._first + len(self._position) - 1 - self.tick)

    @property
    def at_rest(self) -> bool:
        """The command stands still, and nothing that is queued moves it."""
        return self.tick >= self._rest_tick

    @property
    def position(self) -> Floats:
        """`(n,)` [rad or m] the newest sample handed out."""
        sample: Floats = self._position[self._row(self.tick)]
        return sample

    @property
    def torque(self) -> Floats:
        """`(n,)` [Nm or N] of the newest sample handed out; where nothing moves it is what carries the robot."""
        sample: Floats = self._torque[self._row(self.tick)]
        return sample

    def own(self, owner: int) -> None:
        """From now on blocks are taken from this owner only (0: nobody)."""
        self.owner = owner
        self.block = 0
        self._program = False
        self._outputs.begin()

    def follow(self, position: Floats) -> None:
        """The drives are off: command what was measured, `(n,)` [rad or m]."""
        self._mode = _Mode.FOLLOWING
        self._hold(position)

    def go_live(self) -> None:
        """The drives hold the position commanded last; blocks are played from here."""
        self._hold(self.position)
        self._program = False
        self._mode = _Mode.LIVE

    def stop(self) -> None:
        """The drives brake by themselves; what is queued is forgotten."""
        self._hold(self.position)
        self._mode = _Mode.STOPPING

    def fail(self) -> None:
        """The robot stands after a fault."""
        self._hold(self.position)
        self._mode = _Mode.FAULT

    def offer(self, block: SetpointBlock) -> Outcome:
        """Queue a block whole or drop it whole; what was queued then plays on.

        With the drives off only the torque at its end is taken, which carries the robot once they are on.
        """
        if self._mode is not _Mode.LIVE:
            own = self._owned(block) and self._rules.form_problem(block) is None
            if own and block.torque is not None:
                self._standing = block.torque[-1:]
            return Ignored()
        problem = self._address_problem(block) or self._rules.form_problem(block)
        if problem is None:
            problem = self._rules.join_problem(block, self._before(block.first_tick))
        if problem is not None:
            self.refused += 1
            return problem
        self._splice(block)
        return Accepted(block.sequence)

    def advance(self) -> tuple[Floats, Floats]:
        """The sample of the next tick: position and velocity, each `(n,)`. Never skips, never repeats a moving one.

        The outputs follow: they are as they must be at that sample.
        """
        why = self.why_stopped
        self.tick += 1
        if why:
            self._outputs.stop(why)
        else:
            self._outputs.play(self.tick)
        row = self._row(self.tick)
        return self._position[row], self._velocity[row]

    def _address_problem(self, block: SetpointBlock) -> RefusedBlock | None:
        if self.closing:
            return RefusedBlock(JoinRule.CLOSING, "the gateway is being stopped")
        if not self._owned(block):
            present = f"the present owner is {self.owner}" if self.owner else "nobody owns the robot"
            return RefusedBlock(JoinRule.OWNER, f"owner {block.owner}; {present}")
        if block.sequence <= self.block:
            return RefusedBlock(
                JoinRule.SEQUENCE, f"sequence {block.sequence}; block {self.block} was already accepted"
            )
        if block.first_tick <= self.tick:
            return RefusedBlock(JoinRule.LATE, f"first tick {block.first_tick}; tick {self.tick} was already sent")
        if block.first_tick > self.tick + self._rules.longest:
            return RefusedBlock(JoinRule.FAR, f"first tick {block.first_tick}; tick {self.tick} is far before it")
        return None

    def _owned(self, block: SetpointBlock) -> bool:
        """It comes from the present owner; where there is none, from nobody, whatever it says."""
        return self.owner != 0 and block.owner == self.owner

    def _row(self, tick: int) -> int:
        """Row of a tick; the last one is held, and before the first the robot stood there."""
        return min(max(tick - self._first, 0), len(self._position) - 1)

    def _before(self, tick: int) -> Before:
        rows = [self._row(tick - 2), self._row(tick - 1), self._row(tick)]
        at = (self._position[rows[0]], self._position[rows[1]], self._position[rows[2]])
        return Before(at, self._velocity[rows[2]])

    def _hold(self, position: Floats) -> None:
        self._position: Floats = position[None]
        self._velocity: Floats = self._still
        self._torque: Floats = self._standing
        self._first = self.tick
        self._ramp_tick = self.tick
        self._rest_tick = self.tick

    def _splice(self, block: SetpointBlock) -> None:
        # The next splice looks back two ticks from the one after `tick`, so the sample before `tick` is kept.
        kept = [self._row(tick) for tick in range(self.tick - 1, block.first_tick)]
        self._position = np.concatenate([self._position[kept], block.position])
        self._velocity = np.concatenate([self._velocity[kept], block.velocity])
        self._velocity[-1] = 0.0
        torque = np.zeros_like(block.position) if block.torque is None else block.torque
        self._torque = np.concatenate([self._torque[kept], torque])
        self._standing = self._torque[-1:]
        self._first = self.tick - 1
        self._ramp_tick = block.first_tick + block.nominal
        moving = np.flatnonzero((self._position[1:] != self._position[:-1]).any(axis=1))
        self._rest_tick = self._first + int(moving[-1]) + 1 if moving.size else self.tick
        self.block = block.sequence
        self.accepted += 1
        self._taken_tick = self.tick
        self._program = block.program
        self._outputs.take(block)
