"""Planning: moves of geometry become one motion within the limits, without a stop where none is needed."""

import math
from collections.abc import Callable, Iterable
from dataclasses import replace
from itertools import groupby, takewhile

import numpy as np
from numpy.typing import NDArray

from robot_agent.kinematics import Model
from robot_agent.paths import Arc, JointMove, Line, PathError, Sequence, Spline
from robot_agent.paths.caps import Tolerance
from robot_agent.paths.junction import edge_text
from robot_agent.paths.legs import TcpMove, legs
from robot_agent.paths.pose_path import PosePath, pose_paths
from robot_agent.paths.sequence import Move
from robot_agent.paths.smoothing import Entry, smoothed
from robot_agent.paths.transition import Continuity, Passing, Transition
from robot_agent.trajectory.assembly import Kept, assembled
from robot_agent.trajectory.errors import PlanError
from robot_agent.trajectory.inputs import check_poses_of, check_range, check_start, check_target
from robot_agent.trajectory.joints.blending import blended
from robot_agent.trajectory.joints.follow import follow
from robot_agent.trajectory.joints.joint_path import JointPath, Stretch
from robot_agent.trajectory.joints.pieces import Pieces
from robot_agent.trajectory.limits import Limits
from robot_agent.trajectory.motion import Motion
from robot_agent.trajectory.timing.axis_filter import filtered_onward
from robot_agent.trajectory.timing.continuation import Continuation, PathUnderWay
from robot_agent.trajectory.timing.dispatch import in_time
from robot_agent.trajectory.timing.independent import Independent
from robot_agent.trajectory.timing.optimal.onward import fastest_onward
from robot_agent.trajectory.timing.round_edges import halfway_s, slower_edges
from robot_agent.trajectory.timing.timed import Timed

_CAP_SAMPLES = 64
_MOST_TURN_RAD_M = 20.0
"""A joint move that turns the TCP more than this on its way has no direction that a spline could take over."""
_WAITS_S = (0.0, 0.05, 0.2)
"""How much longer the motion before stays as it is: tried one after the other until a way to go on is found."""
_BY_ITSELF = "where joints are not in step each arrives by itself"
_NO_TIMING = "no timing within the limits was found from where the motion was extended"
_KEPT = 1.01
"""Limits are kept by what was planned with them up to this factor at least."""
_WORTH_PLANNING = 0.02
"""A motion with many round edges is planned again with stops where these win more than this share of it."""
_CLEARLY_S = 0.02
"""Among many edges one counts where a stop seems to be so much quicker."""
_FEW_EDGES, _ROUNDING_S = 2, 5e-4
"""With so few it is always planned again with stops, and the quickest is taken to some such time."""
_Timed = tuple[list[JointPath | Independent], list[Timed]]
"""Paths and their times."""


def plan(
    model: Model, sequence: Sequence, limits: Limits, start: NDArray[np.float64] | Continuation, cycle_s: float = 0.004
) -> Motion:
    """The motion through all moves of `sequence` from rest at joints `start` `(n,)` to rest.

    From a state of another motion it goes on: first through what is left of that motion, whose moves come before those
    of `sequence` in the result, and its tau 0 is the tau of the state. What it replaces stays valid: it ends at rest.
    Where the joints cannot go on in motion, because each of them goes by itself or because no timing is found within
    the limits, they rest where that motion does, and `transitions` says why.

    It rests between moves only where they do not meet tangentially and have no round edge. `cycle_s` is the period of
    the set points. Raises PlanError with move, program line, reason and, where they apply, joint, limit and pose;
    ValueError for a period that is none.
    """
    if not 0.0 < cycle_s < math.inf:
        raise ValueError(f"plan: cycle_s {cycle_s} found, allowed a finite time above 0")
    paths = _Paths(model, sequence, limits)
    if isinstance(start, Continuation):
        return _onward(model, paths, limits, start, cycle_s)
    start = np.array(start, dtype=np.float64)
    check_start(model, sequence.moves[0], start)

    def timed(paths: _Paths) -> _Timed:
        runs = paths.runs(start)
        return runs, in_time(model, runs, limits)

    runs, times = _without_slow_edges(paths, timed(paths), timed)
    return assembled(model, Kept.nothing(start), len(sequence), runs, times, cycle_s)


