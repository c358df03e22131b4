"""From a robot file, or its description, to the kinematics of its family."""

from pathlib import Path

from robot_agent.kinematics.model import Model
from robot_agent.kinematics.six_axis import SixAxis
from robot_agent.model import Family, RobotDescription, load_description

FAMILIES: dict[Family, type[Model]] = {Family.SIX_AXIS: SixAxis}


def model_of(description: RobotDescription) -> Model:
    """The kinematics of a described robot.

    Raises:
        BadModel: the geometry is not one of this family.
    """
    return FAMILIES[description.family](description)


def load_model(path: str | Path) -> Model:
    """Read a robot file and build its kinematics.

    Raises:
        cell.config.ConfigError: the file has problems; all of them, with line and column.
        BadModel: the geometry is not one of its family.
    """
    return model_of(load_description(path))
