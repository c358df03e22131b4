"""What kinematics refuses, and why. Fields are SI; messages speak the operator's millimetres and degrees."""

from dataclasses import dataclass
from enum import Enum

import numpy as np

from cell.geometry import to_xyz_abc
from cell.geometry.arrays import Array


class KinematicsError(Exception):
    """Root of all errors of `robot_agent.kinematics`."""


class BadModel(KinematicsError):
    """A robot description that is no robot of its family. `problems` has one entry per finding."""

    def __init__(self, model: str, problems: tuple[str, ...]) -> None:
        self.model = model
        self.problems = problems
        super().__init__(f"robot model {model!r}: " + "; ".join(problems))


class BadInput(KinematicsError, ValueError):
    """Joints of a wrong shape, or with a value that is not finite."""

    def __init__(self, what: str, found: str, allowed: str) -> None:
        self.what = what
        self.found = found
        self.allowed = allowed
        super().__init__(f"{what}: found {found}, allowed {allowed}")


class NotInUrdf(KinematicsError):
    """A bare URDF was asked for what URDF does not have."""

    def __init__(self, file: str, what: str) -> None:
        self.file = file
        self.what = what
        super().__init__(
            f"{file}: a URDF says nothing about {what!r}; write a robot file of family urdf that names it and adds "
            "limits, home position and capsules"
        )


class UnknownName(KinematicsError):
    """A branch or joint that this robot does not have."""

    def __init__(self, what: str, found: str, allowed: tuple[str, ...]) -> None:
        self.what = what
        self.found = found
        self.allowed = allowed
        super().__init__(f"{what}: found {found!r}, allowed {', '.join(allowed)}")


class Reason(Enum):
    """Why there are no joints for a pose."""

    TOO_FAR = "too far"
    TOO_NEAR = "too near"
    JOINT_LIMIT = "joint limit"
    BRANCH_CHANGE = "branch change"
    TILTED = "tilted"
    NOT_FOUND = "not found"
    """A numeric solver came near a pose from every start, but not to it."""


@dataclass(frozen=True, slots=True)
class Violation:
    """What exactly rules: a joint and its limits, or how far the pose lies outside the reach."""

    reason: Reason
    joint: str | None = None
    value: float | None = None
    """The joint's value [rad or m], or its step for a branch change."""
    limit: tuple[float, float] | None = None
    """Lower and upper limit of the joint [rad or m]."""
    excess_m: float = 0.0
    """Distance of the wrist (of the flange, for a numeric solver) from the nearest reachable point."""
    tilt_rad: float = 0.0
    """How far the orientation is from the nearest one that the robot can take."""
    linear: bool = False
    """The joint slides."""

    def __str__(self) -> str:
        match self.reason:
            case Reason.TOO_FAR | Reason.TOO_NEAR:
                excess = f"{self.excess_m * 1000:.1f} mm" if self.excess_m >= 5e-5 else "less than 0.1 mm"
                return f"the wrist would be {excess} {self.reason.value}"
            case Reason.TILTED:
                return (
                    f"the orientation is {np.degrees(self.tilt_rad):.4f} deg away from those that a robot with so few "
                    "joints can take"
                )
            case Reason.NOT_FOUND:
                away = f"{self.excess_m * 1000:.1f} mm and {np.degrees(self.tilt_rad):.2f} deg"
                return f"no start led to joints inside their limits; the nearest pose is {away} away"
        value, unit = self._shown(self.value), "mm" if self.linear else "deg"
        if self.limit is not None:
            lower, upper = map(self._shown, self.limit)
            return f"joint {self.joint} would need {value:.2f} {unit}, allowed {lower:.2f} to {upper:.2f}"
        return f"joint {self.joint} would jump by {value:.2f} {unit} from one pose to the next, near a singularity"

    def _shown(self, value: float | None) -> float:
        if value is None:
            return float("nan")
        return 1000 * value if self.linear else float(np.degrees(value))


class OpenMechanism(KinematicsError):
    """Joints at which the arms of a parallel robot do not meet. `index` addresses them in the batch."""

    def __init__(self, index: tuple[int, ...], joints: Array) -> None:
        self.index = index
        self.joints = joints
        where = f"joints[{', '.join(map(str, index))}]" if index else "joints"
        shown = ", ".join(f"{value:.2f}" for value in np.degrees(joints))
        super().__init__(f"{where}: found {shown} deg, where the rods are too short to meet at the platform")


class Unreachable(KinematicsError):
    """No joints within the limits reach the pose."""

    def __init__(self, pose: Array, violation: Violation, branch: str | None = None) -> None:
        self.pose = pose
        self.violation = violation
        self.reason = violation.reason
        self.joint = violation.joint
        self.value = violation.value
        self.limit = violation.limit
        self.branch = branch
        forced = f" on branch {branch}" if branch else ""
        super().__init__(f"flange target {_for_people(pose)} is out of reach{forced}: {violation}; move the target")


class TrackError(KinematicsError):
    """A path of poses that one branch cannot follow. `index` is the first pose that fails."""

    def __init__(self, index: int, pose: Array, violation: Violation, branch: str) -> None:
        self.index = index
        self.pose = pose
        self.violation = violation
        self.reason = violation.reason
        self.joint = violation.joint
        self.value = violation.value
        self.limit = violation.limit
        self.branch = branch
        super().__init__(
            f"pose {index} of the path, {_for_people(pose)}, branch {branch}: {violation}; "
            "move the path, start it from another branch, or use a joint move"
        )


def _for_people(pose: Array) -> str:
    x, y, z, a, b, c = to_xyz_abc(pose)
    return f"X {x * 1000:.1f} Y {y * 1000:.1f} Z {z * 1000:.1f} mm " + " ".join(
        f"{name} {np.degrees(value):.1f}" for name, value in (("A", a), ("B", b), ("C", c))
    )
