"""From a robot file, or its description, to the kinematics of its family."""

from pathlib import Path

from robot_agent.kinematics.model import Model
from robot_agent.kinematics.numeric.numeric_model import BareUrdf
from robot_agent.model import FAMILIES, URDF, RobotDescription, UrdfSource, load_description


def model_of(description: RobotDescription) -> Model:
    """The kinematics of a described robot.

    Raises:
        BadModel: the geometry is not one of this family.
    """
    model: Model = FAMILIES[description.family].model(description)
    return model


def load_model(path: str | Path) -> Model:
    """Read a robot file, or a bare `.urdf`, and build its kinematics.

    A URDF alone gives kinematics only: what it lacks (acceleration, jerk, home, capsules) raises `NotInUrdf`.

    Raises:
        cell.config.ConfigError: the file has problems; all of them, with line and column.
        BadModel: the geometry is not one of its family.
    """
    if Path(path).suffix == URDF:
        return BareUrdf(UrdfSource(Path(path)))
    return model_of(load_description(path))
