"""A path of the flange without a corner: curves that join smoothly, with the orientation along them."""

from dataclasses import dataclass, replace

import numpy as np

from robot_agent.paths.chain import Chain
from robot_agent.paths.curves import Curve, Numbers, Trimmed, joining
from robot_agent.paths.legs import Leg, turn_before
from robot_agent.paths.orientation import Orientation, Turn, Window
from robot_agent.paths.tangential import Tangential, aligned

TANGENT_RAD = 2e-3
"""Directions that differ by less are one: blending takes care of the rest."""
BLEND_TOLERANCE_M = 1e-4
"""How far blending a step of the curvature may leave the programmed curve."""
_SHARPEST_RAD = np.radians(150.0)
"""A corner that turns back more than this is not rounded: its edge would be so tight that stopping is faster."""
_LONGEST_BLEND_M = 0.05
_LARGEST_SWING_RAD = 0.5
"""How far the turn taken over from a joint move may lead where it fades; a quarter of it is seen at the tool."""
_CURVATURE_STEP = 1e-6
_KINK_RAD = 1e-9


@dataclass(frozen=True, slots=True)
class Blend:
    """Where a path leaves the programmed curve to join two blocks: the later block, and how far at most [m]."""

    block: int
    deviation_m: float


@dataclass(frozen=True, slots=True, eq=False)
class PosePath:
    """Flange poses by distance 0 to `length_m`; for a turn on the spot the distance is the angle [rad]."""

    chain: Chain
    orientation: Orientation | Tangential
    blocks: tuple[int, ...]
    block_ends_m: Numbers
    """`(len(blocks),)` where each block ends."""
    blends: tuple[Blend, ...]

    @property
    def length_m(self) -> float:
        return self.chain.length_m

    @property
    def borders_m(self) -> Numbers:
        """Rising distances at which the third derivative may jump, both ends included."""
        windows = [edge for window in self.orientation.windows for edge in (window.first_m, window.last_m)]
        inside = np.unique(np.concatenate([self.chain.starts_m, windows]))
        inside = inside[(inside > 1e-9) & (inside < self.length_m - 1e-9)]
        kept = inside[np.diff(inside, prepend=0.0) > 1e-7]
        return np.concatenate([[0.0], kept, [self.length_m]])

    def poses(self, distance_m: Numbers) -> Numbers:
        """`(m, 4, 4)` at distances `(m,)`."""
        poses = np.zeros((len(distance_m), 4, 4))
        poses[:, :3, :3] = self.orientation.at(distance_m)
        poses[:, :3, 3] = self.chain.at(distance_m)[0]
        poses[:, 3, 3] = 1.0
        return poses

    def twists(self, distance_m: Numbers) -> tuple[Numbers, Numbers]:
        """Twist `(m, 6)` per distance, linear then angular in base axes, and its derivative by distance."""
        _, tangent, curvature = self.chain.at(distance_m)
        spin, change = self.orientation.spin(distance_m)
        return np.concatenate([tangent, spin], axis=1), np.concatenate([curvature, change], axis=1)


def pose_paths(legs: list[Leg]) -> list[PosePath]:
    """Paths from consecutive legs: one as far as there is no corner that stays sharp."""
    joints = [_joint(legs, number) for number in range(len(legs) - 1)]
    paths, first = [], 0
    for number in range(len(legs)):
        if number == len(legs) - 1 or joints[number] is None:
            group = legs[first : number + 1]
            paths += [_Assembly([turn], []).path() for turn in turn_before(group[0])]
            paths.append(_Assembly(group, joints[first:number]).path())
            first = number + 1
    return paths


def _joint(legs: list[Leg], number: int) -> float | None:
    """Distance by which the corner behind a leg is cut, 0 where the legs are tangential, None where the robot stops."""
    before, after = legs[number], legs[number + 1]
    if before.on_the_spot or after.on_the_spot or before.round_m == 0.0:
        return None
    if before.tangential_rad != after.tangential_rad:
        return None
    ends = before.curve.at(np.array(before.curve.length_m))[1], after.curve.at(np.zeros(()))[1]
    angle = 2.0 * np.arcsin(min(1.0, float(np.linalg.norm(ends[0] - ends[1])) / 2.0))
    if angle <= TANGENT_RAD:
        return 0.0
    if before.round_m is None or before.smooth or after.smooth or angle > _SHARPEST_RAD:
        return None
    return min(before.round_m, before.curve.length_m / 2.0, after.curve.length_m / 2.0)


