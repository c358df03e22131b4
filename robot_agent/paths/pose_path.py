"""A path of the TCP without a corner: curves that join smoothly, with the orientation along them."""

import math
from dataclasses import dataclass, replace

import numpy as np

from robot_agent.paths.chain import CurveChain
from robot_agent.paths.curves import Curve, Numbers, Polynomial, Trimmed, joining
from robot_agent.paths.fitted_orientation import FittedOrientation
from robot_agent.paths.junction import SHARPEST_RAD, TANGENT_RAD, Junction, via
from robot_agent.paths.legs import Leg, turn_before
from robot_agent.paths.orientation import Orientation, Turn, Window, swing
from robot_agent.paths.tangential import Tangential, aligned
from robot_agent.paths.transition import Transition

_SHARES = np.linspace(0.0, 1.0, 33)
"""Where a curve that joins two others is looked at."""
SMALLEST_EDGE_M = 1e-4
"""A robot that would go round a smaller edge all but stands there, and to stand in the corner is quicker."""
_LONGEST_BLEND_M = 0.05
_BLENDED = 1.0 / 64.0
"""How far a blend mostly leaves the curves, of the step of the curvature times the square of half its width."""
_LARGEST_SWING_RAD = 0.5
"""How far the turn taken over from a joint move may lead where it fades; a quarter of it is seen at the tool."""
_CURVATURE_STEP = 1e-6
_KINK_RAD = 1e-9
_SAME_TURN_RAD_M = 1e-9


@dataclass(frozen=True, slots=True, eq=False)
class PosePath:
    """TCP poses by distance 0 to `length_m`; for a turn on the spot the distance is the angle [rad]."""

    chain: CurveChain
    orientation: Orientation | Tangential | FittedOrientation
    moves: tuple[int, ...]
    move_ends_m: Numbers
    """`(len(moves),)` where each move ends."""
    transitions: tuple[Transition, ...]
    """Between its moves."""

    @property
    def length_m(self) -> float:
        return self.chain.length_m

    @property
    def borders_m(self) -> Numbers:
        """Rising distances at which the third derivative may jump, both ends included."""
        windows = [edge for window in self.orientation.windows for edge in (window.first_m, window.last_m)]
        inside = np.sort(np.concatenate([self.chain.starts_m, windows]))
        inside = inside[(inside > 1e-9) & (inside < self.length_m - 1e-9)]
        kept = inside[np.diff(inside, prepend=0.0) > 1e-7]
        return np.concatenate([[0.0], kept, [self.length_m]])

    def poses(self, distance_m: Numbers) -> Numbers:
        """`(m, 4, 4)` at distances `(m,)`."""
        return _poses(self.orientation.at(distance_m), self.chain.at(distance_m)[0])

    def states(self, distance_m: Numbers) -> tuple[Numbers, Numbers, Numbers]:
        """Poses as above; twist `(m, 6)` per distance, linear then angular in base axes; its derivative by distance."""
        place, tangent, curvature = self.chain.at(distance_m)
        rotation, spin, change = self.orientation.states(distance_m)
        twist = np.concatenate([tangent, spin], axis=1), np.concatenate([curvature, change], axis=1)
        return _poses(rotation, place), *twist


def _poses(rotation: Numbers, place: Numbers) -> Numbers:
    poses = np.zeros((len(place), 4, 4))
    poses[:, :3, :3], poses[:, :3, 3], poses[:, 3, 3] = rotation, place, 1.0
    return poses


def pose_paths(legs: list[Leg], blend_m: float) -> list[PosePath]:
    """Paths from consecutive legs: one as far as there is no corner that stays sharp.

    Blending a step of the curvature may leave the programmed curve by `blend_m`.
    """
    corners = [_corner(legs, number) for number in range(len(legs) - 1)]
    paths, first = [], 0
    for number in range(len(legs)):
        if number == len(legs) - 1 or corners[number] is None:
            group = legs[first : number + 1]
            paths += [_Assembly([turn], [], blend_m).path() for turn in turn_before(group[0])]
            paths.append(_Assembly(group, [each for each in corners[first:number] if each], blend_m).path())
            first = number + 1
    return paths


@dataclass(frozen=True, slots=True)
class _Corner:
    """Two legs that meet without a stop, and by how much the corner between them is cut; 0: they are tangential."""

    junction: Junction
    cut_m: float


