"""The points of the robot: taught where it stands, written into its points file, told, and gone to."""

import itertools
import json
import math
import re
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from cell.config.points_file import JointPoint, Point, PointsOwner, PointsSettings, PosePoint
from cell.config.problem import near
from cell.config.settings import CellSettings, PoseSettings
from cell.core import Answer, Effect
from cell.geometry import compose, inverse, to_xyz_abc
from cell.messages import DriveFeedback, PointKind, Reply, Teach
from robot_agent.agent.planning.heard_frames import HeardFrames
from robot_agent.agent.planning.planner import Planner
from robot_agent.agent.planning.targets import NoPlace
from robot_agent.kinematics import KinematicsError, Model
from robot_agent.kinematics.choice import limit_violation
from robot_agent.language import BASE, Aim, Goal, JointStep, NoTarget, Program, points_owner, settled
from robot_agent.model import NO_TOOL

_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,31}")


@dataclass(frozen=True, slots=True)
class WritePoint(Effect):
    """Write a point into the points file; `PointWritten` or `PointNotWritten` with the same id comes back."""

    id: int
    file: Path
    name: str
    point: Point
    owner: PointsOwner


@dataclass(frozen=True, slots=True)
class PointWritten:
    """All that the points file says now."""

    id: int
    settings: PointsSettings


@dataclass(frozen=True, slots=True)
class PointNotWritten:
    """The points file stays as it is; why, for people."""

    id: int
    reason: str


class Untaught(Exception):
    """Nothing is taught, or gone to; the text says why, for people."""


@dataclass(frozen=True, slots=True)
class _Waiting:
    """An operator who waits for a point to be written."""

    id: int
    request_id: str
    call_id: str
    name: str