class _Assembly:
    """Puts legs and what joins them one behind the other."""

    def __init__(self, legs: list[Leg], cuts: list[float | None]) -> None:
        self._legs = legs
        self._cuts = [0.0, *[cut or 0.0 for cut in cuts], 0.0]
        self._curves: list[Curve] = []
        self._at = 0.0
        self._starts = [0.0]
        self._turns: list[Turn] = []
        self._windows: list[Window] = []
        self._sections: list[float] = []
        self._ends: dict[int, float] = {}
        self._blends: list[Blend] = []

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
            self._ends[leg.block] = self._at
            joint = made[number + 1]
            if joint is not None:
                before = self._at
                self._append(joint)
                self._ends[leg.block] = (before + self._at) / 2.0
                if self._cuts[number + 1]:
                    self._windows.append(Window(before, self._at))
        self._ends[self._legs[-1].block] = self._at
        chain = Chain(tuple(self._curves), np.array(self._starts))
        return PosePath(
            chain,
            self._orientation(chain),
            tuple(self._ends),
            np.array(list(self._ends.values())),
            tuple(self._blends),
        )

    def _orientation(self, chain: Chain) -> Orientation | Tangential:
        first = self._legs[0]
        if first.tangential_rad is None:
            return self._turning()
        start = aligned(first.turns[0].rotation, chain.at(np.zeros(1))[1, 0], first.tangential_rad)
        return Tangential(start, chain.at, self._at)

    def _turning(self) -> Orientation:
        turns, windows = self._turns, self._windows
        before, behind = self._legs[0].first_turn, self._legs[-1].last_turn
        if before is not None:
            lead = _turning_at(turns[0], before, 0.0)
            windows = [Window(0.0, _wide(lead, turns[0], self._sections[0])), *windows]
            turns = [lead, *turns]
        if behind is not None:
            lead = _turning_at(turns[-1], behind, self._at)
            windows = [*windows, Window(self._at - _wide(lead, turns[-1], self._sections[-1]), self._at)]
            turns = [*turns, lead]
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
            self._turns.append(replace(turn, anchor_m=offset_m - cut + turn.anchor_m))
            self._sections.append(half)

    def _connector(self, bodies: list[Trimmed], number: int) -> tuple[Curve | None, float]:
        """What joins body number - 1 and the next: a round edge, a blend, or nothing; and what it takes from both."""
        before, after, cut = bodies[number - 1], bodies[number], self._cuts[number]
        if cut:
            return joining(before.at(np.array(before.length_m)), after.at(np.zeros(())), 2.0 * cut), cut
        ends = before.at(np.array(before.length_m)), after.at(np.zeros(()))
        kink, step = (float(np.linalg.norm(ends[1][k] - ends[0][k])) for k in (1, 2))
        if kink <= _KINK_RAD and step <= _CURVATURE_STEP:
            return None, 0.0
        wide = min(0.45 * before.length_m, 0.45 * after.length_m, _LONGEST_BLEND_M)
        for _ in range(8):
            blend = joining(before.at(np.array(before.length_m - wide)), after.at(np.array(wide)), 2.0 * wide)
            away = _deviation(blend, before, after, wide)
            if away <= BLEND_TOLERANCE_M:
                break
            wide *= min(0.7, 0.95 * float(np.sqrt(BLEND_TOLERANCE_M / away)))
        self._blends.append(Blend(self._legs[number].block, away))
        return blend, wide


def _turning_at(turn: Turn, velocity: Numbers, distance_m: float) -> Turn:
    """A turn with the orientation of `turn` at a distance, and its own angular velocity `(3,)` [rad/m]."""
    rate = float(np.linalg.norm(velocity))
    axis = velocity / rate if rate > 0.0 else turn.axis
    return Turn(turn.at(np.array(distance_m)), axis, rate, distance_m)


def _wide(lead: Turn, turn: Turn, half_m: float) -> float:
    """How wide one turn passes into the other: at most `half_m`, less where that would swing the tool about."""
    step = float(np.linalg.norm(lead.velocity - turn.velocity))
    return min(half_m, _LARGEST_SWING_RAD / max(step, 1e-9))


def _deviation(blend: Curve, before: Trimmed, after: Trimmed, wide_m: float) -> float:
    """Largest distance [m] of a blend from the two curves that it replaces near their common end."""
    share = np.linspace(0.0, 1.0, 33)
    position = blend.at(share * blend.length_m)[0]
    along = (2.0 * share - 1.0) * wide_m
    first = before.at(before.length_m + np.minimum(along, 0.0))
    last = after.at(np.maximum(along, 0.0))
    nominal = np.where((along < 0.0)[None, :, None], first, last)
    way = position - nominal[0]
    way = way - nominal[1] * (way * nominal[1]).sum(axis=-1, keepdims=True)
    return float(np.linalg.norm(way, axis=-1).max())