def _without_slow_edges(
    paths: "_Paths", rounded: _Timed, timed: Callable[["_Paths"], _Timed], known: int = 0
) -> _Timed:
    """Paths with stops in place of the round edges that are slower than these, as far as that is worth while.

    `known` is how many moves come before those of `paths`.
    """
    slow = [
        each
        for run in rounded[0]
        for each in run.transitions
        if each.passing is Passing.ROUNDED and each.before >= known
    ]
    few = len(slow) <= _FEW_EDGES
    if not few:
        clearly = [
            each
            for run, time in zip(*rounded, strict=True)
            if isinstance(run, JointPath)
            for each in paths.slower_edges(run, time)
            if each[0].before >= known and each[1] > _CLEARLY_S
        ]
        if sum(gain_s for _, gain_s in clearly) <= _WORTH_PLANNING * _lasting_s(rounded):
            return rounded
        slow = [corner for corner, _ in clearly]
    if not slow:
        return rounded
    stopped = timed(paths.stopping(corner.before - known for corner in slow))
    at, resting = halfway_s(*rounded), halfway_s(*stopped)
    won_s = {
        each.before - known: at[each.move] - at[each.before] - (resting[each.move] - resting[each.before])
        for each in slow
    }
    lost_s = -sum(won for won in won_s.values() if won < 0.0)
    again = [stopped]
    if lost_s > (_ROUNDING_S if few else _WORTH_PLANNING * _lasting_s(stopped)) and max(won_s.values()) > 0.0:
        again.append(timed(paths.stopping(move for move, won in won_s.items() if won > 0.0)))
    return min(rounded, *again, key=_lasting_s)


def _lasting_s(planned: _Timed) -> float:
    return sum(time.pieces.duration_s for time in planned[1])


def _onward(model: Model, paths: "_Paths", limits: Limits, start: Continuation, cycle_s: float) -> Motion:
    known = len(start.ends)
    stop: tuple[Transition, ...] = ()
    if known > 0 and start.run is None:
        stop = (Transition(known - 1, known, Continuity.C0, Passing.STOPS, _BY_ITSELF),)
    for wait_s in _WAITS_S if start.filter_s == limits.shaping.filter_s else ():
        going = start.going(wait_s)
        if going is None:
            continue
        runs = paths.runs(going.path.end(), going.path, known)
        first = runs[0]
        if first is going.path or not isinstance(first, JointPath):
            stop = runs[1].transitions[:1] if len(runs) > 1 else ()
            break  # the robot stops where the new moves begin
        met = [each for each in first.transitions if each.before < known == each.move]
        stop = tuple(Transition(known - 1, known, each.continuity, Passing.STOPS, _NO_TIMING) for each in met)
        rounded = _timed_with(model, limits, going, runs)
        if rounded is not None:

            def timed(paths: _Paths, going: PathUnderWay = going, otherwise: _Timed = rounded) -> _Timed:
                runs = paths.runs(going.path.end(), going.path, known)
                return _timed_with(model, limits, going, runs) or otherwise

            runs, times = _without_slow_edges(paths, rounded, timed, known)
            return assembled(model, Kept.of(start, going.after_s), known + paths.moves, runs, times, cycle_s)
    acceleration = np.abs(limits.acceleration_bounds).max(axis=0)
    if (start.left.peaks() > _KEPT * np.stack([limits.velocity, acceleration, limits.jerk])).any():
        raise paths.refused("the moves before it do not keep these limits", "let the motion end first")
    whole_s = start.left.duration_s
    runs = paths.runs(start.left.position(np.array(whole_s)), moves=known)
    times = in_time(model, runs, limits)
    runs[:1] = [replace(run, transitions=(*stop, *run.transitions)) for run in runs[:1]]
    return assembled(model, Kept.of(start, whole_s), known + paths.moves, runs, times, cycle_s)


def _timed_with(
    model: Model, limits: Limits, going: PathUnderWay, runs: list[JointPath | Independent]
) -> _Timed | None:
    """Paths of which the first is under way, over time; None where no timing is found from its state."""
    first = runs[0]
    if not isinstance(first, JointPath):
        return None
    timed = in_time(model, [first], limits)[0] if going.stands else _timed_onward(model, first, limits, going)
    return None if timed is None else (runs, [timed, *in_time(model, runs[1:], limits)])


def _timed_onward(model: Model, path: JointPath, limits: Limits, going: PathUnderWay) -> Timed | None:
    """Joints over time from a state in motion to rest, with the filter; None where no timing is found."""
    timed = fastest_onward(model, path, limits, going)
    if timed is None or going.raw is None:
        return timed
    return filtered_onward(model, path.stretches, timed, going.raw, going.raw_s, limits)


