"""Robots without a closed form: any open chain of joints, its inverse by iteration.

In goes the chain of a URDF; out comes a `Model` that finds solutions from several starts, or follows a path from pose
to pose. It promises no completeness, and knows nothing of families and their lengths.
"""
