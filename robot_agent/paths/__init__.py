"""Geometry of programmed moves. The path parameter runs from 0 to 1 and is not time."""

from robot_agent.paths.joint_move import JointMove
from robot_agent.paths.line import Line, LineGeometry
from robot_agent.paths.sequence import Block, Sequence

__all__ = ["Block", "JointMove", "Line", "LineGeometry", "Sequence"]
