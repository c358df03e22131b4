"""Where set points come from: a path under the governor, a jog, a path with corrections (`docs/motion.md`)."""

from robot_agent.trajectory.sources.path import PathSource
from robot_agent.trajectory.sources.source import JointState, MotionSource, States

__all__ = ["JointState", "MotionSource", "PathSource", "States"]
