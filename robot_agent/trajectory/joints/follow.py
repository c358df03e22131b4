"""Joints along a path of the TCP: as many nodes as it takes to stay on the path."""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from robot_agent.kinematics import KinematicsError, Model, Reason, TrackError
from robot_agent.kinematics.choice import joint_violation
from robot_agent.kinematics.turns import LIMIT_TOLERANCE_RAD
from robot_agent.paths.pose_path import PosePath
from robot_agent.trajectory.errors import PlanError
from robot_agent.trajectory.joints.branch_change import any_branch
from robot_agent.trajectory.joints.pieces import Pieces

Numbers = NDArray[np.float64]
Refusal = Callable[[float, str, str, str | None, str | None, Numbers | None], PlanError]
"""Distance [m], reason, hint, joint, limit, pose -> the error to raise."""

_TOLERANCE = 1e-6
"""Largest distance [m] and angle [rad] between the joints' curve and the path."""
_CHORD = 0.1
"""Share by which the joints' way from node to node may differ from the straight one."""
_NO_WAY = 1e-6
"""A difference [s at full speed] that does not matter."""
_HALVED = 10.0
_RISING = 1e-14
"""Share of the whole parameter by which it rises at least from node to node."""
_ROUNDS = 24
_MOST_PARTS = 4
_SPACING_M = 0.03
_SPACING_RAD = 0.1
_LOOKED_AT = np.linspace(0.0, 1.0, 5)
_FEWEST_PARTS = 16
"""Of each curve of the path at first, which mostly is fine enough: to divide them all once more takes longer."""
_EVEN, _LONG_M, _SUBDIVIDED = 0.01, 0.005, 4
"""The curvature is known in so many parts of a long interval where it bends by more than this share of the largest."""
_FINEST_M = 1e-8
_MOST_NODES, _MOST_OF_ALL = 6000, 40_000
"""To find where the wrist turns fast; on any path."""
_LONGEST_M = 2000.0
"""Of a path: a hundred rounds of the widest circle that an arm goes."""
_SINGULAR = 1e12
"""Condition of the Jacobian."""
_HINT = "use a joint move here, or move the corner away from the singular pose"
_OUT_OF_REACH = (None, "move the line into the robot's reach")
_TRACKING = {
    Reason.TOO_FAR: _OUT_OF_REACH,
    Reason.TOO_NEAR: _OUT_OF_REACH,
    Reason.JOINT_LIMIT: ("position", "move the line, or begin it with other joints after a joint move"),
    Reason.BRANCH_CHANGE: ("velocity", _HINT),
    Reason.TILTED: (None, "give the target an orientation that the robot can take"),
    Reason.NOT_FOUND: _OUT_OF_REACH,
}
"""The limit that a path breaks where its poses have no continuous joints, and what to do."""


@dataclass(frozen=True, slots=True, eq=False)
class FollowedPath:
    """`pieces` as `JointPath` has them; distance [m] and parameter of each node `(k,)`."""

    pieces: Pieces
    distance_m: Numbers
    parameter: Numbers
    curvature: Numbers
    """`(m, 2)` parameter and curvature [1/m] of the TCP's way."""

    def passing(self, distance_m: Numbers) -> Numbers:
        """Parameters `(m,)` at which distances `(m,)` [m, or rad on the spot] are passed."""
        at = np.interp(distance_m, self.distance_m, self.parameter)
        joints = self.pieces.coefficients.shape[2] - 2
        column = joints if self.pieces.position(self.parameter[-1:])[0, joints] > 0.0 else joints + 1
        for _ in range(4):  # both rise smoothly between nodes, so Newton finds the place from there
            distance, rate = self.pieces.shape(at)[:2, :, column]
            at = np.clip(at - (distance - distance_m) / np.maximum(rate, 1e-9), 0.0, self.parameter[-1])
        return at


def follow(
    model: Model, path: PosePath, start: Numbers, velocity: Numbers, flips: bool, refuse: Refusal
) -> FollowedPath:
    """Joints from `start` `(n,)` along `path`. `velocity` `(n,)` weights the parameter. Raises PlanError.

    `flips` lets the wrist change its branch where two branches meet.
    """
    return _Follower(model, path, start, velocity, flips, refuse).run()


