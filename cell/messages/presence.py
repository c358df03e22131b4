"""What an agent tells the manager: where its robot is, where it will be at rest, and what it wants."""

from dataclasses import dataclass, field
from typing import Annotated

import numpy as np

from cell.messages.common import Count, Duration, Few, Heard, Length, Name, Token, Vector
from cell.messages.meeting import Meets
from cell.messages.robot_state import Mode
from cell.messages.sections import Single, Way
from cell.messages.state import Urgency, state

MOST_CAPSULES = 50
MOST_POSES = 2000


@dataclass(frozen=True, slots=True, eq=False)
class Body:
    """Everything the robot occupies from the present tick until the newest block is at rest.

    `poses` are configurations of all capsules along the path, the present one first. Pose `i`, with every radius grown
    by `growth_m[i]`, covers everything up to pose `i + 1`, the distance between measured and commanded position
    included. While the robot brakes off its path, the poses after the present one are in no order: together they cover
    everything that it may still come to. An unknown body (`known` false, not referenced or no feedback) counts as the
    robot's whole reach: a sphere of `reach_m` around `base`. A known one has at least one pose.
    """

    known: bool
    base: Vector
    reach_m: Length
    radii_m: Single = field(default_factory=lambda: np.empty(0, np.float32))
    """`(c,)`, up to `MOST_CAPSULES`."""
    poses: Single = field(default_factory=lambda: np.empty((0, 0, 2, 3), np.float32))
    """`(p, c, 2, 3)` [m]: end points of the capsules' axes in world; up to `MOST_POSES`."""
    growth_m: Single = field(default_factory=lambda: np.empty(0, np.float32))
    """`(p,)`."""
    tcp_m: Single = field(default_factory=lambda: np.empty((0, 3), np.float32))
    """`(p, 3)` in world: where the tool centre point is in each pose, without a tool the flange. A ball of radius
    `growth_m[i]` around it covers it up to pose `i + 1`."""


@state("robot/{robot}/presence", Urgency.INTERACTIVE)
@dataclass(frozen=True, slots=True)
class Presence:
    """One robot's claim to existence, body and zones; repeated, level-triggered, fenced by boot and sequence."""

    robot: Name
    boot: Name
    owner: Count
    """The claim under which the agent owns the robot (`ClaimGrant`): it orders the runs of a robot's agents."""
    sequence: Count
    heard: Heard | None
    digest: Name
    body: Body
    stop_time_s: Duration
    """Until all that was sent is at rest and the robot is measured so, at the longest; 0.0 exactly when it stands."""
    holds: Annotated[dict[Name, Token], Few] = field(default_factory=dict)
    wants: Annotated[dict[Name, Duration], Few] = field(default_factory=dict)
    """Zone wanted: seconds until it is needed. Those with the same number are needed together, all or none."""
    estop_acknowledged: Name | None = None
    """Id of the active emergency stop under which this robot is at rest or braking, if any."""
    standing: bool = False
    """At rest and switched off; it stays so while the manager state that `heard` names has another robot in set-up."""
    epoch: Count = 0
    """The highest of a manager that the agent knows of."""
    taken: Count = 0
    """Number of the newest clearance of that manager which was taken (`Clearance`)."""
    way: Way = field(default_factory=Way)
    """What it uses of the cell's space and asks for; empty where the cell does not keep robots apart."""
    mode: Mode | None = None
    """What the agent can do; None: it does not say."""
    meets: Meets = field(default_factory=Meets)
