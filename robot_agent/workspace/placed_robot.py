"""A robot of a cell as everyone sees it: what its file says, and where it stands."""

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from cell.config.settings import PoseSettings, RobotSettings
from cell.geometry.pose import pose_from
from robot_agent.kinematics import Model, load_model
from robot_agent.trajectory import Limits

ORIGIN = PoseSettings((0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0))


@dataclass(frozen=True, slots=True, eq=False)
class PlacedRobot:
    """Kinematics, body and tool of one robot, the limits of its motions, and the pose of its base."""

    model: Model
    limits: Limits
    pose_world_base: NDArray[np.float64]
    """`(4, 4)`"""

    @classmethod
    def of(cls, settings: RobotSettings) -> Self:
        """The robot of a cell.

        Raises:
            cell.config.ConfigError: its file has problems.
            robot_agent.kinematics.BadModel: its geometry is not one of its family.
        """
        return cls.at(load_model(settings.model), settings.base)

    @classmethod
    def at(cls, model: Model, base: PoseSettings = ORIGIN) -> Self:
        """A robot whose file is read already."""
        pose = pose_from(np.array(base.position_m), np.array(base.quaternion_xyzw))
        return cls(model, Limits.of(model.description), pose)
