"""Joint states after a motion of the TCP: positions by the inverse, speeds and accelerations by the Jacobian."""

import numpy as np
from numpy.typing import NDArray

from robot_agent.kinematics import Model, NumericModel, Reason, TrackError
from robot_agent.trajectory.sources.states import States

_FOLLOWED = 1e-5
"""Largest part [m/s, rad/s] of a twist that the joints may fail to produce."""


class NoDirection(Exception):
    """The joints cannot move the TCP the way that was asked for; says why, for people."""


def joints_along(
    model: Model,
    poses: NDArray[np.float64],
    twists: NDArray[np.float64],
    accelerations: NDArray[np.float64],
    start: NDArray[np.float64],
) -> States:
    """Joint states for poses `(m, 4, 4)`, twists and their derivatives `(m, 6)` of the TCP in base, near `start`.

    Raises `NoDirection` where the joints cannot produce a twist, and `robot_agent.kinematics.TrackError` where a pose
    is out of reach, outside the limits, or on another branch.
    """
    q = tracked(model, poses, start)
    jacobian = model.jacobian(q)
    qd = joint_speeds(model, q, jacobian, twists)
    bend = (model.jacobian_derivative(q, qd) @ qd[..., None])[..., 0]
    return States(q, qd, _solved(jacobian, accelerations - bend))


def tracked(model: Model, poses: NDArray[np.float64], start: NDArray[np.float64]) -> NDArray[np.float64]:
    """Joints `(m, n)` for poses `(m, 4, 4)` that begin next to joints `start`. Raises as `Model.track`.

    An inverse that iterates only goes on from `start`: to look for other solutions, or for what is in the way, takes
    longer than there is from one block to the next.
    """
    return model.follow(poses, start) if isinstance(model, NumericModel) else model.track(poses, start)


def in_reach(model: Model, pose: NDArray[np.float64], start: NDArray[np.float64]) -> bool:
    """Whether joints bring the TCP to `pose` `(4, 4)`; an inverse that iterates looks from `start` `(n,)` only."""
    if isinstance(model, NumericModel):
        return bool(model.iterate(pose[None], start[None]).solved[0])
    return bool(model.reaches(pose))


def joint_speeds(
    model: Model, q: NDArray[np.float64], jacobian: NDArray[np.float64], twists: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Joint speeds `(m, n)` for twists `(m, 6)` of the TCP at joints `q` `(m, n)`. Raises `NoDirection`."""
    qd = _solved(jacobian, twists)
    missing = np.abs((jacobian @ qd[..., None])[..., 0] - twists).max(axis=1, initial=0.0)
    if (missing > _FOLLOWED).any():
        raise NoDirection(f"no joints move the tool this way {_near_singular(model, q[int(missing.argmax())])}".strip())
    return qd


def _solved(jacobian: NDArray[np.float64], twists: NDArray[np.float64]) -> NDArray[np.float64]:
    if jacobian.shape[-1] == 6:
        try:
            return np.asarray(np.linalg.solve(jacobian, twists[..., None])[..., 0], dtype=np.float64)
        except np.linalg.LinAlgError:
            pass
    return np.asarray((np.linalg.pinv(jacobian) @ twists[..., None])[..., 0])


def why_lost(error: TrackError) -> str:
    """What ends a way that joints follow, for people."""
    match error.reason:
        case Reason.JOINT_LIMIT:
            return f"{error.joint} at its limit"
        case Reason.BRANCH_CHANGE:
            return f"{error.joint} would jump, near a singularity"
        case Reason.TILTED:
            return "a robot with so few joints cannot tilt its tool"
        case _:
            return "at the edge of the robot's reach"


def why_fast(model: Model, q: NDArray[np.float64], joint: int) -> str:
    """Why `joint` is at its speed limit at `q` `(n,)`, for people."""
    return f"{model.joint_names[joint]} at its speed limit {_near_singular(model, q)}".strip()


def _near_singular(model: Model, q: NDArray[np.float64]) -> str:
    distance = model.singularity(q)
    return f"near a singularity ({distance.name})" if float(distance.nearest) < 0.2 else ""
