"""The families of robots whose inverse is a formula: one file each, and what several of them share.

In goes the description of a robot, its lengths and joints; out comes a `Model` that finds all branches of many poses at
once. A family knows its own geometry only: not the other families, no files, and no iteration. What its robot files say
stands beside its formulas, under `@family`; each family is imported here.
"""

from robot_agent.kinematics.families import cobot, delta, gantry, palletizer, scara, six_axis

__all__ = ["cobot", "delta", "gantry", "palletizer", "scara", "six_axis"]
