"""One robot: its model, kinematics, paths, trajectories, programs and the agent process."""

from robot_agent import kinematics

__all__ = ["kinematics"]
"""Whoever reads a robot file knows every family (`robot_agent.model.families`)."""
