"""What a URDF file says of a robot.

In goes the file, looked at as text before Pinocchio reads it; out comes a `UrdfChain` with its joints, limits and
masses, or errors with a name; and how its links look (`Visual`). Here nothing is solved: a URDF knows
no inverse and no capsules.
"""
