"""What an agent tells the manager: where its robot is, where it will be at rest, and what it wants."""

from dataclasses import dataclass, field

from cell.messages.common import Heard, Token

Capsule = tuple[float, float, float, float, float, float]
"""End points of a capsule's axis in world: ax, ay, az, bx, by, bz [m]."""


@dataclass(frozen=True, slots=True)
class Body:
    """Everything the robot occupies from the present tick until the newest block is at rest.

    `poses` are configurations of all capsules along the path, the present one first. Pose `i`, with every radius grown
    by `growth_m[i]`, covers everything up to pose `i + 1`, the distance between measured and commanded position
    included. While the robot brakes off its path, the poses after the present one are in no order: together they cover
    everything that it may still come to. An unknown body (`known` false, not referenced or no feedback) counts as the
    robot's whole reach: a sphere of `reach_m` around `base`.
    """

    known: bool
    base: tuple[float, float, float]
    reach_m: float
    radii_m: tuple[float, ...] = ()
    poses: tuple[tuple[Capsule, ...], ...] = ()
    growth_m: tuple[float, ...] = ()


@dataclass(frozen=True, slots=True)
class Presence:
    """One robot's claim to existence, body and zones; repeated, level-triggered, fenced by boot and sequence."""

    robot: str
    boot: str
    sequence: int
    heard: Heard | None
    digest: str
    body: Body
    stop_time_s: float
    """Until all that was sent is at rest and the robot is measured so, at the longest; 0.0 exactly when it stands."""
    holds: dict[str, Token] = field(default_factory=dict)
    wants: dict[str, float] = field(default_factory=dict)
    """Zone wanted: seconds until it is needed."""
    estop_acknowledged: str | None = None
    """Id of the active emergency stop under which this robot is at rest or braking, if any."""
    standing: bool = False
    """At rest and switched off; it stays so while the manager state that `heard` names has another robot in set-up."""
