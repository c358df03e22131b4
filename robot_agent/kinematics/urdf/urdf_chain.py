"""A URDF as a chain of joints."""

from collections.abc import Iterator
from dataclasses import dataclass

from cell.geometry.arrays import Array
from robot_agent.kinematics.chain import Chain
from robot_agent.model.description import LinkMass, RobotDescription

RANGE_TOLERANCE = 1e-4
"""Degrees of a robot file against rounded radians of a URDF [rad or m]."""


@dataclass(frozen=True, slots=True, eq=False)
class UrdfChain:
    """The joints from the root of a URDF to its flange."""

    chain: Chain
    link_frames: Array
    """`(n + 1, 4, 4)`: poses of the links in the frames of the chain; the last one is the flange."""
    joint_names: tuple[str, ...]
    link_names: tuple[str, ...]
    linear: tuple[bool, ...]
    position: Array
    """`(n, 2)` [rad or m]; a joint that turns without end has a turn to either side."""
    endless: tuple[bool, ...]
    velocity: Array
    """`(n,)` [rad/s or m/s]."""
    masses: tuple[LinkMass, ...]
    """Of the links that have some."""

    def contains(self, joint: int, lower: float, upper: float) -> bool:
        """Whether the URDF lets a joint move from `lower` to `upper` [rad or m]."""
        least, most = self.position[joint]
        return self.endless[joint] or bool(least - RANGE_TOLERANCE <= lower and upper <= most + RANGE_TOLERANCE)


def urdf_problems(description: RobotDescription, chain: UrdfChain) -> Iterator[str]:
    """The joints of a robot file against those of the URDF that it names."""
    count, names = len(description.joint_names), chain.joint_names
    if count != len(names):
        yield f"found {count} joints, the URDF has {len(names)}: {', '.join(names)}"
        return
    slides = description.linear or (False,) * count
    for i, (joint, name) in enumerate(zip(description.joint_names, names, strict=True)):
        if slides[i] != chain.linear[i]:
            yield f"joint {joint} is {_kind(slides[i])}, in the URDF {name} is {_kind(chain.linear[i])}"
        elif not chain.contains(i, *description.limits.position[i]):
            yield f"the range of joint {joint} is larger than that of {name} in the URDF"


def _kind(linear: bool) -> str:
    return "linear" if linear else "rotary"
