"""From joints to poses and back, closed form, all branches, batched. SI units and radians, poses of the TCP of
the mounted tool in the robot's base frame; without a tool those of the flange.

`load_model` reads a robot file and gives the `Model` of its family. On top: what all models answer (model, choice of
the branch, tracking) and what open chains share (chain, serial, reach). Below: families/ with a closed form each,
numeric/ for chains without one, urdf/ to read them.
"""

from robot_agent.kinematics.coupling import Coupling
from robot_agent.kinematics.errors import (
    BadInput,
    BadModel,
    KinematicsError,
    NotInUrdf,
    OpenMechanism,
    Reason,
    TrackError,
    UnknownName,
    Unreachable,
)
from robot_agent.kinematics.families.six_axis import SixAxis
from robot_agent.kinematics.loader import load_model, model_of
from robot_agent.kinematics.model import Model
from robot_agent.kinematics.numeric.numeric_model import BareUrdf, NumericModel
from robot_agent.kinematics.serial import SerialModel
from robot_agent.kinematics.singularity import SingularityDistance
from robot_agent.kinematics.solutions import Solutions

__all__ = [
    "BadInput",
    "BadModel",
    "BareUrdf",
    "Coupling",
    "KinematicsError",
    "Model",
    "NotInUrdf",
    "NumericModel",
    "OpenMechanism",
    "Reason",
    "SerialModel",
    "SingularityDistance",
    "SixAxis",
    "Solutions",
    "TrackError",
    "UnknownName",
    "Unreachable",
    "load_model",
    "model_of",
]
