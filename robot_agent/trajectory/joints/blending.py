"""One joint path out of two, where the robot need not stop between them."""

from dataclasses import replace

import numpy as np

from robot_agent.kinematics import Model
from robot_agent.paths.curves import hermite
from robot_agent.paths.junction import edge_text
from robot_agent.paths.pose_path import SMALLEST_EDGE_M
from robot_agent.paths.transition import Transition
from robot_agent.trajectory.joints.joint_junction import JointJunction
from robot_agent.trajectory.joints.joint_path import JointPath, Numbers, joined
from robot_agent.trajectory.joints.pieces import Pieces
from robot_agent.trajectory.joints.tcp_way import with_tcp, without_tcp
from robot_agent.trajectory.limits import Limits

_SMALLEST_CUT_S, _STANDS_M = 1e-5, 1e-9
"""Of the joints' way at full speed, where the TCP stands."""
_TCP_SAMPLES = 65
_BRIDGE_SAMPLES = 33


def blended(model: Model, limits: Limits, first: JointPath, second: JointPath) -> JointPath | Transition:
    """One path out of two that meet without a stop: tangential, or with a round edge; else why the robot stops."""
    junction = JointJunction.of(model, limits.velocity, first, second)
    if first.stops_for:
        return junction.stop(first.stops_for)
    if junction.smooth:
        return _told(joined(*_seen(model, first, second)), junction.passed(None))
    if junction.tangential:
        return _curvature_spread(model, *_seen(model, first, second), limits.shaping.blend_m, junction)
    if first.round_m is None:
        return junction.stop("there is no round edge")
    if junction.sharp:
        return junction.stop("too sharp for a round edge")
    return _rounded(model, *_seen(model, first, second), first.round_m, junction)


def _seen(model: Model, first: JointPath, second: JointPath) -> tuple[JointPath, JointPath]:
    """Both paths; where the limits of the TCP begin or end to hold between them, a joint move tells of it too."""
    if first.stretches[-1].on_path == second.stretches[0].on_path:
        return first, second
    if second.stretches[0].on_path:
        return _followed(model, first, end=True), second
    return first, _followed(model, second, end=False)


def _followed(model: Model, path: JointPath, end: bool) -> JointPath:
    """A path of joint moves that tells what the TCP does in its last or first piece."""
    knots = path.pieces.knots
    first, last = knots[-2:] if end else knots[:2]
    piece = path.pieces.part(float(first), float(last))
    joints = Pieces(piece.knots, piece.coefficients[:, :, : path.joints])
    known = replace(path, pieces=with_tcp(model, joints)[0])
    if len(knots) == 2:
        return known
    other = path.part(0.0, float(first)) if end else path.part(float(last), path.length)
    whole = joined(other, known) if end else joined(known, other)
    return replace(path, pieces=whole.pieces)


def _told(path: JointPath, transition: Transition) -> JointPath:
    return replace(path, transitions=(*path.transitions, transition))


def _rounded(
    model: Model, first: JointPath, second: JointPath, round_m: float, junction: JointJunction
) -> JointPath | Transition:
    """The corner cut where the TCP is `round_m` away from it, or half of the shorter move.

    Between two joint moves this is the quartic round edge, in joint space; both sides are cut by the same length of the
    joints' way, the shorter one deciding.
    """
    back = _tcp_way(model, first, first.length, (first.corner_lengths[1] + first.length) / 2.0)
    ahead = _tcp_way(model, second, 0.0, second.corner_lengths[0] / 2.0)
    cut = min(float(np.interp(round_m, side[1], side[0])) for side in (back, ahead))
    reach = min(float(side[1, -1]) if side[1, -1] > _STANDS_M else round_m for side in (back, ahead))
    cut_m = min(round_m, reach)
    if cut_m <= SMALLEST_EDGE_M or cut < _SMALLEST_CUT_S:
        return junction.stop(f"a stop is quicker than a {edge_text(round_m, cut_m)}")
    bridge = _bridge(model, first, second, cut)
    at = first.length - cut + np.linspace(0.0, 2.0 * cut, _BRIDGE_SAMPLES)
    passed = model.forward(bridge.pieces.position(at)[:, : first.joints])[:, :3, 3]
    corner = model.forward(first.end())[:3, 3]
    deviation_m = float(np.linalg.norm(passed - corner, axis=1).min())
    return _told(bridge, junction.rounded(round_m, cut_m, deviation_m))


