"""From a robot's motion to the torques of its axes. SI units."""

from robot_agent.dynamics.axis_torques import GRAVITY_M_S2, AxisTorques, axis_torques

__all__ = ["GRAVITY_M_S2", "AxisTorques", "axis_torques"]
