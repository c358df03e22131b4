"""From moves of the TCP to legs: one curve each, with the turns of the orientation along it."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from robot_agent.paths.arc import Arc, CircleGeometry, evenly_turned
from robot_agent.paths.curves import Curve, Numbers, Straight, bezier
from robot_agent.paths.errors import PathError
from robot_agent.paths.line import SAME_PLACE_M, Line, LineGeometry
from robot_agent.paths.orientation import Turn, axis_angle, is_half_turn, turn_between
from robot_agent.paths.spline import Spline, control_points, turns_back
from robot_agent.paths.tangential import STEEPEST, UP, aligned

_SAME_HEADING_RAD = 1e-9
_LOOKED_AT = 65
_NO_TURN_RAD = 1e-6
"""Less comes from rounding, where a point keeps its orientation."""

TcpMove = Line | Arc | Spline


@dataclass(frozen=True, slots=True, eq=False)
class Leg:
    """A part of move `move`: a curve and its turns, anchored by distance from the leg's beginning.

    A turn on the spot has no curve of its own: its `curve` stands still and its distance is the angle [rad].
    """

    move: int
    curve: Curve
    turns: tuple[Turn, ...]
    ends_m: tuple[float, ...]
    """Where each turn ends; the last at the end of the curve."""
    on_the_spot: bool
    smooth: bool
    """A spline, which has no corners to round."""
    round_m: float | None
    tangential_rad: float | None = None
    """The tool follows the curve at this angle; the only turn says where its tilt comes from."""
    first_turn: Numbers | None = None
    """`(3,)` [rad/m] at which the TCP arrives turning, where a spline takes it over from a joint move."""
    last_turn: Numbers | None = None
    """The same for a joint move after it."""
    flips: bool = False
    """The wrist may change its branch here, which holds for all of a path."""
    half_turn: bool = False
    """The tool makes half a turn at once, whose two ways are as long: `turn_between` chose."""


def legs(
    moves: Sequence[tuple[int, TcpMove]],
    start: Numbers,
    arrival: Numbers | None = None,
    departure: Numbers | None = None,
    following: TcpMove | None = None,
) -> list[Leg]:
    """The legs of consecutive moves (index, move) from TCP pose `start` `(4, 4)`; empty moves have none.

    `arrival` and `departure` are the twists `(6,)` per metre with which the robot comes to the first move and leaves
    the last one on joint moves; splines take them over. A spline at the end arrives as it does where the move
    `following` is one more move. Raises PathError.
    """
    if following is not None:
        last = moves[-1][0]
        try:
            whole = legs([*moves, (last + 1, following)], start, arrival)
        except PathError as error:
            if error.move <= last:
                raise
            return legs(moves, start, arrival)
        return [leg for leg in whole if leg.move <= last]
    made: list[Leg] = []
    pose, first = start, 0
    while first < len(moves):
        index, move = moves[first]
        if isinstance(move, Spline):
            last = first
            while last + 1 < len(moves) and _goes_on(move, moves[last + 1][1]):
                last += 1
            ahead = legs(moves[last + 1 : last + 2], _end_pose(moves[last][1]))
            comes = _arrival(made) if made else _direction(arrival)
            leaves = _departure(ahead) if last + 1 < len(moves) else _direction(departure)
            group = _spline(moves[first : last + 1], pose, comes, leaves)
            first, end = last, _leg_end(group[-1]) if group else pose
        else:
            group = _line(index, move, pose) if isinstance(move, Line) else _arc(index, move, pose)
            end = end_of(move, pose)
        if move.tangential_rad is not None:
            group = _following(group, move.tangential_rad, pose)
            end = _leg_end(group[-1]) if group else pose
        made += group
        pose = end
        first += 1
    if made and arrival is not None and _turns_freely(made[0]):
        made[0] = replace(made[0], first_turn=arrival[3:])
    if made and departure is not None and _turns_freely(made[-1]):
        made[-1] = replace(made[-1], last_turn=departure[3:])
    return made


def half_turns(moves: Sequence[tuple[int, TcpMove]], start: Numbers) -> set[int]:
    """The moves of `legs` in which the tool makes half a turn, whose two ways are as long. Raises PathError."""
    made = legs(moves, start)
    return {each.move for leg in made for each in (leg, *turn_before(leg)) if each.half_turn}


def _turns_freely(leg: Leg) -> bool:
    return leg.smooth and leg.tangential_rad is None


def _goes_on(spline: Spline, following: TcpMove) -> bool:
    return isinstance(following, Spline) and following.tangential_rad == spline.tangential_rad


def _following(group: list[Leg], angle_rad: float, start: Numbers) -> list[Leg]:
    """Legs with a tool that follows them; what only turned has nothing to follow. Raises PathError."""
    made: list[Leg] = []
    rotation = start[:3, :3]
    for leg in group:
        if leg.on_the_spot:
            continue
        tangents = leg.curve.at(np.linspace(0.0, leg.curve.length_m, _LOOKED_AT))[1]
        if np.abs(tangents[:, 2]).max() > STEEPEST:
            reason = "the path goes straight up or down, which gives the tool no direction to follow"
            raise PathError(leg.move, reason, "switch TANG off for this move, or let it go less steeply")
        followed = Turn(rotation, UP, 0.0, 0.0)
        ends_m = (leg.curve.length_m,)
        made.append(replace(leg, turns=(followed,), ends_m=ends_m, tangential_rad=angle_rad, half_turn=False))
        rotation = aligned(rotation, tangents[-1], angle_rad)
    return made


def turn_before(leg: Leg) -> list[Leg]:
    """The turn on the spot that brings the tool to where a tangential leg needs it; none where it is there."""
    if leg.tangential_rad is None:
        return []
    place, tangent, _ = leg.curve.at(np.zeros(()))
    rotation = leg.turns[0].rotation
    needed = aligned(rotation, tangent, leg.tangential_rad)
    axis, angle = turn_between(rotation, needed)
    turn = replace(_on_the_spot(leg.move, place, rotation, axis, angle), half_turn=is_half_turn(rotation, needed))
    return [turn] if angle > _SAME_HEADING_RAD else []


def end_of(move: TcpMove, start: Numbers) -> Numbers:
    """The pose `(4, 4)` in which a move ends that begins in `start`; without a way it stays in its place."""
    if isinstance(move, Arc) and (move.angle_rad is not None or move.lift_m != 0.0):
        try:
            made = _arc(0, move, start)
        except PathError:
            return start  # planning refuses this arc and names its line
        return _leg_end(made[0]) if made else start
    pose = _end_pose(move)
    if isinstance(move, Line):
        line = LineGeometry.between(start, pose)
        if line.length_m == 0.0:
            pose = start if line.is_empty else np.block([[pose[:3, :3], start[:3, 3:]], [np.eye(4)[3:]]])
    return pose


def _leg_end(leg: Leg) -> Numbers:
    pose = np.eye(4)
    length = np.array(leg.curve.length_m)
    place, tangent, _ = leg.curve.at(length)
    pose[:3, :3], pose[:3, 3] = leg.turns[-1].at(length), place
    if leg.tangential_rad is not None:
        pose[:3, :3] = aligned(pose[:3, :3], tangent, leg.tangential_rad)
    return pose


def _end_pose(move: TcpMove) -> Numbers:
    return np.asarray(move.poses[-1] if isinstance(move, Spline) else move.target_pose, dtype=np.float64)


def _line(index: int, move: Line, start: Numbers) -> list[Leg]:
    line = LineGeometry.between(start, move.target_pose)
    if line.is_empty:
        return []
    length, half = line.length_m, is_half_turn(start[:3, :3], move.target_pose[:3, :3])
    if length == 0.0:
        turn = _on_the_spot(index, start[:3, 3], start[:3, :3], line.axis, line.angle)
        return [replace(turn, flips=move.wrist_may_flip, half_turn=half)]
    even = Turn(start[:3, :3], line.axis, line.angle / length, 0.0)
    curve = Straight(start[:3, 3], line.displacement / length, length)
    flips = move.wrist_may_flip
    return [Leg(index, curve, (even,), (length,), False, False, move.round_m, flips=flips, half_turn=half)]


def _on_the_spot(index: int, place: Numbers, rotation: Numbers, axis: Numbers, angle: float) -> Leg:
    still = Straight(place, np.zeros(3), angle)
    return Leg(index, still, (Turn(rotation, axis, 1.0, 0.0),), (angle,), True, False, 0.0)


def _arc(index: int, move: Arc, start: Numbers) -> list[Leg]:
    points = [pose[:3, 3] for pose in (start, move.via_pose, move.target_pose)]
    geometry = CircleGeometry.through(*points)
    if geometry is None:
        places = "; ".join(" ".join(f"{1000.0 * value:.3f}" for value in point) for point in points)
        reason = f"start, via point and target of the arc, at {places} mm, lie on one line or coincide"
        raise PathError(index, reason, "move the via point away from the line, or use a line")
    angle = geometry.target_rad if move.angle_rad is None else move.angle_rad
    base = geometry.circle
    circle = type(base)(base.centre, base.u, base.v, base.radius_m, angle, move.lift_m)
    if circle.length_m <= SAME_PLACE_M:
        return []
    rotations = [pose[:3, :3] for pose in (start, move.via_pose, move.target_pose)]
    borders = [0.0, geometry.via_rad, geometry.target_rad]
    turns, ends = _turns_around(rotations, borders, angle, circle.length_m / abs(angle))
    half = _turns_half(start, move, beyond=not 0.0 < angle <= geometry.target_rad)
    return [Leg(index, circle, turns, ends, False, False, move.round_m, half_turn=half)]


def _turns_half(start: Numbers, move: Arc, beyond: bool) -> bool:
    """Whether an arc has half a turn at once: from point to point, or evenly over the via point.

    `beyond`: it passes what is left of the circle, too.
    """
    first, via, last = (pose[:3, :3] for pose in (start, move.via_pose, move.target_pose))
    if is_half_turn(first, via) or is_half_turn(via, last):
        return True
    if not is_half_turn(first, last):
        return False
    even = evenly_turned(start, move.via_pose, move.target_pose)[:3, :3]
    return beyond or bool(np.abs(even - via).max() < _NO_TURN_RAD)


def _turns_around(
    rotations: list[Numbers], borders: list[float], angle: float, way_m: float
) -> tuple[tuple[Turn, ...], tuple[float, ...]]:
    """Turns from point to point of a circle, in the direction of `angle`, for as many rounds as it has.

    `way_m` is that of one radian.
    """
    spans = [borders[1], borders[2] - borders[1], math.tau - borders[2]]
    order = [0, 1, 2] if angle > 0.0 else [2, 1, 0]
    turns: list[Turn] = []
    ends: list[float] = []
    done, step = 0.0, 0
    while done < abs(angle) - 1e-12:
        span = order[step % 3]
        before, after = (span, (span + 1) % 3) if angle > 0.0 else ((span + 1) % 3, span)
        axis, turn = turn_between(rotations[before], rotations[after])
        turns.append(Turn(rotations[before], axis, turn / (spans[span] * way_m), done * way_m))
        done = min(done + spans[span], abs(angle))
        ends.append(done * way_m)
        step += 1
    return tuple(turns), tuple(ends)


def _spline(
    moves: Sequence[tuple[int, TcpMove]], start: Numbers, arrival: Numbers | None, departure: Numbers | None
) -> list[Leg]:
    poses = [start]
    owners: list[tuple[int, float | None]] = [(moves[0][0], None)]
    for index, move in moves:
        if isinstance(move, Spline):
            for pose in move.poses:
                if np.linalg.norm(pose[:3, 3] - poses[-1][:3, 3]) > SAME_PLACE_M:
                    poses.append(pose)
                    owners.append((index, move.round_m))
                elif move.tangential_rad is None:
                    _refuse_turn(index, poses[-1], pose)
    if len(poses) < 2:
        return []
    controls = control_points(np.array([pose[:3, 3] for pose in poses]), arrival, departure)
    made = []
    for number, points in enumerate(controls):
        if turns_back(points):
            reason = "the spline turns back on itself on its way to this point"
            raise PathError(owners[number + 1][0], reason, "let it stop at the point before (R=0), or move one of them")
        curve = bezier(points)
        before, after = poses[number][:3, :3], poses[number + 1][:3, :3]
        axis, angle = turn_between(before, after)
        turn = Turn(before, axis, angle / curve.length_m, 0.0)
        index, round_m = owners[number + 1]
        stop = 0.0 if round_m == 0.0 and number == len(controls) - 1 else None
        half = is_half_turn(before, after)
        made.append(Leg(index, curve, (turn,), (curve.length_m,), False, True, stop, half_turn=half))
    return made


def _refuse_turn(index: int, before: Numbers, point: Numbers) -> None:
    """A spline's point where the one before is may be there twice, but not turned. Raises PathError."""
    angle = axis_angle(point[:3, :3] @ before[:3, :3].T)[1]
    if angle > _NO_TURN_RAD:
        reason = f"a point of the spline is where the one before it is, turned by {math.degrees(angle):.3g} deg"
        raise PathError(index, reason, "turn there with a line, or move the point: a spline does not turn on the spot")


def _direction(twist: Numbers | None) -> Numbers | None:
    return None if twist is None else twist[:3]


def _arrival(made: list[Leg]) -> Numbers | None:
    if not made or made[-1].on_the_spot:
        return None
    curve = made[-1].curve
    return np.asarray(curve.at(np.array(curve.length_m))[1])


def _departure(ahead: list[Leg]) -> Numbers | None:
    return None if not ahead or ahead[0].on_the_spot else ahead[0].curve.at(np.zeros(()))[1]
