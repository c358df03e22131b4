"""The robot file: links, limits, home position and body."""

from robot_agent.model.description import (
    NO_TOOL,
    TOOL,
    Apart,
    CapsuleBody,
    JointLimits,
    LinkMass,
    Motor,
    Mounted,
    Part,
    PathSpeeds,
    ProfileKind,
    RobotDescription,
    Shaping,
    Tool,
    UrdfSource,
)
from robot_agent.model.families import FAMILIES
from robot_agent.model.load import URDF, load_description

__all__ = [
    "FAMILIES",
    "NO_TOOL",
    "TOOL",
    "URDF",
    "Apart",
    "CapsuleBody",
    "JointLimits",
    "LinkMass",
    "Motor",
    "Mounted",
    "Part",
    "PathSpeeds",
    "ProfileKind",
    "RobotDescription",
    "Shaping",
    "Tool",
    "UrdfSource",
    "load_description",
]
