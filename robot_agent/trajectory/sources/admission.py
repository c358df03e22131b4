"""Whether samples may be sent: how far they exceed limits, and what they would leave or enter."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from robot_agent.kinematics import Model
from robot_agent.trajectory.limits import Limits
from robot_agent.trajectory.sources.states import States
from robot_agent.trajectory.sources.tcp import why_fast

SOFT_MARGIN = 5e-3
"""[rad or m] Motions that no plan has checked stop this far inside the joints' limits."""
_TOLERANCE = 2e-3
_ROUNDING = 1e-12
_OUTWARD = 1e-9


@dataclass(frozen=True, slots=True)
class Excess:
    """The largest shares of limits that are used, 1 all of one, and why the speed is too high, for people."""

    speed: float
    acceleration: float
    jerk: float
    why: str


class Admission:
    """The limits of one robot: joints' position, speed, and what a ramp may use of acceleration and jerk."""

    def __init__(self, model: Model, limits: Limits, cycle_s: float, tcp_speed_m_s: float = np.inf) -> None:
        """`tcp_speed_m_s` is the largest speed of TCP and flange."""
        self._model = model
        self._tcp_speed = tcp_speed_m_s
        self._speed = limits.velocity
        second = limits.ramp_acceleration_bounds * cycle_s**2 * (1.0 + _TOLERANCE)
        self._second = second + np.array([[-_ROUNDING], [_ROUNDING]])
        self._third = limits.ramp_jerk * cycle_s**3 * (1.0 + _TOLERANCE) + _ROUNDING
        lower, upper = model.limits.position.T
        self._lower, self._upper = lower + SOFT_MARGIN, upper - SOFT_MARGIN

    def outside(self, states: States) -> str:
        """The joint that leaves its soft limits, for people; empty when none does, or when it only comes back."""
        beyond = np.maximum(np.maximum(self._lower - states.q, states.q - self._upper), 0.0)
        leaving = (beyond > beyond[0] + _OUTWARD).any(axis=0)
        if not leaving.any():
            return ""
        joint = int(np.argmax(leaving))
        side = self._upper if states.q[-1, joint] > self._upper[joint] - SOFT_MARGIN else self._lower
        shown = f"{1000 * side[joint]:.1f} mm" if self._model.linear[joint] else f"{np.degrees(side[joint]):.1f} deg"
        return f"{self._model.joint_names[joint]} at its limit of {shown}"

    def excess(self, states: States, before: NDArray[np.float64]) -> Excess:
        """What states use of the limits; `before` `(2, n)` are the joints commanded in the two ticks before."""
        speeds = np.abs(states.qd) / self._speed
        joint = int(speeds.max(axis=0).argmax())
        speed, why = float(speeds[:, joint].max()), ""
        if speed > 1.0:
            why = why_fast(self._model, states.q[int(speeds[:, joint].argmax())], joint)
        if np.isfinite(self._tcp_speed):
            tcp = self.tcp_share(states.q, states.qd)
            speed, why = (tcp, "") if tcp > speed else (speed, why)
        steps = np.diff(np.concatenate([before, states.q]), n=2, axis=0)
        second = np.maximum(steps / self._second[0], steps / self._second[1])
        third = np.abs(np.diff(steps, axis=0)) / self._third
        return Excess(speed, float(second[1:].max(initial=0.0)), float(third.max(initial=0.0)), why)

    def tcp_share(self, q: NDArray[np.float64], qd: NDArray[np.float64]) -> float:
        """The largest share of their speed limit that TCP and flange use in states `(m, n)`."""
        return float(self._model.tool_speed(q, qd).max() / self._tcp_speed)