def _curvature_spread(
    model: Model, first: JointPath, second: JointPath, blend_m: float, junction: JointJunction
) -> JointPath:
    """The step of the curvature spread over as much of both paths as the tolerance allows."""
    wide = 0.45 * min(first.length - first.corner_lengths[1], second.corner_lengths[0])
    for _ in range(8):
        bridge = _bridge(model, first, second, wide)
        away = _deviation(model, first, second, bridge, wide)
        if away <= blend_m:
            break
        wide *= min(0.7, 0.95 * float(np.sqrt(blend_m / away)))
    return _told(bridge, junction.passed(away))


def _bridge(model: Model, first: JointPath, second: JointPath, cut: float) -> JointPath:
    """The last `cut` of the first path and the first `cut` of the second replaced by a quintic with the same ends.

    Each half keeps the caps and limits of its move.
    """
    start, stop, length = first.length - cut, cut, 2.0 * cut
    scale = np.array([1.0, length, length**2])[:, None]
    shape = hermite(first.state(start) * scale, second.state(stop) * scale)
    joints = Pieces(np.array([0.0, length]), (shape / length ** np.arange(6.0)[:, None])[None])
    edges = first.stretches[-1], second.stretches[0]
    pieces, curvature = without_tcp(joints), np.zeros((0, 2))
    if any(edge.on_path or edge.capped for edge in edges):
        pieces, curvature = with_tcp(model, joints)
    halves = zip(edges, (length / 2.0, length), strict=True)
    stretches = tuple(replace(edge, end=end, inner=np.zeros(0)) for edge, end in halves)
    path = JointPath(pieces, stretches, curvature, (), (length, 0.0), None)
    whole = joined(joined(first.part(0.0, start), path), second.part(stop, second.length))
    head = min(first.corner_lengths[0], start)
    return replace(whole, corner_lengths=(head, whole.corner_lengths[1]))


def _tcp_way(model: Model, path: JointPath, corner: float, far: float) -> Numbers:
    """Distance by parameter and along the TCP's way `(2, k)` from the corner, rising."""
    at = np.linspace(corner, far, _TCP_SAMPLES)
    places = model.forward(path.pieces.position(at)[:, : path.joints])[:, :3, 3]
    steps = np.linalg.norm(np.diff(places, axis=0), axis=1)
    return np.stack([np.abs(at - corner), np.append(0.0, np.cumsum(steps))])


def _deviation(model: Model, first: JointPath, second: JointPath, bridge: JointPath, wide: float) -> float:
    """Largest distance [m] of the TCP from where it would be without the bridge, across its way."""
    along = np.linspace(-wide, wide, _BRIDGE_SAMPLES)
    start = first.length - wide
    cut = bridge.pieces.position(start + np.linspace(0.0, 2.0 * wide, _BRIDGE_SAMPLES))[:, : first.joints]
    before = first.pieces.position(first.length + np.minimum(along, 0.0))[:, : first.joints]
    after = second.pieces.position(np.maximum(along, 0.0))[:, : first.joints]
    nominal = np.where(along[:, None] < 0.0, before, after)
    way = model.forward(cut)[:, :3, 3] - model.forward(nominal)[:, :3, 3]
    along_way = np.gradient(model.forward(nominal)[:, :3, 3], axis=0)
    along_way /= np.maximum(np.linalg.norm(along_way, axis=1), 1e-12)[:, None]
    way = way - along_way * (way * along_way).sum(axis=1, keepdims=True)
    return float(np.linalg.norm(way, axis=1).max())
