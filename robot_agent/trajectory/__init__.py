"""From geometry to time: jerk-limited motions and the governor of path time."""

from robot_agent.trajectory.errors import PlanError
from robot_agent.trajectory.governor import Governor, Hold, RateRequest
from robot_agent.trajectory.lengths import lengths
from robot_agent.trajectory.limits import Limits
from robot_agent.trajectory.motion import Motion
from robot_agent.trajectory.moving import Moving
from robot_agent.trajectory.plan import plan
from robot_agent.trajectory.s_curve import SCurve, s_curve
from robot_agent.trajectory.segment import PathState, Segment
from robot_agent.trajectory.splice import spliced
from robot_agent.trajectory.trapezoid import synchronised_trapezoids, trapezoid_in

__all__ = [
    "Governor",
    "Hold",
    "Limits",
    "Motion",
    "Moving",
    "PathState",
    "PlanError",
    "RateRequest",
    "SCurve",
    "Segment",
    "lengths",
    "plan",
    "s_curve",
    "spliced",
    "synchronised_trapezoids",
    "trapezoid_in",
]
