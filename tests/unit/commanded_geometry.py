"""Where the flange has to be: the geometry that the moves of a sequence command, from the moves alone."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from itertools import groupby, pairwise

import numpy as np

from robot_agent.kinematics import Model
from robot_agent.model.description import DEFAULT_SHAPING
from robot_agent.paths import JointMove, Passing, Sequence, Spline
from robot_agent.paths.legs import legs
from robot_agent.paths.pose_path import PosePath, pose_paths
from robot_agent.trajectory import Motion

_COARSE_M, _FINER = 5e-4, np.linspace(0.0, 1.0, 17)
_ROUNDS = 3
"""Each makes the step of the search eight times smaller: below 1 um at last."""
_MOST_TURN_RAD_M = 20.0
"""A joint move that turns the flange more than this on its way gives a spline no direction."""
_BULGE = 1.1
"""A corner that the joints round may leave the sphere around it by this factor."""


@dataclass(frozen=True, slots=True, eq=False)
class Curve:
    """Places `(k, 3)` of the flange at `(k,)` numbers from `first` to `last`, about `length_m` long.

    Curves of one `path` pass into each other with their round edges and blends.
    """

    path: object
    at: Callable[[np.ndarray], np.ndarray]
    first: float
    last: float
    length_m: float

    def distances(self, places: np.ndarray) -> np.ndarray:
        """`(m,)` [m] from places `(m, 3)` to the nearest point of the curve."""
        s = np.linspace(self.first, self.last, int(self.length_m / _COARSE_M) + 2)
        known, step = self.at(s), s[1] - s[0]
        nearest = s[((places[:, None] - known) ** 2).sum(axis=2).argmin(axis=1)]
        for _ in range(_ROUNDS):
            low, high = (np.clip(nearest + side * step, self.first, self.last) for side in (-1.0, 1.0))
            tried = low[:, None] + (high - low)[:, None] * _FINER
            away = np.linalg.norm(self.at(tried.ravel()).reshape(*tried.shape, 3) - places[:, None], axis=2)
            best = away.argmin(axis=1)
            nearest, step = tried[np.arange(len(tried)), best], step / 8.0
        return away.min(axis=1)


def stopping_as(motion: Motion, sequence: Sequence) -> Sequence:
    """The same moves without the round edges in place of which the motion stops, because that is quicker."""
    stops = {each.before for each in motion.transitions if each.passing is Passing.STOPS}
    return Sequence(
        replace(move, round_m=0.0) if number in stops and move.round_m else move
        for number, move in enumerate(sequence.moves)
    )


def curves(model: Model, sequence: Sequence, start: np.ndarray) -> list[list[Curve]]:
    """What each move commands; moves of the flange with their round edges and blends."""
    made: list[list[Curve]] = [[] for _ in sequence.moves]
    q, arrival = start, None
    for joint_move, group in groupby(enumerate(sequence.moves), key=lambda each: isinstance(each[1], JointMove)):
        if not joint_move:
            moves, pose = list(group), model.forward(q)
            for path in pose_paths(legs(moves, pose, arrival), DEFAULT_SHAPING.blend_m):
                q = model.track(path.poses(np.linspace(0.0, path.length_m, int(100 * path.length_m) + 200)), q)[-1]
            last, following = moves[-1][0], sequence.moves[moves[-1][0] + 1 : moves[-1][0] + 2]
            goes_on = following and isinstance(sequence.moves[last], Spline) and sequence.moves[last].round_m != 0.0
            departure = direction(model, q, following[0].target - q) if goes_on else None
            for path in pose_paths(legs(moves, pose, arrival, departure), DEFAULT_SHAPING.blend_m):
                begins = 0.0
                for move, end in zip(path.moves, path.move_ends_m, strict=True):
                    made[move].append(Curve(path, partial(places_on, path), begins, end, end - begins))
                    begins = end
            continue
        for number, move in group:
            at = partial(places_between, model, q, move.target)
            length_m = float(np.linalg.norm(np.diff(at(_FINER), axis=0), axis=1).sum())
            made[number].append(Curve(move, at, 0.0, 1.0, length_m))
            arrival = None if move.round_m == 0.0 else direction(model, move.target, move.target - q)
            q = move.target
    return made


def direction(model: Model, q: np.ndarray, way: np.ndarray) -> np.ndarray | None:
    """The flange's twist `(6,)` per metre when the joints pass `q` on `way`; None where it mostly turns."""
    twist = model.jacobian(q) @ way
    speed = np.linalg.norm(twist[:3])
    return twist / speed if _MOST_TURN_RAD_M * speed > np.linalg.norm(twist[3:]) else None


def places_on(path: PosePath, distance_m: np.ndarray) -> np.ndarray:
    return path.chain.at(distance_m)[0]


def places_between(model: Model, q: np.ndarray, target: np.ndarray, share: np.ndarray) -> np.ndarray:
    return model.forward(q + np.outer(share, target - q))[:, :3, 3]


def corners(sequence: Sequence, commanded: list[list[Curve]]) -> dict[int, tuple[np.ndarray, float]]:
    """Where joints may round the corner after a move: place and radius [m]; the flange's own edges are curves."""
    found = {}
    for number, (before, after) in enumerate(pairwise(commanded)):
        end, move = before[-1], sequence.moves[number]
        if move.round_m and end.path is not after[0].path:
            found[number] = end.at(np.array([end.last]))[0], move.round_m
    return found


def outside_of_corners(sequence: Sequence, commanded: list[list[Curve]], motion: Motion, each: int) -> list[np.ndarray]:
    """For each move up to `each` taus, evenly spread, at which the flange is not in a corner that the joints round.

    Inside of such a corner there is no curve to compare with.
    """
    rounded, begins, taus = corners(sequence, commanded), 0.0, []
    for move, ends in enumerate(motion.ends):
        tau = begins + (ends - begins) * (np.arange(each) + 0.5) / each
        places = motion.pose(tau)[:, :3, 3]
        outside = np.ones(each, dtype=bool)
        for number in {move - 1, move} & rounded.keys():
            corner, radius_m = rounded[number]
            outside &= np.linalg.norm(places - corner, axis=1) > _BULGE * radius_m
        taus.append(tau[outside])
        begins = ends
    return taus


def deviations_m(commanded: list[list[Curve]], motion: Motion, taus: list[np.ndarray]) -> np.ndarray:
    """Largest distance `(moves,)` [m] of the flange at `taus` of each move from what it or one beside it commands."""
    worst = np.zeros(len(taus))
    for move, tau in enumerate(taus):
        places, away = motion.pose(tau)[:, :3, 3], np.full(len(tau), np.inf)
        for number in (move, move - 1, move + 1):
            far = away > 1e-6
            if far.any() and 0 <= number < len(commanded):
                own = [curve.distances(places[far]) for curve in commanded[number]]
                away[far] = np.minimum(away[far], np.min(own, axis=0))
        worst[move] = away.max(initial=0.0)
    return worst


def blended_m(commanded: list[list[Curve]], motion: Motion) -> np.ndarray:
    """How far `(moves,)` [m] a motion says that its joints leave each move to pass into another path smoothly."""
    told = np.zeros(len(commanded))
    for each in motion.transitions:
        apart = commanded[each.before][-1].path is not commanded[each.move][0].path
        if each.passing is Passing.BLENDED and apart:
            both = [each.before, each.move]
            told[both] = np.maximum(told[both], each.deviation_m)
    return told
