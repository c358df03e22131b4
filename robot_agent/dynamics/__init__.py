"""From a robot's motion to the torques of its axes. SI units.

In go a model with its masses and motors, gravity, and joints with their speeds and accelerations; out come torques of
the axes, or forces where they slide. It must not know where a motion comes from, nor drives: no paths, no timing, no
rated torques; `rigid_body` alone imports Pinocchio.
"""

from robot_agent.dynamics.axis_torques import GRAVITY_M_S2, AxisTorques, axis_torques

__all__ = ["GRAVITY_M_S2", "AxisTorques", "axis_torques"]
