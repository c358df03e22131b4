"""From a robot's motion to the torques of its axes. SI units."""

from robot_agent.dynamics.axis_torques import AxisTorques, axis_torques
from robot_agent.dynamics.rigid_body import GRAVITY_M_S2, RigidBody

__all__ = ["GRAVITY_M_S2", "AxisTorques", "RigidBody", "axis_torques"]
