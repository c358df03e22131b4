"""A robot of a cell as everyone sees it: what its file says, where it stands, and what stands around it."""

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from cell.config.settings import PoseSettings, RobotSettings
from cell.geometry.pose import pose_from
from robot_agent.kinematics import Model, load_model
from robot_agent.trajectory import Limits
from robot_agent.workspace.things import Things

ORIGIN = PoseSettings((0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0))


@dataclass(frozen=True, slots=True, eq=False)
class PlacedRobot:
    """Kinematics, body and tool of one robot, the limits of its motions, and the pose of its base."""

    model: Model
    limits: Limits
    pose_world_base: NDArray[np.float64]
    """`(4, 4)`"""
    things: Things
    """What it must not touch."""

    @classmethod
    def of(cls, settings: RobotSettings, model: Model | None = None) -> Self:
        """The robot of a cell; its file is read unless the `model` is known.

        Raises:
            cell.config.ConfigError: its file has problems.
            robot_agent.kinematics.BadModel: its geometry is not one of its family.
            cell.geometry.GeometryError: the mesh of a thing is none.
        """
        model = load_model(settings.model) if model is None else model
        return cls.at(model, settings.base, Things(model, settings.things, settings.name))

    @classmethod
    def at(cls, model: Model, base: PoseSettings = ORIGIN, things: Things | None = None) -> Self:
        """A robot whose file is read already; without `things` it stands in the open."""
        pose = pose_from(np.array(base.position_m), np.array(base.quaternion_xyzw))
        return cls(model, Limits.of(model.description), pose, Things(model) if things is None else things)
