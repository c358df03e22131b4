"""What an agent sends to its gateway: a piece of motion that ends at rest."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cell.messages.state import Urgency, state

MOST_EVENTS = 100
"""In one block."""


@dataclass(frozen=True, slots=True)
class OutputEvent:
    """A digital output that switches where the motion passes a place."""

    tick: int
    """Of the sample at that place."""
    number: int
    """Counts the events of one owner from 1, in the order of their ticks. Blocks repeat an event until its tick is
    played; it is executed once."""
    output: int
    """Place of the output in `ClaimGrant.outputs`."""
    value: bool


@state("robot/{robot}/setpoints", Urgency.REAL_TIME)
@dataclass(frozen=True, slots=True, eq=False)
class SetpointBlock:
    """Samples for consecutive ticks of the gateway, the braking ramp to rest included (rule of motion 1).

    Sample `i` is for tick `first_tick + i`. The first `nominal` samples follow the plan, the rest is the ramp; the last
    sample has zero velocity and is held when the block is played out.
    """

    robot: str
    owner: int
    """Number of the claim under which the block is sent; see `ClaimGrant`."""
    sequence: int
    """Counts the blocks of one owner from 1."""
    follows: int
    """Sequence of the block this one was computed from; 0 when computed from the gateway's commanded position."""
    first_tick: int
    dt_s: float
    nominal: int
    position: NDArray[np.float64]
    """`(m, n)` [rad or m] axis positions, in the axis order of the claim."""
    velocity: NDArray[np.float64]
    """`(m, n)` [rad/s or m/s], for feed-forward."""
    torque: NDArray[np.float64] | None = None
    """`(m, n)` [Nm or N] what each axis' motor gives behind its gear, for feed-forward; the last sample is what carries
    the robot at rest. None: the agent does not know it, or nobody asked (`ClaimGrant.torques`)."""
    events: tuple[OutputEvent, ...] = ()
    """Up to 100; numbers grow, ticks do not fall. Each is at a nominal sample: a ramp switches nothing."""
    program: bool = False
    """A program runs: it and nobody else switches the robot's outputs."""
    epoch: int = 0
    """The highest of a manager that the agent knows of; the gateway tells it whoever claims the robot next."""
