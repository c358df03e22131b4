"""Poses, rotations and distances: pure numpy, batched over leading dimensions, SI units and radians.

In go arrays of points, poses and lengths; out come poses, solids, distances, or why there are none; for meshes python-
fcl helps. It must not know messages, files or kinematics: a published body is to it capsules that have grown, a zone a
solid.
"""

from cell.geometry.box import Box, capsule_box_distance, point_box_distance
from cell.geometry.convex import Convex, Hull
from cell.geometry.errors import GeometryError, NoFrame, NotAPose, WrongShape
from cell.geometry.frame import frame_from_points, largest_shift, largest_turn, taught_frame
from cell.geometry.measured import MEASURED, Measured, measured_solid
from cell.geometry.mesh import Mesh
from cell.geometry.occupied import OccupiedSpace, SpaceOf, body_touches, capsules_touch
from cell.geometry.pose import (
    check_poses,
    compose,
    from_xyz_abc,
    inverse,
    pose_elements,
    pose_from,
    pose_rows,
    to_xyz_abc,
    transform_points,
)
from cell.geometry.room import Room
from cell.geometry.segment import capsule_distance, segment_distance
from cell.geometry.solid import Cylinder, HalfSpace, PlacedSolid, Solid, Sphere
from cell.geometry.trajectories import Nearest, nearest_capsules

__all__ = [
    "MEASURED",
    "Box",
    "Convex",
    "Cylinder",
    "GeometryError",
    "HalfSpace",
    "Hull",
    "Measured",
    "Mesh",
    "Nearest",
    "NoFrame",
    "NotAPose",
    "OccupiedSpace",
    "PlacedSolid",
    "Room",
    "Solid",
    "SpaceOf",
    "Sphere",
    "WrongShape",
    "body_touches",
    "capsule_box_distance",
    "capsule_distance",
    "capsules_touch",
    "check_poses",
    "compose",
    "frame_from_points",
    "from_xyz_abc",
    "inverse",
    "largest_shift",
    "largest_turn",
    "measured_solid",
    "nearest_capsules",
    "point_box_distance",
    "pose_elements",
    "pose_from",
    "pose_rows",
    "segment_distance",
    "taught_frame",
    "to_xyz_abc",
    "transform_points",
]
