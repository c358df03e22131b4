"""What steps where one move ends and another begins, in numbers and for people."""

import math
from dataclasses import dataclass

import numpy as np

from robot_agent.paths.curves import Numbers
from robot_agent.paths.legs import Leg
from robot_agent.paths.orientation import Turn
from robot_agent.paths.tangential import UP, turn_rates
from robot_agent.paths.transition import Continuity, Passing, Transition

TANGENT_RAD = 2e-3
"""Directions that differ by less are one: blending takes care of the rest."""
SHARPEST_RAD = math.radians(150.0)
"""A corner that turns back more than this is not rounded: its edge would be so tight that stopping is faster."""
_SAME_TURN_RAD_M = 2e-3
_SAME_CURVATURE = 1e-3
"""[1/m] What rounding leaves of coordinates with a few decimals."""


@dataclass(frozen=True, slots=True)
class Junction:
    """Two moves of the TCP at their border."""

    before: int
    move: int
    turn_rad: float
    """By how much the direction of the path turns."""
    curvature_step: float
    """[1/m]"""
    rate_step_rad_m: float
    """By how much the TCP turns faster or slower on its way."""
    round_m: float | None

    @classmethod
    def of(cls, before: Leg, after: Leg) -> "Junction":
        """Of two legs that both have a way."""
        ends = before.curve.at(np.array([before.curve.length_m])), after.curve.at(np.zeros(1))
        kink, step = (float(np.linalg.norm(ends[1][order] - ends[0][order])) for order in (1, 2))
        rates = _rate(before, ends[0], -1), _rate(after, ends[1], 0)
        return cls(
            before.move,
            after.move,
            2.0 * float(np.arcsin(min(1.0, kink / 2.0))),
            step,
            float(np.linalg.norm(rates[1] - rates[0])),
            before.round_m,
        )

    @property
    def continuity(self) -> Continuity:
        """By what the joints feel: that the TCP turns faster on its way is a corner for them."""
        if self.turn_rad > TANGENT_RAD or self.rate_step_rad_m > _SAME_TURN_RAD_M:
            return Continuity.C0
        return Continuity.C1 if self.curvature_step > _SAME_CURVATURE else Continuity.C2

    @property
    def reason(self) -> str:
        """What steps, for people."""
        parts = []
        if self.turn_rad > TANGENT_RAD:
            parts.append(f"the path turns by {np.degrees(self.turn_rad):.1f} deg")
        elif self.curvature_step > _SAME_CURVATURE:
            parts.append(f"the curvature steps by that of a circle of {1000.0 / self.curvature_step:.0f} mm")
        if self.rate_step_rad_m > _SAME_TURN_RAD_M:
            parts.append(rate_reason(self.rate_step_rad_m))
        return ", ".join(parts)

    def passed(self, deviation_m: float) -> Transition:
        """Without a stop, at most `deviation_m` away from both."""
        plain = deviation_m == 0.0 and self.rate_step_rad_m <= _SAME_TURN_RAD_M
        passing = Passing.THROUGH if plain else Passing.BLENDED
        return Transition(self.before, self.move, self.continuity, passing, self.reason, deviation_m)

    def rounded(self, cut_m: float, deviation_m: float) -> Transition:
        """With a round edge that begins `cut_m` before the corner and passes it at `deviation_m`."""
        reason = f"{self.reason}; {edge_text(self.round_m or 0.0, cut_m)}"
        return Transition(self.before, self.move, self.continuity, Passing.ROUNDED, reason, deviation_m, cut_m=cut_m)


def via(move: int, before: Turn, after: Turn, swing_rad: float) -> list[Transition]:
    """Where one turn passes into another inside a move; none where both are as fast."""
    step = float(np.linalg.norm(after.velocity - before.velocity))
    if step <= _SAME_TURN_RAD_M:
        return []
    return [Transition(move, move, Continuity.C0, Passing.BLENDED, rate_reason(step), 0.0, swing_rad)]


def rate_reason(rate_rad_m: float) -> str:
    """That the TCP turns faster or slower after a border."""
    return f"the orientation turns at another rate, by {rate_text(rate_rad_m)}"


def rate_text(rate_rad_m: float) -> str:
    """An angle by way, as an operator reads it."""
    return f"{np.degrees(rate_rad_m) / 10.0:.2f} deg per 100 mm"


def edge_text(round_m: float, cut_m: float) -> str:
    """The size of a round edge, and what is left of it on short moves."""
    asked = f"round edge of {1000.0 * round_m:g} mm"
    return asked if cut_m > 0.999 * round_m else f"{asked}, cut to {1000.0 * cut_m:.1f} mm: half of the shorter move"


def _rate(leg: Leg, state: Numbers, turn: int) -> Numbers:
    """Angular velocity `(3,)` [rad/m] of the TCP at an end of a leg whose curve has `state` `(3, 1, 3)` there."""
    if leg.tangential_rad is not None:
        return np.asarray(turn_rates(state)[0] * UP)
    return leg.turns[turn].velocity