class _Follower:
    def __init__(
        self, model: Model, path: PosePath, start: Numbers, velocity: Numbers, flips: bool, refuse: Refusal
    ) -> None:
        self._model, self._path, self._start = model, path, start
        self._velocity, self._flips, self._refuse = velocity, flips, refuse
        self._on_the_spot = bool(np.linalg.norm(path.chain.at(np.zeros(1))[1]) == 0.0)

    def run(self) -> FollowedPath:
        self._check_start()
        nodes = self._first_nodes()
        for _ in range(_ROUNDS):
            nodes, *states = self._tracked(nodes)
            made = self._through(nodes, *states)
            error = self._error(made)
            if error.max() <= _TOLERANCE:
                return replace(made, curvature=self._curvature(made))
            if len(nodes) > _MOST_OF_ALL:
                break
            nodes = _divided(nodes, np.minimum(np.ceil(1.1 * (error / _TOLERANCE) ** (1.0 / 6.0)), _MOST_PARTS))
        where = float(nodes[int(np.argmax(error))])
        reason = "the joints cannot follow this path closely enough"
        hint = "give the TCP more way there to turn, by another R or R=0 too, or split the move"
        raise self._refuse(where, reason, hint, None, None, self._path.poses(np.array([where]))[0])

    def _check_start(self) -> None:
        """Refuse joints outside their range, from where the nearest joints on the path may be far away."""
        lower, upper = self._model.limits.position.T
        beyond = np.maximum(lower - self._start, self._start - upper)
        joint = int(np.argmax(beyond))
        if beyond[joint] > LIMIT_TOLERANCE_RAD:
            found = joint_violation(self._model, joint, float(self._start[joint]))
            reason = f"the path begins outside the range of a joint: {str(found).replace('would need', 'is at')}"
            hint, pose = "bring the joint back into its range by a joint move first", self._path.poses(np.zeros(1))[0]
            raise self._refuse(0.0, reason, hint, found.joint, "position", pose)

    def _first_nodes(self) -> Numbers:
        borders = self._path.borders_m
        if borders[-1] > _LONGEST_M:
            reason = f"the path is {borders[-1]:.6g} m long, at most {_LONGEST_M:g} m are allowed without a stop"
            raise self._refuse(
                0.0, reason, "move the target nearer, or let the robot stop on the way", None, None, None
            )
        places = borders[:-1, None] + np.diff(borders)[:, None] * _LOOKED_AT
        twist = self._path.states(places.ravel())[1]
        rate = np.linalg.norm(twist[:, 3:], axis=1).reshape(places.shape).max(axis=1)
        spacing = _SPACING_RAD if self._on_the_spot else _SPACING_M
        turned = np.minimum(np.diff(borders) * rate / _SPACING_RAD, _MOST_NODES)
        steps = np.maximum(np.diff(borders) / spacing, turned)
        return _divided(borders, np.maximum(np.ceil(steps), _FEWEST_PARTS))

    def _tracked(self, nodes: Numbers) -> tuple[Numbers, Numbers, Numbers, Numbers]:
        """Nodes, more of them where a joint turns quickly; the joints, the twist and its derivative there."""
        while True:
            poses, twist, change = self._path.states(nodes)
            try:
                if not self._flips:
                    q = self._model.track(poses, self._start)
                    break
                q, counts = any_branch(self._model, poses, self._start)
                nodes, q, twist, change = (each[counts] for each in (nodes, q, twist, change))
                break
            except TrackError as error:
                index = error.index
                fine = index == 0 or nodes[index] - nodes[index - 1] < _FINEST_M or len(nodes) > _MOST_NODES
                if error.reason is not Reason.BRANCH_CHANGE or fine:
                    if self._flips:  # the wrist may flip, it does not have to
                        self._flips = False
                        continue
                    limit, hint = _TRACKING[error.reason]
                    where = float(nodes[index])
                    raise self._refuse(where, str(error.violation), hint, error.joint, limit, poses[index]) from error
                nodes = np.insert(nodes, index, (nodes[index - 1] + nodes[index]) / 2.0)
            except KinematicsError as error:
                raise self._refuse(0.0, str(error), _HINT, None, None, None) from error
        gap = np.abs(q[0] - self._start)
        if gap.max() > 1e-7:
            name = self._model.joint_names[int(np.argmax(gap))]
            reason = f"the path would begin with a jump of joint {name}, the start is a singular pose"
            raise self._refuse(0.0, reason, _HINT, name, "velocity", poses[0])
        q = q.copy()
        q[0] = self._start
        return nodes, q, twist, change

    def _through(self, nodes: Numbers, q: Numbers, twist: Numbers, change: Numbers) -> FollowedPath:
        """The curve through exact states at the nodes, by the weighted length of the joints' way."""
        jacobian = self._model.jacobian(q)
        tangent, bend = self._derivatives(nodes, q, twist, change, jacobian)
        weighted, bent = tangent / self._velocity, bend / self._velocity
        speed = np.linalg.norm(weighted, axis=1)
        growth = (weighted * bent).sum(axis=1) / speed
        step = np.diff(nodes)
        lengths = step * (speed[:-1] + speed[1:]) / 2.0 + step**2 * (growth[:-1] - growth[1:]) / 12.0
        least = np.maximum(step * 1e-9, _RISING * np.abs(lengths).sum())  # beside a singular pose: nodes stay apart
        parameter = np.append(0.0, np.cumsum(np.maximum(lengths, least)))
        linear, angular = np.linalg.norm(twist[:, :3], axis=1), np.linalg.norm(twist[:, 3:], axis=1)
        angular_growth = (twist[:, 3:] * change[:, 3:]).sum(axis=1) / np.maximum(angular, 1e-9)
        turns = step * (angular[:-1] + angular[1:]) / 2.0 + step**2 * (angular_growth[:-1] - angular_growth[1:]) / 12.0
        turn = np.append(0.0, np.cumsum(turns))
        if self._on_the_spot:
            turn = nodes
        value = np.column_stack([q, np.zeros_like(nodes) if self._on_the_spot else nodes, turn])
        first = np.column_stack([tangent, linear, angular])
        second = np.column_stack([bend, np.zeros_like(nodes), angular_growth])
        by_length = first / speed[:, None]
        by_length_twice = (second - by_length * growth[:, None]) / (speed**2)[:, None]
        curvature = np.column_stack([parameter, np.linalg.norm(change[:, :3], axis=1)])
        pieces = Pieces.through(parameter, value, by_length, by_length_twice)
        return FollowedPath(pieces, nodes, parameter, curvature)

    def _curvature(self, made: FollowedPath) -> Numbers:
        """As `FollowedPath` has it, and between the nodes where it does not change evenly from each to the next."""
        known = made.curvature
        bent = np.abs(np.diff(known[:, 1], 2)) > _EVEN * known[:, 1].max()
        uneven = np.flatnonzero(
            (np.append(bent, False) | np.append(False, bent)) & (np.diff(made.distance_m) > _LONG_M)
        )
        if self._on_the_spot or not len(uneven):
            return known
        share = np.arange(1.0, _SUBDIVIDED) / _SUBDIVIDED
        distance, parameter = (
            (each[uneven, None] + np.diff(each)[uneven, None] * share).ravel()
            for each in (made.distance_m, made.parameter)
        )
        bends = np.linalg.norm(self._path.chain.at(distance)[2], axis=1)
        whole = np.concatenate([known, np.column_stack([parameter, bends])])
        return np.asarray(whole[np.argsort(whole[:, 0])])

    def _error(self, made: FollowedPath) -> Numbers:
        """Distance [m] or angle [rad] `(k - 1,)` from the path in the middle between nodes.

        More than is allowed, too, where the joints' way is not known: near a singular pose the wrist may turn far while
        the TCP hardly moves.
        """
        middle = (made.parameter[:-1] + made.parameter[1:]) / 2.0
        place = made.pieces.position(middle)
        distance = place[:, -1] if self._on_the_spot else place[:, -2]
        poses = self._path.poses(distance)
        away = self._model.forward(place[:, :-2]) - poses
        turned = np.linalg.norm(away[:, :3, :3], axis=(1, 2)) / math.sqrt(2.0)
        chords = np.linalg.norm(np.diff(made.pieces.position(made.parameter)[:, :-2] / self._velocity, axis=0), axis=1)
        ways = np.diff(made.parameter)
        unknown = np.where(np.abs(ways - chords) > np.maximum(_CHORD * ways, _NO_WAY), _HALVED * _TOLERANCE, 0.0)
        return np.asarray(np.max([np.linalg.norm(away[:, :3, 3], axis=1), turned, unknown], axis=0))

    def _derivatives(
        self, nodes: Numbers, q: Numbers, twist: Numbers, change: Numbers, jacobian: Numbers
    ) -> tuple[Numbers, Numbers]:
        """First and second derivative `(k, n)` of the joints by the distance: J q' = twist, J q'' = twist' - J' q'."""
        inverse = self._inverse(nodes, jacobian)
        tangent = (inverse @ twist[..., None])[..., 0]
        drift = self._model.jacobian_derivative(q, tangent) @ tangent[..., None]
        return tangent, (inverse @ (change[..., None] - drift))[..., 0]

    def _inverse(self, nodes: Numbers, jacobian: Numbers) -> Numbers:
        """Joint velocities `(k, n, 6)` by twists; least squares for robots with fewer than six joints."""
        transposed = np.swapaxes(jacobian, -1, -2)
        matrix = jacobian if self._model.n == 6 else transposed @ jacobian
        try:
            inverse = np.linalg.inv(matrix)
            condition = np.linalg.norm(matrix, axis=(1, 2)) * np.linalg.norm(inverse, axis=(1, 2))
        except np.linalg.LinAlgError:
            inverse, condition = matrix, np.linalg.cond(matrix)
        if condition.max() > _SINGULAR:
            worst = int(np.argmax(condition))
            where, free = float(nodes[worst]), np.abs(np.linalg.svd(jacobian[worst])[2][-1])
            name = self._model.joint_names[int(np.argmax(np.round(free / self._velocity, 6)))]
            reason = f"the path passes exactly through a singular pose, where joint {name} would have to turn instantly"
            raise self._refuse(where, reason, _HINT, name, "velocity", self._path.poses(np.array([where]))[0])
        return np.asarray(inverse if self._model.n == 6 else inverse @ transposed, dtype=np.float64)


def _divided(nodes: Numbers, parts: Numbers) -> Numbers:
    """More nodes: each interval in so many equal parts `(k - 1,)`; the error of a piece falls with its sixth power."""
    count = np.maximum(parts, 1.0).astype(np.intp)
    first = np.repeat(nodes[:-1], count)
    number = np.arange(len(first)) - np.repeat(np.cumsum(count) - count, count)
    return np.append(first + number * np.repeat(np.diff(nodes) / count, count), nodes[-1])