class _Paths:
    """From moves to joint paths that begin and end at rest."""

    def __init__(self, model: Model, sequence: Sequence, limits: Limits, stops: frozenset[int] = frozenset()) -> None:
        """With a stop in place of the round edge after each of the moves `stops`."""
        self._beyond, self._aimed = sequence.beyond, sequence.aimed
        self._model, self._sequence, self._limits, self._stops = model, sequence, limits, stops
        self._moves = tuple(
            replace(move, round_m=0.0) if number in stops else move for number, move in enumerate(sequence.moves)
        )

    def slower_edges(self, path: JointPath, timed: Timed) -> list[tuple[Transition, float]]:
        """The round edges of a path that seem to take longer than a stop, and by how much [s]."""
        return slower_edges(self._model, path, timed, self._limits)

    def stopping(self, stops: Iterable[int]) -> "_Paths":
        """The same with a stop in place of the round edge after each of the moves `stops`."""
        return _Paths(self._model, self._sequence, self._limits, frozenset(stops))

    @property
    def moves(self) -> int:
        """Number of moves."""
        return len(self._moves)

    def refused(self, reason: str, hint: str) -> PlanError:
        """What is wrong where the first move begins."""
        return PlanError(0, self._moves[0].line, reason, hint)

    def runs(
        self, start: NDArray[np.float64], known: JointPath | None = None, moves: int = 0
    ) -> list[JointPath | Independent]:
        """The paths from rest to rest; the first begins with the path `known`, which has so many moves."""
        made: list[JointPath | Independent] = [] if known is None else [known]
        for path in self._paths(start, known):
            path = path.later(moves)
            passed = self._junction(made[-1], path) if made else path
            if isinstance(passed, Transition):
                made.append(replace(path, transitions=(passed, *path.transitions)))
            else:
                made[-1:] = [passed]
        return made

    def _junction(
        self, before: JointPath | Independent, path: JointPath | Independent
    ) -> JointPath | Independent | Transition:
        """Both in one, or the stop between them."""
        if isinstance(before, JointPath) and isinstance(path, JointPath):
            return blended(self._model, self._limits, before, path)
        moves = before.stretches[-1].move, path.stretches[0].first_move
        return Transition(*moves, Continuity.C0, Passing.STOPS, _BY_ITSELF)

    def _paths(self, q: NDArray[np.float64], known: JointPath | None) -> list[JointPath | Independent]:
        made: list[JointPath | Independent] = []
        numbered = list(enumerate(self._moves))
        for on_path, group in groupby(numbered, key=lambda each: not isinstance(each[1], JointMove)):
            if on_path:
                tcp_moves = [(index, move) for index, move in group if not isinstance(move, JointMove)]
                for moves in _by_tolerance(tcp_moves):
                    before = made[-1] if made else known
                    start = before.end() if made and before is not None else q
                    along = self._followed if _tolerance(moves[0][1]) is None else self._smoothed
                    made += along(moves, start, before)
            else:
                for index, move in group:
                    if isinstance(move, JointMove):
                        path = self._joint_move(index, move, made[-1].end() if made else q)
                        made += [path] if path is not None else []
            q = made[-1].end() if made else q
        return made

    def _followed(
        self, moves: list[tuple[int, TcpMove]], q: NDArray[np.float64], before: JointPath | Independent | None
    ) -> list[JointPath]:
        """Moves of the TCP from joints `q` `(n,)`; a spline takes its direction from joint moves at its ends too."""
        arrival = None
        if isinstance(before, JointPath) and not before.stops_for:
            arrival = self._direction(q, before.state(before.length)[1])
        made: list[JointPath] = []
        for path in self._tcp_paths(moves, q, arrival, None):
            made.append(self._follow(path, made[-1].end() if made else q))
        departure = self._departure(moves[-1][0], made[-1].end()) if made else None
        if departure is not None:
            last = self._tcp_paths(moves, q, arrival, departure)[-1]
            made[-1] = self._follow(last, made[-2].end() if len(made) > 1 else q)
        return made

    def _smoothed(
        self, moves: list[tuple[int, TcpMove]], q: NDArray[np.float64], before: JointPath | Independent | None
    ) -> list[JointPath]:
        """Lines and arcs of one tolerance from joints `q` `(n,)`, on smooth curves from corner to corner."""
        for index, move in moves:
            check_poses_of(index, move)
        first, last = moves[0][0], moves[-1][0]
        start = self._model.forward(q)
        aimed = start if self._aimed is None or first > 0 else self._aimed
        ahead = [*self._moves[last + 1 :], *self._beyond] if moves[-1][1].round_m is None else []
        beyond = list(takewhile(lambda each: _tolerance(each) == moves[-1][1].tolerance, ahead))
        entry = self._entry(before) if isinstance(before, JointPath) and not before.stops_for else None
        lines = [(index, move) for index, move in moves if isinstance(move, Line | Arc)]
        onward = [each for each in beyond if isinstance(each, Line | Arc)]
        try:
            paths = smoothed(lines, aimed, start, entry, onward, self._limits.shaping.blend_m)
        except PathError as error:
            raise PlanError(error.move, self._moves[error.move].line, error.reason, error.hint) from error
        made: list[JointPath] = []
        for path in paths:
            made.append(self._follow(path, made[-1].end() if made else q))
        return made

    def _entry(self, before: JointPath) -> Entry | None:
        """How the TCP goes at the end of a path, by its way; None where it hardly moves."""
        q, first, second = before.state(before.length)
        jacobian = self._model.jacobian(q)
        twist = jacobian @ first
        growth = jacobian @ second + self._model.jacobian_derivative(q[None], first[None])[0] @ first
        speed = float(np.linalg.norm(twist[:3]))
        if speed * _MOST_TURN_RAD_M <= np.linalg.norm(twist[3:]):
            return None
        rate = twist / speed
        bend = (growth - rate * (rate[:3] @ growth[:3])) / speed**2
        return Entry(rate[:3], bend[:3], rate[3:], bend[3:])

    def _departure(self, index: int, q: NDArray[np.float64]) -> NDArray[np.float64] | None:
        """The direction in which a joint move goes on after move `index`, a spline that ends at joints `q` `(n,)`."""
        following = self._after_spline(index)
        if self._moves[index].round_m == 0.0 or not isinstance(following, JointMove) or not following.synchronised:
            return None
        check_target(self._model, index + 1, following)
        return self._direction(q, following.target - q)

    def _after_spline(self, index: int) -> Move | None:
        """The move after move `index`, beyond the sequence too, where that is a spline."""
        following = [*self._moves, *self._beyond][index + 1 : index + 2]
        return following[0] if following and isinstance(self._moves[index], Spline) else None

    def _direction(self, q: NDArray[np.float64], way: NDArray[np.float64]) -> NDArray[np.float64] | None:
        """The TCP's twist `(6,)` per metre when the joints leave `q` `(n,)` along `way`; None if it hardly moves."""
        twist = self._model.jacobian(q) @ way
        speed = float(np.linalg.norm(twist[:3]))
        return twist / speed if speed * _MOST_TURN_RAD_M > np.linalg.norm(twist[3:]) else None

    def _tcp_paths(
        self,
        moves: list[tuple[int, TcpMove]],
        q: NDArray[np.float64],
        arrival: NDArray[np.float64] | None,
        departure: NDArray[np.float64] | None,
    ) -> list[PosePath]:
        for index, move in moves:
            check_poses_of(index, move)
        last = moves[-1][0]
        beyond = self._after_spline(last) if last + 1 == self.moves else None
        following = None if isinstance(beyond, JointMove) else beyond
        try:
            made = legs(moves, self._model.forward(q), arrival, departure, following)
            return pose_paths(made, self._limits.shaping.blend_m)
        except PathError as error:
            raise PlanError(error.move, self._moves[error.move].line, error.reason, error.hint) from error

    def _follow(self, path: PosePath, start: NDArray[np.float64]) -> JointPath:
        def refuse(
            at_m: float,
            reason: str,
            hint: str,
            joint: str | None,
            limit: str | None,
            pose: NDArray[np.float64] | None,
        ) -> PlanError:
            move = path.moves[min(int(np.searchsorted(path.move_ends_m, at_m)), len(path.moves) - 1)]
            return PlanError(move, self._moves[move].line, reason, hint, joint, limit, pose)

        flips = any(isinstance(b := self._moves[k], Line) and b.wrist_may_flip for k in path.moves)
        made = follow(self._model, path, start, self._limits.velocity, flips, refuse)
        ends = made.passing(path.move_ends_m)
        stretches = self._stretches(path.moves, ends)
        corners = float(ends[0]), float(ends[-2]) if len(ends) > 1 else 0.0
        last = self._moves[path.moves[-1]]
        stops = last.round_m, self._stops_for(path.moves[-1])
        return JointPath(made.pieces, stretches, made.curvature, path.transitions, corners, *stops)

    def _stretches(self, moves: tuple[int, ...], ends: NDArray[np.float64]) -> tuple[Stretch, ...]:
        """One for each move, which end at parameters `ends` `(k,)`; one for all that share caps within a tolerance."""
        made: list[Stretch] = []
        for numbers in _alike(self._moves, moves, ends):
            last = numbers[-1]
            stretch = _stretch(float(ends[last]), moves[last], self._moves[moves[last]], 1.0, on_path=True)
            made.append(replace(stretch, inner=ends[numbers[:-1]]))
        return tuple(made)

    def _joint_move(self, index: int, move: JointMove, start: NDArray[np.float64]) -> JointPath | Independent | None:
        """A straight line in joint space, or every joint by itself; None where it goes nowhere."""
        check_target(self._model, index, move)
        travel = move.target - start
        moving = np.abs(travel) > 1e-12
        check_range(self._model, index, move, moving)
        if not moving.any():
            return None
        length = float(np.linalg.norm(travel / self._limits.velocity))
        stretch = _stretch(length, index, move, move.speed, on_path=False)
        if not move.synchronised:
            return Independent(start, np.asarray(move.target, dtype=np.float64), stretch)
        pieces = self._straight(start, travel, length, capped=stretch.capped)
        return JointPath(pieces, (stretch,), np.zeros((0, 2)), (), (length, 0.0), move.round_m, self._stops_for(index))

    def _stops_for(self, index: int) -> str:
        """Why the robot stops after a move in any case; empty where the move leaves that to what follows."""
        move = self._moves[index]
        if not isinstance(move, JointMove) and move.tangential_rad is not None:
            return "the tool follows the path up to there and may have to turn"
        if index in self._stops:
            asked_m = self._sequence.moves[index].round_m or 0.0
            return f"a stop is quicker than a {edge_text(asked_m, asked_m)}"
        return "a round edge of 0 asks for a stop" if move.round_m == 0.0 else ""

    def _straight(self, start: NDArray[np.float64], travel: NDArray[np.float64], length: float, capped: bool) -> Pieces:
        """The joints evenly along their way; with the TCP's way and turn where these have a cap."""
        share = np.linspace(0.0, 1.0, _CAP_SAMPLES + 1 if capped else 2)
        q, qd = start + share[:, None] * travel, np.tile(travel / length, (len(share), 1))
        way = np.zeros((len(share), 2))
        if capped:
            twist = (self._model.jacobian(q) @ qd[..., None])[..., 0]
            way = np.stack([np.linalg.norm(twist[:, :3], axis=1), np.linalg.norm(twist[:, 3:], axis=1)], axis=1)
        step = length / (len(share) - 1)
        covered = np.concatenate([np.zeros((1, 2)), np.cumsum(step * (way[1:] + way[:-1]) / 2.0, axis=0)])
        change = np.gradient(way, step, axis=0)
        return Pieces.through(
            share * length,
            np.column_stack([q, covered]),
            np.column_stack([qd, way]),
            np.column_stack([np.zeros_like(q), change]),
        )