def _corner(legs: list[Leg], number: int) -> _Corner | None:
    """How a leg and the next one meet; None where the robot stops or where the joints decide how they pass."""
    before, after = legs[number], legs[number + 1]
    if before.on_the_spot or after.on_the_spot or before.round_m == 0.0:
        return None
    if before.tangential_rad != after.tangential_rad or before.flips != after.flips:
        return None
    junction = Junction.of(before, after)
    if junction.turn_rad <= TANGENT_RAD:
        return _Corner(junction, 0.0)
    if before.round_m is None or before.smooth or after.smooth or junction.turn_rad > SHARPEST_RAD:
        return None
    cut_m = min(before.round_m, before.curve.length_m / 2.0, after.curve.length_m / 2.0)
    return _Corner(junction, cut_m) if cut_m > SMALLEST_EDGE_M else None


class _Assembly:
    """Puts legs and what joins them one after the other."""

    def __init__(self, legs: list[Leg], corners: list[_Corner], blend_m: float) -> None:
        self._legs, self._blend_m = legs, blend_m
        self._junctions = [each.junction for each in corners]
        self._cuts = [0.0, *[each.cut_m for each in corners], 0.0]
        self._curves: list[Curve] = []
        self._at = 0.0
        self._starts = [0.0]
        self._turns: list[Turn] = []
        self._windows: list[Window] = []
        self._sections: list[float] = []
        self._ends: dict[int, float] = {}
        self._met: dict[int, Transition] = {}
        self._vias: list[Transition] = []

    def path(self) -> PosePath:
        """The whole path."""
        bodies = [self._body(number) for number in range(len(self._legs))]
        trims = [0.0] * (len(bodies) + 1)
        made: list[Curve | None] = [None] * (len(bodies) + 1)
        for number in range(1, len(bodies)):
            made[number], trims[number] = self._connector(bodies, number)
        for number, (body, leg) in enumerate(zip(bodies, self._legs, strict=True)):
            first = 0.0 if self._cuts[number] else trims[number]
            last = body.length_m - (0.0 if self._cuts[number + 1] else trims[number + 1])
            self._turn_along(number, self._at - first, body.length_m)
            self._append(Trimmed(body, first, last))
            self._ends[leg.move] = self._at
            connector = made[number + 1]
            if connector is not None:
                before = self._at
                self._append(connector)
                self._ends[leg.move] = (before + self._at) / 2.0
                if self._cuts[number + 1]:
                    self._windows.append(Window(before, self._at))
        self._ends[self._legs[-1].move] = self._at
        chain = CurveChain(tuple(self._curves), np.array(self._starts))
        return PosePath(
            chain,
            self._orientation(chain),
            tuple(self._ends),
            np.array(list(self._ends.values())),
            (*self._met.values(), *self._vias),
        )

    def _orientation(self, chain: CurveChain) -> Orientation | Tangential:
        first = self._legs[0]
        if first.tangential_rad is None:
            return self._turning()
        start = aligned(first.turns[0].rotation, chain.at(np.zeros(1))[1, 0], first.tangential_rad)
        return Tangential(start, chain.at, self._at)

    def _turning(self) -> Orientation:
        turns, windows = _that_differ(self._turns, self._windows)
        before, behind = self._legs[0].first_turn, self._legs[-1].last_turn
        if before is not None:
            lead = _turning_at(turns[0], before, 0.0)
            wide = _wide(lead, turns[0], self._sections[0])
            self._vias += via(self._legs[0].move, lead, turns[0], swing(lead, turns[0], wide, one_sided=True))
            windows, turns = [Window(0.0, wide), *windows], [lead, *turns]
        if behind is not None:
            lead = _turning_at(turns[-1], behind, self._at)
            wide = _wide(lead, turns[-1], self._sections[-1])
            self._vias += via(self._legs[-1].move, turns[-1], lead, swing(turns[-1], lead, wide, one_sided=True))
            windows, turns = [*windows, Window(self._at - wide, self._at)], [*turns, lead]
        return Orientation(tuple(turns), tuple(windows))

    def _body(self, number: int) -> Trimmed:
        curve = self._legs[number].curve
        return Trimmed(curve, self._cuts[number], curve.length_m - self._cuts[number + 1])

    def _append(self, curve: Curve) -> None:
        if curve.length_m > 1e-12:
            self._curves.append(curve)
            self._at += curve.length_m
            self._starts.append(self._at)

    def _turn_along(self, number: int, offset_m: float, body_m: float) -> None:
        """The leg's turns; at plain borders a window as wide as both neighbours allow, on their own side each."""
        leg, cut = self._legs[number], self._cuts[number]
        begins, known = 0.0, len(self._turns)
        for turn, end in zip(leg.turns, leg.ends_m, strict=True):
            first, last = max(begins - cut, 0.0), min(end - cut, body_m)
            begins = end
            if last <= first and (len(self._turns) > known or end < leg.ends_m[-1]):
                continue
            half = (last - first) / 2.0
            if self._turns and len(self._windows) < len(self._turns):
                wide = min(half, self._sections[-1])
                border = offset_m + first
                self._windows.append(Window(border - wide, border + wide))
                self._report(number, turn, 2.0 * wide, inside=len(self._turns) > known)
            self._turns.append(replace(turn, anchor_m=offset_m - cut + turn.anchor_m))
            self._sections.append(half)

    def _report(self, number: int, turn: Turn, width_m: float, inside: bool) -> None:
        """How far the orientation leaves the programmed one where `turn` takes over, inside a leg or before it."""
        swing_rad = swing(self._turns[-1], turn, width_m)
        if inside:
            self._vias += via(self._legs[number].move, self._turns[-1], turn, swing_rad)
        else:
            self._met[number] = replace(self._met[number], deviation_rad=swing_rad)

    def _connector(self, bodies: list[Trimmed], number: int) -> tuple[Curve | None, float]:
        """What joins body number - 1 and the next: a round edge, a blend, or nothing; and what it takes from both."""
        before, after, cut = bodies[number - 1], bodies[number], self._cuts[number]
        junction = self._junctions[number - 1]
        if cut:
            edge = joining(before.at(np.array(before.length_m)), after.at(np.zeros(())), 2.0 * cut)
            corner = self._legs[number].curve.at(np.zeros(()))[0]
            passed = edge.derivative(_SHARES, 0) - corner
            self._met[number] = junction.rounded(cut, float(np.linalg.norm(passed, axis=1).min()))
            return edge, cut
        if junction.turn_rad <= _KINK_RAD and junction.curvature_step <= _CURVATURE_STEP:
            self._met[number] = junction.passed(0.0)
            return None, 0.0
        expected = math.sqrt(self._blend_m / (_BLENDED * max(junction.curvature_step, _CURVATURE_STEP)))
        wide = min(0.45 * before.length_m, 0.45 * after.length_m, _LONGEST_BLEND_M, expected)
        for _ in range(8):
            blend, away = _blended(before, after, wide)
            if away <= self._blend_m:
                break
            wide *= 0.95 * math.sqrt(self._blend_m / away)
        self._met[number] = junction.passed(away)
        return blend, wide


