"""Which timing a path gets: each joint its own profile, one profile for all, or the fastest; then the filter."""

from collections.abc import Sequence

from robot_agent.kinematics import Model
from robot_agent.model.description import ProfileKind
from robot_agent.trajectory.joints.joint_path import JointPath
from robot_agent.trajectory.limits import Limits
from robot_agent.trajectory.timing.axis_filter import filtered
from robot_agent.trajectory.timing.independent import Independent
from robot_agent.trajectory.timing.one_profile import has_vias, single, slowed
from robot_agent.trajectory.timing.optimal.time_optimal import fastest_of
from robot_agent.trajectory.timing.timed import Timed


def in_time(model: Model, paths: Sequence[JointPath | Independent], limits: Limits) -> list[Timed]:
    """Joints over time along each of `paths`, from rest to rest, with the profile and the filter of `limits.shaping`.

    An S-curve stands for the fastest timing: where the limits change along the path, of whatever shape they lead to.
    Every other profile rules a line, an arc, a joint move or a spline without via points from rest to rest: where the
    limits change along it, all of it is slowed down until each of them is kept. Several moves in one motion have one
    profile where nothing changes between them, and else the fastest timing.
    """
    ruled = [
        path.in_time(model, limits) if isinstance(path, Independent) else _ruled(model, path, limits) for path in paths
    ]
    free = [path for path, timed in zip(paths, ruled, strict=True) if timed is None and isinstance(path, JointPath)]
    rest = iter(fastest_of(model, free, limits))
    timed = [known or next(rest) for known in ruled]
    if limits.shaping.filter_s == 0.0:
        return timed
    return [filtered(model, path.stretches, each, limits) for path, each in zip(paths, timed, strict=True)]


def _ruled(model: Model, path: JointPath, limits: Limits) -> Timed | None:
    """One profile along `path`; None where the fastest timing has another shape."""
    timed = single(model, path, limits)
    if timed is not None:
        return timed
    one_move = len({each.move for each in path.stretches}) == 1 and not has_vias(path)
    shaped = one_move and limits.shaping.profile is not ProfileKind.S_CURVE
    return slowed(model, path, limits) if shaped else None
