"""The robot file: links, limits, home position and body.

In goes a robot file; out come its description in SI units, or all problems with line and column, and what it asks of
the axes. It must not know kinematics, which put themselves into its register of families, nor the cell in which a robot
stands; a URDF that the file names is read by `robot_agent.kinematics.urdf`.
"""

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