def _tolerance(move: Move) -> Tolerance | None:
    """Of a line or an arc whose tool does not follow the path and whose wrist does not flip."""
    if not isinstance(move, Line | Arc) or move.tangential_rad is not None:
        return None
    return None if isinstance(move, Line) and move.wrist_may_flip else move.tolerance


def _by_tolerance(moves: list[tuple[int, TcpMove]]) -> list[list[tuple[int, TcpMove]]]:
    """Consecutive moves with the same tolerance, or with none; within one a move with R is the last."""
    made: list[list[tuple[int, TcpMove]]] = []
    for index, move in moves:
        before = made[-1][-1][1] if made else None
        own = _tolerance(move)
        if before is None or own != _tolerance(before) or (own is not None and before.round_m is not None):
            made.append([])
        made[-1].append((index, move))
    return made


def _alike(moves: tuple[Move, ...], numbers: tuple[int, ...], ends: NDArray[np.float64]) -> list[list[int]]:
    """Places in `numbers` of moves that share one stretch: neighbours within a tolerance that have the same caps.

    A move of no length goes with the next one.
    """
    made: list[list[int]] = []
    caps: object = None
    at = 0.0
    for place, (number, end) in enumerate(zip(numbers, ends.tolist(), strict=True)):
        move = moves[number]
        own = (move.speed_m_s, move.rotation_rad_s, move.joint_speed_rad_s)
        follows = bool(made) and number == numbers[place - 1] + 1
        if follows and _tolerance(move) is not None and (own == caps or at == 0.0):
            made[-1].append(place)
        else:
            made.append([place])
        caps, at = own, end
    return made


def _stretch(end: float, index: int, move: Move, joint_speed: float, on_path: bool) -> Stretch:
    speed = np.inf if move.speed_m_s is None else move.speed_m_s
    rotation = np.inf if move.rotation_rad_s is None else move.rotation_rad_s
    joints = np.inf if move.joint_speed_rad_s is None else move.joint_speed_rad_s
    return Stretch(end, index, joint_speed, speed, rotation, on_path, joints)
