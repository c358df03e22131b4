"""What an agent tells the manager: where its robot is, where it will be at rest, and what it wants."""

from dataclasses import dataclass, field
from typing import Annotated

from annotated_types import MaxLen

from cell.messages.common import Count, Duration, Few, Heard, Length, Metres, Name, Token, Vector

Capsule = tuple[Metres, Metres, Metres, Metres, Metres, Metres]
"""End points of a capsule's axis in world: ax, ay, az, bx, by, bz [m]."""
MOST_CAPSULES = 50
MOST_POSES = 2000


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
    base: Vector
    reach_m: Length
    radii_m: Annotated[tuple[Length, ...], MaxLen(MOST_CAPSULES)] = ()
    poses: Annotated[tuple[Annotated[tuple[Capsule, ...], MaxLen(MOST_CAPSULES)], ...], MaxLen(MOST_POSES)] = ()
    growth_m: Annotated[tuple[Length, ...], MaxLen(MOST_POSES)] = ()

    def __post_init__(self) -> None:
        """Raises `ValueError` when numbers of radii, capsules, poses and growths do not fit each other."""
        capsules = {len(pose) for pose in self.poses}
        if len(self.growth_m) != len(self.poses):
            raise ValueError(
                f"growth_m has {len(self.growth_m)} numbers for {len(self.poses)} poses, allowed is one each"
            )
        if capsules and capsules != {len(self.radii_m) or -1}:
            found = ", ".join(map(str, sorted(capsules)))
            raise ValueError(
                f"poses of {found} capsules and {len(self.radii_m)} radii_m, allowed is one radius for each capsule "
                "and at least one capsule"
            )


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
    """Zone wanted: seconds until it is needed."""
    estop_acknowledged: Name | None = None
    """Id of the active emergency stop under which this robot is at rest or braking, if any."""
    standing: bool = False
    """At rest and switched off; it stays so while the manager state that `heard` names has another robot in set-up."""