class Teaching:
    """The points of one robot. One is written at a time, by the shell; programs have it once it is on disk."""

    def __init__(self, robot: str, cell: CellSettings, program: Program, frames: HeardFrames) -> None:
        self._robot = robot
        self._cell = cell
        self._program = program
        self._points = program.points
        self._frames = frames
        self._ids = itertools.count(1)
        self._waiting: _Waiting | None = None
        self._answers: list[Effect] = []

    def taught(self, command: Teach, planner: Planner, feedback: DriveFeedback, standing: bool) -> Point:
        """The point where the robot is measured to stand. Raises `Untaught`."""
        name, known = command.point, self._points.named.get(command.point)
        if not _NAME.fullmatch(name):
            raise Untaught(f"the name {name!r} found, allowed are up to 32 letters, digits and _, a letter first")
        if known is not None and not command.replace:
            where = self._text(known, planner)
            raise Untaught(f"{name} is taught already: {where}; `cell teach {self._robot} {name} --replace` moves it")
        if self._waiting is not None:
            raise Untaught(f"{self._waiting.name} is being written: teach {name} once it is there")
        if not feedback.referenced:
            raise Untaught(f"{self._robot} does not know where it is: `cell drives` says why")
        if not standing:
            raise Untaught(f"{self._robot} moves: teach it where it stands")
        if command.kind is PointKind.JOINTS:
            if command.frame is not None:
                raise Untaught("joints are in no frame: leave one of the two out")
            return JointPoint(tuple(feedback.position.tolist()))
        frame = command.frame
        if frame is None and isinstance(known, PosePoint):
            frame = known.frame
        tools = planner.model.description.mounted.tools
        if len(tools) > 1:
            words = " or ".join((*tools, NO_TOOL))
            raise Untaught(f"nobody has said what {self._robot} carries, {words}: `cell tool {self._robot} NAME|none`")
        try:
            pose = planner.model.forward(feedback.position)
        except KinematicsError as error:
            raise Untaught(f"there is no pose here: {error}; teach the joints: --joints") from error
        seen = compose(inverse(self.pose_base_frame(frame, planner)), pose) if frame else pose
        x, y, z, a, b, c = to_xyz_abc(seen).tolist()
        return PosePoint((x, y, z), (a, b, c), frame or None, *tools)

    def pose_base_frame(self, frame: str, planner: Planner) -> NDArray[np.float64]:
        """Pose `(4, 4)` of a frame of the cell in the robot's base, as the manager says it. Raises `Untaught`."""
        if frame not in self._cell.frames:
            none = "the cell file has none"
            raise Untaught(f"unknown frame {frame!r}, allowed {near(frame, self._cell.frames, none)}")
        told = self._frames.of(frame)
        if told is None:
            raise Untaught(f"the manager has not said yet where frame {frame} is")
        pose_world_frame = PoseSettings(told.position_m, told.quaternion_xyzw).matrix()
        return compose(inverse(planner.pose_world_base), pose_world_frame)

    def write(self, name: str, point: Point, planner: Planner, request_id: str, call_id: str) -> WritePoint:
        """What the shell does with a point that was taught; the operator is answered once it is done."""
        self._waiting = _Waiting(next(self._ids), request_id, call_id, name)
        owner = points_owner(self._cell, planner.model.description, planner.model.branches)
        return WritePoint(self._waiting.id, self._cell.robots[self._robot].points, name, point, owner)

    @property
    def writing(self) -> str:
        """The point that is being written; empty for none."""
        return "" if self._waiting is None else self._waiting.name

    def takes(self, program: Program) -> None:
        """From here on the points are those of this program."""
        self._program, self._points = program, program.points
        self._frames.need(program.frames)

    def written(self, outcome: PointWritten | PointNotWritten, planned_in: str, planned_to: int) -> None:
        """Take what became of it; the program has planned up to a line of a file, 0 for none."""
        waiting = self._waiting
        if waiting is None or outcome.id != waiting.id:
            return
        self._waiting = None
        if isinstance(outcome, PointWritten):
            self._points.named = outcome.settings.points
            self._frames.need(self._program.frames)
            text = f"{self._robot}: {waiting.name} is written; the program takes it where it comes to it from now on"
            if planned_to:
                until = f"until it is through line {planned_to} of {planned_in} next"
                text += f"; motions that are planned already keep the old place, {until}"
            reply = Reply(waiting.call_id, True, text)
        else:
            reply = Reply(waiting.call_id, False, f"{waiting.name} is not written: {outcome.reason}")
        self._answers.append(Answer(waiting.request_id, reply))

    def answers(self) -> list[Effect]:
        """To those who waited for a point."""
        answers, self._answers = self._answers, []
        return answers

    def told(self, planner: Planner) -> str:
        """All points and where they are, for people."""
        if not self._points.named:
            return f"{self._robot} has no points: `cell teach {self._robot} NAME` teaches one where it stands"
        lines = (f"{name}: {self._text(point, planner)}" for name, point in self._points.named.items())
        return "\n".join(lines)

    def named(self) -> str:
        """All points by their names as a JSON object, in SI units."""
        return json.dumps({name: asdict(point) for name, point in self._points.named.items()})

    def joints_of(self, name: str, planner: Planner, start: NDArray[np.float64]) -> NDArray[np.float64]:
        """Joints `(n,)` at a point, on the branch that is nearest to `start` `(n,)`. Raises `Untaught`."""
        if name not in self._points.named:
            none = f"none: cell teach {self._robot} NAME"
            raise Untaught(f"no point {name!r}, allowed {near(name, self._points.named, none)}")
        try:
            position, orientation, aim = settled(Aim(name), (None,) * 3, None, self._points.named, BASE)
            if aim.joints:
                joints = np.array(aim.joints)
                if violation := limit_violation(planner.model, joints):
                    raise Untaught(f"{self._robot} does not get to {name}: {violation}")
                return joints
            return planner.targets.joints(JointStep(0, None, 1.0, goal=Goal(position, orientation, aim)), start)
        except NoPlace as error:
            raise Untaught(f"{self._robot} does not get to {name}: {error}; {error.remedy}") from error
        except NoTarget as error:
            raise Untaught(str(error)) from error

    def _text(self, point: Point, planner: Planner) -> str:
        """A point in mm and deg, and where that is in the robot's base now."""
        model = planner.model
        if isinstance(point, JointPoint):
            return joints_text(model, np.array(point.joints))
        values = _pose_text(np.array([*point.position_m, *point.orientation_abc]))
        named = {"in": point.frame, "of tool": point.tool, "branch": point.branch}
        text = " ".join([values, *(f"{word} {value}" for word, value in named.items() if value)])
        if not point.frame:
            return text
        try:
            pose = self.pose_base_frame(point.frame, planner)
        except Untaught as error:
            return f"{text}; {error}"
        x, y, z = (pose @ np.array([*point.position_m, 1.0]))[:3] * 1000.0
        return f"{text}; now at X {x:.2f} Y {y:.2f} Z {z:.2f} mm in the robot's base"


def joints_text(model: Model, q: NDArray[np.float64]) -> str:
    """Joints `(n,)` as a program names them."""
    shown = np.where(model.linear, 1000.0 * q, np.degrees(q)) + 0.0
    return " ".join(f"{name}={value:.4f}" for name, value in zip(model.joint_names, shown, strict=True))


def _pose_text(values: NDArray[np.float64]) -> str:
    lengths = [f"{key} {round(1000.0 * value, 2) + 0.0:.2f}" for key, value in zip("XYZ", values[:3], strict=True)]
    angles = [f"{key} {round(math.degrees(value), 3) + 0.0:.3f}" for key, value in zip("ABC", values[3:], strict=True)]
    return " ".join([*lengths, *angles])