def _that_differ(turns: list[Turn], windows: list[Window]) -> tuple[list[Turn], list[Window]]:
    """The same without turns that only go on as the one before does: nothing passes into another there."""
    kept, between = turns[:1], []
    for window, turn in zip(windows, turns[1:], strict=True):
        if np.linalg.norm(turn.velocity - kept[-1].velocity) > _SAME_TURN_RAD_M:
            kept.append(turn)
            between.append(window)
    return kept, between


def _turning_at(turn: Turn, velocity: Numbers, distance_m: float) -> Turn:
    """A turn with the orientation of `turn` at a distance, and its own angular velocity `(3,)` [rad/m]."""
    rate = float(np.linalg.norm(velocity))
    axis = velocity / rate if rate > 0.0 else turn.axis
    return Turn(turn.at(np.array(distance_m)), axis, rate, distance_m)


def _wide(lead: Turn, turn: Turn, half_m: float) -> float:
    """How wide one turn passes into the other: at most `half_m`, less where that would swing the tool about."""
    step = float(np.linalg.norm(lead.velocity - turn.velocity))
    return min(half_m, _LARGEST_SWING_RAD / max(step, 1e-9))


def _blended(before: Trimmed, after: Trimmed, wide_m: float) -> tuple[Polynomial, float]:
    """What joins two curves from `wide_m` before their common end to `wide_m` after it; how far it leaves them [m]."""
    along = (2.0 * _SHARES - 1.0) * wide_m
    first, last = along[along < 0.0], along[along >= 0.0]
    nominal = np.concatenate([before.at(before.length_m + first), after.at(last)], axis=1)
    blend = joining(nominal[:, 0], nominal[:, -1], 2.0 * wide_m)
    return blend, _beside(blend.derivative(_SHARES, 0), *nominal)


def _beside(places: Numbers, curve: Numbers, tangents: Numbers, curvatures: Numbers) -> float:
    """The largest distance [m] of places `(k, 3)` from a curve, known at `(m, 3)` with its tangents and curvatures.

    Each place is compared with the nearest of these: where the curve turns back within a blend, the one that is as far
    along as the place may be somewhere else.
    """
    away = places[:, None] - curve
    nearest = np.einsum("kmx,kmx->km", away, away).argmin(axis=1)
    way, tangent = away[np.arange(len(places)), nearest], tangents[nearest]
    along = np.einsum("kx,kx->k", way, tangent)[:, None]
    way = way - along * tangent - 0.5 * along**2 * curvatures[nearest]
    return float(np.linalg.norm(way, axis=1).max())
