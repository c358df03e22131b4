"""Geometry of programmed moves. The path parameter is not time.

In go moves with their targets, as poses or joints, and where the robot begins; out come curves of the TCP with the
orientation along them, how moves meet, and what makes no path. It must not know a robot: no kinematics, no limits of
joints, no timing; what a move says of speeds it carries along.
"""

from robot_agent.paths.arc import Arc
from robot_agent.paths.errors import PathError
from robot_agent.paths.joint_move import JointMove
from robot_agent.paths.line import Line, LineGeometry
from robot_agent.paths.sequence import Move, Sequence
from robot_agent.paths.spline import Spline
from robot_agent.paths.transition import Continuity, Passing, Transition

__all__ = [
    "Arc",
    "Continuity",
    "JointMove",
    "Line",
    "LineGeometry",
    "Move",
    "Passing",
    "PathError",
    "Sequence",
    "Spline",
    "Transition",
]
