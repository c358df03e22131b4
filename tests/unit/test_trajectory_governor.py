"""The governor under every kind of command: on the path, inside the limits, never past a hold, always able to stop."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from six_axis_arm import arm, description

from robot_agent.paths import JointMove, Line, Sequence
from robot_agent.trajectory import Governor, Hold, Limits, Motion, PathState, RateRequest, Segment, plan

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
        assert (np.diff(taus) >= 0.0).all()
        np.testing.assert_allclose(q, self.motion.q(taus), atol=1e-6)
        for order, limit in enumerate((LIMITS.velocity, LIMITS.ramp_acceleration, LIMITS.ramp_jerk), 1):
            reached = np.abs(np.diff(q, order, axis=0)).max(axis=0) / CYCLE_S**order
            assert (reached <= 1.01 * limit).all(), (order, reached / limit)


def assert_ends_at_rest(segment: Segment) -> None:
    np.testing.assert_array_equal(segment.q[-3:], np.tile(segment.q[-1], (3, 1)))
    np.testing.assert_array_equal(segment.qd[-1], 0.0)
    assert segment.rate[-1] == 0.0


COMMANDS = st.tuples(
    st.sampled_from(["go", "go", "go", "rate", "halt", "hold", "hold", "lift", "stop", "lost"]),
    st.floats(0.0, 1.0),
    st.integers(1, 12),
)


@settings(max_examples=60, deadline=None)
@given(st.sampled_from(MOTIONS), st.lists(COMMANDS, min_size=1, max_size=40))
def test_any_commands_keep_path_limits_and_holds(motion: Motion, commands: list[tuple[str, float, int]]) -> None:
    drive = Drive(motion)
    rate, hold = 1.0, None
    for kind, value, calls in commands:
        if kind == "rate":
            rate = max(value, 0.01)
        elif kind == "halt":
            rate = 0.0
        elif kind == "go":
            rate = 1.0
        elif kind == "hold":
            hold = Hold(drive.segment.stop_tau + 0.2 * value, "zone")
        elif kind == "lift":
            hold = None
        for _ in range(calls if kind != "lost" else 1):
            answer = drive.ask((RateRequest(rate, "override"),), (hold,) if hold else (), kind == "stop")
            assert_ends_at_rest(answer)
            np.testing.assert_array_equal(answer.q[0], drive.segment.q[min(drive.index, drive.segment.length - 1)])
            assert hold is None or answer.stop_tau <= hold.tau
            if kind == "lost":
                drive.play(calls * STEP)
            else:
                drive.take(answer)
                drive.play()
    drive.run_to_end()
    drive.check()
    np.testing.assert_allclose(drive.played[-1], motion.q(np.array(motion.duration_s)), atol=1e-9)


@pytest.mark.parametrize("motion", MOTIONS, ids=["line", "joints", "mixed", "rounded"])
def test_undisturbed_motion_takes_exactly_its_planned_time(motion: Motion) -> None:
    drive = Drive(motion)
    drive.run_to_end()
    first_at_end = int(np.argmax(np.array(drive.played_tau) >= motion.duration_s))
    assert first_at_end == int(np.ceil(motion.duration_s / CYCLE_S - 1e-9))


def test_override_from_rest_holds_from_the_first_sample() -> None:
    answer = Drive(LONG).ask((RateRequest(0.3, "override"), RateRequest(0.8, "manager")))
    np.testing.assert_allclose(np.diff(answer.tau[: answer.nominal]), 0.3 * CYCLE_S)
    assert answer.ruled_by == "override"


def test_the_plan_itself_is_ruled_by_nobody() -> None:
    assert Drive(LONG).ask((RateRequest(1.0, "override"),)).ruled_by == ""


def test_segment_has_its_whole_nominal_part_before_the_ramp() -> None:
    drive = Drive(LONG)
    drive.run(lambda: drive.tau > 0.3)
    answer = drive.ask()
    assert answer.nominal == 30
    np.testing.assert_array_equal(answer.rate[: answer.nominal + 1], 1.0)
    assert (answer.rate[answer.nominal + 1 :] < 1.0).all()


def test_halt_and_continue_end_where_the_plan_ends() -> None:
    drive = Drive(LONG)
    drive.run(lambda: drive.tau > 0.4)
    for _ in range(100):
        drive.take(drive.ask((RateRequest(0.0, "halt"),)))
        drive.play()
    assert drive.standing
    assert drive.segment.ruled_by == "halt"
    assert 0.4 < drive.tau < LONG.duration_s
    drive.run_to_end()
    drive.check()


def test_stop_is_faster_than_playing_on_and_says_when_and_where() -> None:
    drive = Drive(LONG)
    drive.run(lambda: drive.tau > 0.4)
    stopped = drive.ask(stop=True)
    assert stopped.nominal == 0
    assert stopped.stop_time_s < drive.ask().stop_time_s
    drive.take(stopped)
    drive.play(round(stopped.stop_time_s / CYCLE_S))
    assert drive.standing
    assert drive.tau == stopped.stop_tau


def test_hold_is_reached_to_ten_micrometres_and_not_passed() -> None:
    hold = Hold(0.5 * LONG.duration_s, "zone a")
    drive = Drive(LONG)
    drive.run(lambda: drive.standing and drive.tau > 0.1, (hold,))
    assert drive.segment.ruled_by == "zone a"
    assert max(drive.played_tau) <= hold.tau
    gap = LONG.pose(np.array(hold.tau))[:3, 3] - LONG.pose(np.array(drive.tau))[:3, 3]
    assert np.linalg.norm(gap) < 10e-6
    drive.check()


def test_robot_brakes_for_a_hold_once_and_stands_still_in_front_of_it() -> None:
    hold = Hold(0.5 * LONG.duration_s, "zone a")
    drive = Drive(LONG)
    drive.run(lambda: drive.standing and drive.tau > 0.1, (hold,))
    rates = np.diff(drive.played_tau)
    braking = int(np.argmax(rates < 0.999 * CYCLE_S))
    assert (np.diff(rates[braking:]) <= 1e-12).all()
    stood = drive.tau
    for _ in range(20):
        drive.take(drive.ask((), (hold,)))
        drive.play()
    assert drive.tau == stood


def test_hold_lifted_before_braking_begins_costs_nothing() -> None:
    drive, hold = Drive(LONG), (Hold(0.6 * LONG.duration_s, "zone a"),)
    while not (held := drive.ask((), hold)).ruled_by:
        drive.take(held)
        drive.play()
    drive.run_to_end()
    rates = np.diff(drive.played_tau)[: int(LONG.duration_s / CYCLE_S) - 1]
    np.testing.assert_allclose(rates, CYCLE_S, rtol=1e-9)


def test_hold_at_the_end_of_a_block_is_reached_as_planned() -> None:
    hold = Hold(float(MIXED.ends[1]), "program")
    drive = Drive(MIXED)
    drive.run(lambda: drive.standing and drive.tau > 0.1, (hold,))
    assert drive.tau == hold.tau
    assert int(np.argmax(np.array(drive.played_tau) >= hold.tau)) == int(np.ceil(hold.tau / CYCLE_S))


def test_hold_set_too_near_is_answered_by_the_fastest_stop() -> None:
    drive = Drive(LONG)
    drive.run(lambda: drive.tau > 0.4)
    assert drive.ask((), (Hold(drive.tau + 0.01, "zone a"),)).stop_tau == drive.ask(stop=True).stop_tau


def test_answer_is_the_same_for_the_same_question() -> None:
    drive = Drive(JOINTS)
    drive.run(lambda: drive.tau > 0.2)
    first, second = drive.ask((RateRequest(0.4, "a"),)), drive.ask((RateRequest(0.4, "a"),))
    np.testing.assert_array_equal(first.q, second.q)


def test_joining_behind_the_end_of_a_lost_segment_starts_from_rest() -> None:
    drive = Drive(LONG)
    drive.run(lambda: drive.tau > 0.3)
    drive.play(400)
    assert drive.segment.state(drive.index) == PathState(drive.segment.stop_tau, 0.0, 0.0)
    drive.run_to_end()
    drive.check()


def test_next_motion_spliced_at_the_rest_index_keeps_the_limits() -> None:
    drive = Drive(LONG)
    drive.run(lambda: drive.segment.stop_tau >= LONG.duration_s and drive.index == STEP)
    last = drive.segment
    end = LONG.q(np.array(LONG.duration_s))
    following = plan(ARM, Sequence([JointMove(START, 1.0, 2)]), LIMITS, start=end)
    governor = Governor(following, LIMITS, CYCLE_S, nominal_s=0.12)
    begun = governor.next(governor.rest(0.0), 0, [], [])
    q = np.concatenate([last.q[: last.rest_index], begun.q])
    for order, limit in ((2, LIMITS.ramp_acceleration), (3, LIMITS.ramp_jerk)):
        assert (np.abs(np.diff(q, order, axis=0)).max(axis=0) / CYCLE_S**order <= 1.01 * limit).all()


def test_remainder_of_a_segment_is_the_segment_from_there() -> None:
    drive = Drive(LONG)
    drive.run(lambda: drive.tau > 0.3)
    whole = drive.ask()
    rest = whole.remainder(7, "me")
    np.testing.assert_array_equal(rest.q, whole.q[7:])
    np.testing.assert_array_equal(rest.before, whole.q[5:7])
    assert (rest.nominal, rest.stop_tau, rest.ruled_by) == (whole.nominal - 7, whole.stop_tau, "me")
