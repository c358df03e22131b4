"""Joint moves in which each joint goes at its own speed: all start together, each arrives when it does."""

from dataclasses import dataclass, replace

import numpy as np

from robot_agent.kinematics import Model
from robot_agent.model.description import ProfileKind
from robot_agent.paths.transition import Transition
from robot_agent.trajectory.joints.joint_path import Numbers, Stretch
from robot_agent.trajectory.joints.pieces import Pieces
from robot_agent.trajectory.limits import Limits
from robot_agent.trajectory.timing.profile import Profile, even_times, shaped_profile
from robot_agent.trajectory.timing.slowdown import joints_slower_by
from robot_agent.trajectory.timing.timed import Timed

_CUBIC = (ProfileKind.S_CURVE, ProfileKind.TRAPEZOIDAL)
_PIECE_S = 0.004
_LOOKS = np.arange(1, 64) / 64
"""Where caps are looked at between two steps of the profiles, however short these are, beside every `_PIECE_S`."""
_SHORTEST_PIECE_S = 1e-4


@dataclass(frozen=True, slots=True, eq=False)
class Independent:
    """Between two rests. Its path is what the joints' times make of it, so it has no parameter but the time."""

    start: Numbers
    """`(n,)` joints."""
    target: Numbers
    stretch: Stretch
    transitions: tuple[Transition, ...] = ()
    """The stop in front of it."""

    @property
    def stretches(self) -> tuple[Stretch, ...]:
        return (self.stretch,)

    def end(self) -> Numbers:
        """Joints `(n,)` at the end."""
        return self.target

    def later(self, moves: int) -> "Independent":
        """The same with so many moves before it."""
        transitions = tuple(each.shifted(moves) for each in self.transitions)
        return replace(self, stretch=replace(self.stretch, move=self.stretch.move + moves), transitions=transitions)

    def in_time(self, model: Model, limits: Limits) -> Timed:
        """Each joint as fast as its limits allow; all of them slower where the TCP or the joints have a cap."""
        own = [self._profile(limits, joint) for joint in range(len(self.target))]
        starts = np.unique(np.concatenate([each.starts for each in own]))
        pieces = _exact(own, starts) if limits.shaping.profile in _CUBIC else _close(own, starts)
        pieces.coefficients[:, 0] += self.start
        between = starts[:-1, None] + np.diff(starts)[:, None] * _LOOKS
        times = np.concatenate([even_times(starts, _PIECE_S), between.ravel()])
        k = max(1.0, self._excess(model, pieces, times, limits))
        return Timed(pieces.slower(1.0 / k), np.array([0.0, pieces.duration_s * k]), np.array([0.0, self.stretch.end]))

    def _profile(self, limits: Limits, joint: int) -> Profile:
        way, speed = self.target[joint] - self.start[joint], limits.velocity[joint] * self.stretch.joint_speed
        lowest, highest = (float(bound) for bound in limits.acceleration_bounds[:, joint])
        return shaped_profile(limits.shaping, float(way), float(speed), (lowest, highest), float(limits.jerk[joint]))

    def _excess(self, model: Model, pieces: Pieces, times: Numbers, limits: Limits) -> float:
        """How much slower the clock must run so that joints, TCP and caps are kept, looked at at `times` too."""
        t = np.append(pieces.knots, times)
        qd = pieces.derivatives(t)[0]
        twist = (model.jacobian(pieces.position(t)) @ qd[..., None])[..., 0]
        caps = (
            (twist[:, :3], self.stretch.speed_m_s),
            (twist[:, 3:], self.stretch.rotation_rad_s),
            (qd[:, limits.turning], self.stretch.joint_rad_s),
        )
        return max(
            joints_slower_by(pieces, limits), *(float(np.linalg.norm(rate, axis=1).max()) / cap for rate, cap in caps)
        )


def _exact(profiles: list[Profile], t: Numbers) -> Pieces:
    """Profiles of constant jerk between their steps `t`, `n` of them side by side."""
    states = np.stack([each.at(t[:-1]) for each in profiles], axis=-1)
    coefficients = np.zeros((len(t) - 1, 6, len(profiles)))
    coefficients[:, :4] = np.moveaxis(states, 0, 1) / np.array([1.0, 1.0, 2.0, 6.0])[:, None]
    return Pieces(t, coefficients)


def _close(profiles: list[Profile], starts: Numbers) -> Pieces:
    """Any profiles side by side, knots at `even_times` and on their steps `starts`, none too close to the next."""
    duration_s, kept = float(starts[-1]), [0.0]
    for knot in np.sort(np.append(starts, even_times(starts, _PIECE_S))):
        if min(knot - kept[-1], duration_s - knot) >= _SHORTEST_PIECE_S:
            kept.append(float(knot))
    t = np.array([*kept, duration_s])
    after = np.stack([each.at(t) for each in profiles], axis=-1)[:3]
    before = after.copy()
    before[2] = np.stack([each.at(np.nextafter(t, -np.inf))[2] for each in profiles], axis=-1)
    return Pieces.between(t, after[:, :-1], before[:, 1:])
