"""A robot of a cell as everyone sees it: what its file says, where it stands, and what stands around it."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from itertools import product
from typing import Self

import numpy as np
from numpy.typing import NDArray

from cell.config.settings import JointRange, PoseSettings, RobotSettings
from cell.geometry import transform_points
from cell.geometry.pose import pose_from
from robot_agent.kinematics import Model, load_model, model_of
from robot_agent.model.description import NO_TOOL, Mounted
from robot_agent.trajectory import Limits
from robot_agent.workspace.spaces import Spaces
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
    spaces: Spaces
    """Where it may be."""
    mountings: Mapping[Mounted, "PlacedRobot"] = field(default_factory=dict)
    """The same robot with each tool and part, and with all at once where it may be any of them."""
    kept_apart: bool = False
    """The cell keeps it apart from other robots wherever they are."""

    @classmethod
    def of(cls, settings: RobotSettings, model: Model | None = None) -> Self:
        """The robot of a cell; its file is read unless the `model` is known.

        Raises:
            cell.config.ConfigError: its file has problems.
            robot_agent.kinematics.BadModel: its geometry is not one of its family.
            cell.geometry.GeometryError: the mesh of a thing is none.
        """
        model = with_tool(load_model(settings.model) if model is None else model, settings.tool)
        model = narrowed(model, settings.joints)
        things = Things(model, settings.things, settings.name)
        spaces = Spaces(model, settings.spaces, settings.orientation)
        return cls.at(model, settings.base, things, spaces, kept_apart=settings.kept_apart)

    @classmethod
    def at(
        cls,
        model: Model,
        base: PoseSettings = ORIGIN,
        things: Things | None = None,
        spaces: Spaces | None = None,
        *,
        kept_apart: bool = False,
    ) -> Self:
        """A robot whose file is read already; without `things` and `spaces` it stands in the open."""
        pose = pose_from(np.array(base.position_m), np.array(base.quaternion_xyzw))
        things = Things(model) if things is None else things
        spaces = Spaces(model) if spaces is None else spaces
        others = {mounted: model_of(replace(model.description, mounted=mounted)) for mounted in _mountings(model)}
        limits = Limits.of(model.description)
        mountings = {
            mounted: cls(each, limits, pose, things.of(each), spaces.of(each), kept_apart=kept_apart)
            for mounted, each in others.items()
        }
        return cls(model, limits, pose, things, spaces, mountings, kept_apart)

    @property
    def body_at_home(self) -> NDArray[np.float64]:
        """Capsules at the home position in world, `(c, 2, 3)` [m]."""
        return transform_points(self.pose_world_base, self.model.capsules(self.model.home))


def _mountings(model: Model) -> set[Mounted]:
    """What else the robot may carry: each tool with each part, none of them, and any of them."""
    tools, parts = (
        {(), *((name,) for name in names), tuple(names)} for names in (model.description.tools, model.description.parts)
    )
    return {Mounted(*each) for each in product(tools, parts)} - {model.description.mounted}


def with_tool(model: Model, tool: str | None) -> Model:
    """The model with this of its tools mounted, `NO_TOOL` for none; None: with what it has."""
    if tool is None:
        return model
    return model_of(replace(model.description, mounted=Mounted(() if tool == NO_TOOL else (tool,))))


def narrowed(model: Model, joints: Mapping[str, JointRange]) -> Model:
    """The model with the ranges of some of its joints, where they are narrower than its own."""
    ranges = {name: joints[name] for name in model.joint_names if name in joints}
    if not ranges:
        return model
    position = model.limits.position.copy()
    for index, (name, linear) in enumerate(zip(model.joint_names, model.linear, strict=True)):
        if name in ranges:
            low, high = ranges[name].slide_m if linear else ranges[name].turn_rad
            position[index] = max(low, position[index, 0]), min(high, position[index, 1])
    limits = replace(model.limits, position=position)
    return model_of(replace(model.description, limits=limits))
