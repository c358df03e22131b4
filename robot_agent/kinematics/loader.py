"""From a robot file, or its description, to the kinematics of its family."""

from pathlib import Path

from robot_agent.kinematics.families.cobot import Cobot
from robot_agent.kinematics.families.delta import Delta
from robot_agent.kinematics.families.gantry import Gantry
from robot_agent.kinematics.families.palletizer import Palletizer
from robot_agent.kinematics.families.scara import Scara
from robot_agent.kinematics.families.six_axis import SixAxis
from robot_agent.kinematics.model import Model
from robot_agent.kinematics.numeric.numeric_model import BareUrdf, NumericModel
from robot_agent.model import URDF, Family, RobotDescription, UrdfSource, load_description

FAMILIES: dict[Family, type[Model]] = {
    Family.SIX_AXIS: SixAxis,
    Family.COBOT: Cobot,
    Family.SCARA: Scara,
    Family.PALLETIZER: Palletizer,
    Family.DELTA: Delta,
    Family.GANTRY: Gantry,
    Family.URDF: NumericModel,
}


def model_of(description: RobotDescription) -> Model:
    """The kinematics of a described robot.

    Raises:
        BadModel: the geometry is not one of this family.
    """
    return FAMILIES[description.family](description)


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
