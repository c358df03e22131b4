"""The robot file: links, limits, home position and body."""

from robot_agent.model.description import CapsuleBody, Family, JointLimits, PathLimits, RobotDescription
from robot_agent.model.load import load_description

__all__ = ["CapsuleBody", "Family", "JointLimits", "PathLimits", "RobotDescription", "load_description"]
