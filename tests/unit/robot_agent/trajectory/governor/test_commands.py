"""The governor under random commands at every tick, on random motions: its promises hold whatever comes."""

from types import SimpleNamespace

import numpy as np
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, rule

from robot_agent.trajectory import Governor, Hold, RateRequest, plan
from tests.unit.governor_drive import CYCLE_S, STEP
from tests.unit.random_moves import LIMITS, MODEL, START, sequence

MOTIONS = [plan(MODEL, sequence(seed, longest=4), LIMITS, start=START, cycle_s=CYCLE_S) for seed in (2, 5, 11)]
RATES = st.one_of(st.sampled_from([1.0, 1.0, 0.0, -1.0, 0.03]), st.floats(-1.0, 1.0))


class Commands(RuleBasedStateMachine):
    """Each rule changes what is wanted; each then lasts for some calls of the governor."""

    @initialize(number=st.integers(0, 2), begin=st.floats(0.0, 1.0))
    def stand(self, number: int, begin: float) -> None:
        self.motion = motion = MOTIONS[number]
        self.governor = Governor(motion, LIMITS, CYCLE_S, nominal_s=0.12)
        self.segment, self.index = self.governor.rest(begin * motion.duration_s), 0
        self.rate, self.holds, self.cap = 1.0, [], None
        self.cap_reached = False
        self.played: list[SimpleNamespace] = []

    @rule(rate=RATES, calls=st.integers(1, 15))
    def override(self, rate: float, calls: int) -> None:
        self.rate = rate
        self.go(calls)

    @rule(calls=st.integers(1, 30))
    def go(self, calls: int) -> None:
        for _ in range(calls):
            self.ask()
            self.play(STEP)

    @rule(gap=st.floats(0.0, 0.3), length=st.floats(0.0, 0.3), calls=st.integers(1, 15))
    def hold_ahead(self, gap: float, length: float, calls: int) -> None:
        back = self.segment.stop_tau < self.segment.state(self.index).tau
        near = self.segment.stop_tau + (-gap if back else gap)
        ends = (near - length, near) if back else (near, near + length)
        self.holds = [Hold(ends[0], "zone", until=ends[1])]
        self.go(calls)

    @rule()
    def lift(self) -> None:
        self.holds = []
        self.go(3)

    @rule(cap=st.sampled_from([None, 0.25, 0.05]))
    def cap_speed(self, cap: float | None) -> None:
        self.cap, self.cap_reached = cap, False
        self.go(5)

    @rule(calls=st.integers(1, 8))
    def stop(self, calls: int) -> None:
        for _ in range(calls):
            self.ask(stop=True)
            self.play(STEP)

    @rule(samples=st.integers(1, 60))
    def lose_blocks(self, samples: int) -> None:
        self.play(samples)

    def ask(self, stop: bool = False) -> None:
        requests = (RateRequest(self.rate, "override"), RateRequest(0.9, "manager"))
        answer = self.governor.next(self.segment, self.index, requests, self.holds, stop, self.cap)
        assert (answer.q[-3:] == answer.q[-1]).all()
        assert not answer.qd[-1].any()
        np.testing.assert_array_equal(answer.q[0], self.segment.q[min(self.index, self.segment.length - 1)])
        for hold in self.holds:
            assert not ((answer.tau > hold.tau) & (answer.tau < hold.until)).any()
        self.segment, self.index = answer, 0

    def play(self, samples: int) -> None:
        rest = np.minimum(
            np.arange(self.index, self.index + max(samples, self.segment.length)), self.segment.length - 1
        )
        kept = rest[:samples]
        if self.cap is not None:
            speed = self.motion.tcp_speed(self.segment.tau[rest]) * np.abs(self.segment.rate[rest])
            below = bool((speed <= self.cap).all())
            assert below or not self.cap_reached
            self.cap_reached = below
        self.played.append(SimpleNamespace(tau=self.segment.tau[kept], q=self.segment.q[kept]))
        self.index += samples

    @invariant()
    def a_stop_is_always_at_hand_and_reaches_no_farther(self) -> None:
        answer = self.governor.next(self.segment, self.index, (), (), stop=True)
        here = self.segment.state(self.index).tau
        assert abs(answer.stop_tau - here) <= abs(self.segment.stop_tau - here)
        assert answer.stop_time_s <= self.segment.remainder(self.index, "").stop_time_s

    def teardown(self) -> None:
        if not self.played:
            return
        taus = np.concatenate([part.tau for part in self.played])
        q = np.concatenate([part.q for part in self.played])
        np.testing.assert_allclose(q, self.motion.q(taus), atol=1e-6)
        lower, upper = LIMITS_POSITION
        assert (q >= lower).all()
        assert (q <= upper).all()
        for order, limit in enumerate((LIMITS.velocity, LIMITS.ramp_acceleration_bounds[1], LIMITS.ramp_jerk), 1):
            reached = np.abs(np.diff(q, order, axis=0)).max(axis=0, initial=0.0) / CYCLE_S**order
            assert (reached <= 1.003 * limit).all(), (order, reached / limit)
        self.finishes()

    def finishes(self) -> None:
        """Whatever was, the motion can be ended."""
        for _ in range(3000):
            if self.segment.stop_tau >= self.motion.duration_s:
                return
            self.segment = self.governor.next(self.segment, self.index, (), ())
            self.index = 4 * STEP
        raise AssertionError(f"stays at tau {self.segment.stop_tau}, ruled by {self.segment.ruled_by}")


LIMITS_POSITION = MODEL.description.limits.position.T
Commands.TestCase.settings = settings(max_examples=20, stateful_step_count=15, deadline=None)
TestCommands = Commands.TestCase
