"""Where a step of a program leads, from where the robot is: what is not named keeps its value."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from cell.geometry import compose, from_xyz_abc, inverse
from robot_agent.kinematics import KinematicsError, Model, Unreachable
from robot_agent.language import BASE, Aim, JointStep, Orientation, Position


class NoPlace(Exception):
    """A step leads to no place of this robot; the text says why, `remedy` what to do."""

    def __init__(self, why: str, remedy: str) -> None:
        super().__init__(why)
        self.remedy = remedy


@dataclass(frozen=True, slots=True, eq=False)
class Targets:
    """Where steps lead for a robot, with the frames where they are."""

    model: Model
    pose_world_base: NDArray[np.float64] = field(default_factory=lambda: np.eye(4))
    """`(4, 4)`"""
    frames: Mapping[str, NDArray[np.float64]] = field(default_factory=dict)
    """Pose in world `(4, 4)` by name."""

    def pose(
        self, position_m: Position, orientation_abc: Orientation | None, aim: Aim, present: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Pose `(4, 4)` of the TCP in base at a target, from the pose `present` `(4, 4)`. Raises `NoPlace`.

        Coordinates that are not named keep their value as it is seen in the frame.
        """
        if aim.joints:
            return self.model.forward(np.array(aim.joints))
        tools = self.model.description.mounted.tools
        if aim.point and tools != ((aim.tool,) if aim.tool else ()):
            taught = f"with tool {aim.tool}" if aim.tool else "without a tool"
            raise NoPlace(
                f"point {aim.point} was taught {taught}, mounted is {' or '.join(tools) or 'none'}",
                f"T={aim.tool or 'NONE'} comes before it, or teach {aim.point} again",
            )
        frame = aim.frame or BASE
        if frame == BASE:
            return pose_target(position_m, orientation_abc, present)
        pose_base_frame = self.pose_base_frame(frame)
        seen = compose(inverse(pose_base_frame), present)
        return compose(pose_base_frame, pose_target(position_m, orientation_abc, seen))

    def pose_base_frame(self, frame: str) -> NDArray[np.float64]:
        """Pose `(4, 4)` of a frame in the robot's base. Raises `NoPlace`."""
        if frame not in self.frames:
            raise NoPlace(f"nobody has said where frame {frame} is", "see `cell frame show`")
        return compose(inverse(self.pose_world_base), self.frames[frame])

    def joints(self, step: JointStep, start: NDArray[np.float64]) -> NDArray[np.float64]:
        """Joints `(n,)` at the end of a joint move from `start` `(n,)`. Raises `NoPlace`.

        Of the branches that lead to a pose it is the one with the joints nearest to the named ones, then to `start`.
        """
        if step.goal is None:
            return joint_target(step, start, self.model.home)
        goal, names = step.goal, self.model.joint_names
        pose = self.pose(goal.position_m, goal.orientation_abc, goal.aim, self.model.forward(start))
        named = step.joints or (None,) * len(names)
        prefer = {name: value for name, value in zip(names, named, strict=True) if value is not None}
        try:
            return self.model.solve(pose, near=start, branch=goal.aim.branch or None, prefer=prefer)
        except Unreachable as error:
            x, y, z = 1000.0 * pose[:3, 3]
            on = f" on branch {error.branch}" if error.branch else ""
            text = f"the TCP cannot be at X {x:.1f} Y {y:.1f} Z {z:.1f} mm{on}: {error.violation}"
            raise NoPlace(text, "move the target, or name another branch") from error
        except KinematicsError as error:
            raise NoPlace(str(error), "name one of these, or none: the nearest") from error


def joint_target(step: JointStep, start: NDArray[np.float64], home: NDArray[np.float64]) -> NDArray[np.float64]:
    """Joints `(n,)` at the end of a move of joints that it names, from `start` `(n,)`."""
    return home if step.joints is None else _keep(step.joints, start)


def pose_target(
    position_m: Position, orientation_abc: Orientation | None, present: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Pose `(4, 4)` at named coordinates, from the pose `present` `(4, 4)`, both in one frame."""
    position = _keep(position_m, present[:3, 3])
    target = present.copy()
    if orientation_abc is not None:
        target = from_xyz_abc(np.concatenate([position, orientation_abc]))
    target[:3, 3] = position
    return target


def _keep(named: tuple[float | None, ...], present: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.array([now if value is None else value for value, now in zip(named, present, strict=True)])
