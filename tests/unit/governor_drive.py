"""Four motions of the example arm, and a gateway in short that plays what the governor answers."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from robot_agent.paths import JointMove, Line, Sequence
from robot_agent.trajectory import Governor, Hold, Limits, Motion, RateRequest, Segment, plan
from tests.unit.six_axis_arm import arm, description

CYCLE_S = 0.004
STEP = 5
"""Samples between two calls: 20 ms."""
ARM = arm()
LIMITS = Limits.of(description())
START = np.array([0.3, 0.2, 0.3, 0.1, 0.9, 0.2])


def line(offset: tuple[float, float, float]) -> Line:
    target = ARM.forward(START).copy()
    target[:3, 3] += offset
    return Line(target, None, 1)


LONG = plan(ARM, Sequence([line((0.1, 0.6, -0.3))]), LIMITS, start=START)
FAR = START + np.array([1.5, -0.3, 0.2, 0.5, 0.1, -0.8])
JOINTS = plan(ARM, Sequence([JointMove(FAR, 1.0, 1)]), LIMITS, start=START)
MIXED = plan(
    ARM,
    Sequence([JointMove(START + 0.4, 0.6, 1), line((0.0, 0.2, 0.1)), line((0.0, 0.2, 0.08)), JointMove(START, 1.0, 4)]),
    LIMITS,
    start=START,
)
ROUNDED = plan(
    ARM,
    Sequence(
        [
            replace(line((0.0, 0.3, 0.0)), round_m=0.06),
            replace(line((0.0, 0.3, -0.3)), round_m=0.06),
            JointMove(START + 0.3, 0.8, 3),
        ]
    ),
    LIMITS,
    start=START,
)
MOTIONS = [LONG, JOINTS, MIXED, ROUNDED]


class Drive:
    """Plays segments like a gateway: what was commanded, and what still is when nothing more arrives."""

    def __init__(self, motion: Motion, tau: float = 0.0) -> None:
        self.motion = motion
        self.governor = Governor(motion, LIMITS, CYCLE_S, nominal_s=0.12)
        self.segment = self.governor.rest(tau)
        self.index = 0
        self.played_tau: list[float] = []
        self.played: list[np.ndarray] = []

    def ask(self, requests: tuple[RateRequest, ...] = (), holds: tuple[Hold, ...] = (), stop: bool = False) -> Segment:
        return self.governor.next(self.segment, self.index, requests, holds, stop)

    def take(self, segment: Segment) -> None:
        self.segment, self.index = segment, 0

    def play(self, samples: int = STEP) -> None:
        kept = np.minimum(np.arange(self.index, self.index + samples), self.segment.length - 1)
        self.played_tau += self.segment.tau[kept].tolist()
        self.played += list(self.segment.q[kept])
        self.index += samples

    @property
    def tau(self) -> float:
        return self.segment.state(self.index).tau

    @property
    def standing(self) -> bool:
        return self.index >= self.segment.rest_index

    def run(self, until: Callable[[], bool], holds: tuple[Hold, ...] = (), rate: float = 1.0) -> None:
        for _ in range(2000):
            if until():
                return
            self.take(self.ask((RateRequest(rate, "override"),), holds))
            self.play()
        raise AssertionError(f"stays at tau {self.tau} of {self.motion.duration_s}, ruled by {self.segment.ruled_by}")

    def run_to_end(self) -> None:
        self.run(lambda: self.tau >= self.motion.duration_s and self.standing)

    def check(self) -> None:
        self.play(4)
        taus, q = np.array(self.played_tau), np.array(self.played)
        np.testing.assert_allclose(q, self.motion.q(taus), atol=1e-6)
        for order, limit in enumerate((LIMITS.velocity, LIMITS.ramp_acceleration_bounds[1], LIMITS.ramp_jerk), 1):
            reached = np.abs(np.diff(q, order, axis=0)).max(axis=0) / CYCLE_S**order
            assert (reached <= 1.003 * limit).all(), (order, reached / limit)


def assert_ends_at_rest(segment: Segment) -> None:
    np.testing.assert_array_equal(segment.q[-3:], np.tile(segment.q[-1], (3, 1)))
    np.testing.assert_array_equal(segment.qd[-1], 0.0)
    assert segment.rate[-1] == 0.0
