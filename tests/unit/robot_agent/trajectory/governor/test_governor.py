"""The governor: on the path, inside the limits, never past a hold, always able to stop, forwards and backwards."""

from dataclasses import replace

import numpy as np
import pytest
from ruckig import ControlInterface, InputParameter, Ruckig, Trajectory

from cell.geometry.pose import from_xyz_abc
from robot_agent.kinematics import SixAxis
from robot_agent.model.description import Mounted, Tool
from robot_agent.paths import JointMove, Sequence
from robot_agent.trajectory import Governor, Hold, Motion, PathState, RateRequest, plan
from tests.unit.governor_drive import ARM, CYCLE_S, JOINTS, LIMITS, LONG, MIXED, MOTIONS, START, STEP, Drive
from tests.unit.six_axis_arm import description


@pytest.mark.parametrize("motion", MOTIONS, ids=["line", "joints", "mixed", "rounded"])
def test_undisturbed_motion_takes_exactly_its_planned_time(motion: Motion) -> None:
    drive = Drive(motion)
    drive.run_to_end()
    drive.play(1)  # the sample that ends the motion may be the one after the last answer
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


@pytest.mark.parametrize("share", [0.02, 0.1, 0.3])
def test_a_hold_near_the_start_is_approached_slowly(share: float) -> None:
    hold = Hold(share * JOINTS.duration_s, "step")
    drive = Drive(JOINTS)
    drive.run(lambda: drive.standing and drive.tau > 0.0, (hold,))
    assert hold.tau - 1e-6 < drive.tau <= hold.tau
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


def test_what_makes_no_sense_is_refused_and_says_who_asked() -> None:
    with pytest.raises(ValueError, match=r"rate nan found, asked by manager"):
        RateRequest(np.nan, "manager")
    with pytest.raises(ValueError, match=r"hold from 2.0 to 1.0 s found, asked by zone a"):
        Hold(2.0, "zone a", until=1.0)
    with pytest.raises(ValueError, match=r"nominal_s 0\.001"):
        Governor(JOINTS, LIMITS, cycle_s=0.004, nominal_s=0.001)


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
    for order, limit in ((2, LIMITS.ramp_acceleration_bounds[1]), (3, LIMITS.ramp_jerk)):
        assert (np.abs(np.diff(q, order, axis=0)).max(axis=0) / CYCLE_S**order <= 1.003 * limit).all()


def test_remainder_of_a_segment_is_the_segment_from_there() -> None:
    drive = Drive(LONG)
    drive.run(lambda: drive.tau > 0.3)
    whole = drive.ask()
    rest = whole.remainder(7, "me")
    np.testing.assert_array_equal(rest.q, whole.q[7:])
    np.testing.assert_array_equal(rest.before, whole.q[5:7])
    assert (rest.nominal, rest.stop_tau, rest.ruled_by) == (whole.nominal - 7, whole.stop_tau, "me")


def backwards(rate: float = 1.0) -> tuple[RateRequest, ...]:
    return (RateRequest(-rate, "override"),)


def test_backwards_it_returns_along_the_same_path_to_its_beginning() -> None:
    drive = Drive(MIXED)
    drive.run(lambda: drive.tau > 1.0)
    drive.run(lambda: drive.tau == 0.0 and drive.standing, rate=-1.0)
    drive.check()
    assert max(drive.played_tau) > 1.0
    drive.run_to_end()
    drive.check()


def test_a_change_of_direction_goes_through_rest() -> None:
    drive = Drive(LONG)
    drive.run(lambda: drive.tau > 0.4)
    turned = drive.ask(backwards())
    assert turned.stop_tau == drive.ask(stop=True).stop_tau
    drive.take(turned)
    drive.play(turned.rest_index)
    assert drive.ask(backwards()).stop_tau < turned.stop_tau


def test_backwards_it_is_as_fast_as_asked() -> None:
    drive = Drive(LONG, tau=0.6 * LONG.duration_s)
    drive.run(lambda: drive.tau < 0.35 * LONG.duration_s, rate=-0.5)
    assert np.diff(drive.played_tau)[-1] == pytest.approx(-0.5 * CYCLE_S)


def test_least_of_all_rates_rules_in_the_direction_that_anyone_asks_for() -> None:
    drive = Drive(LONG, tau=0.5)
    assert drive.ask((*backwards(), RateRequest(0.0, "halt"))).rest_index == 0
    assert drive.ask((*backwards(), RateRequest(0.0, "halt"))).ruled_by == "halt"
    answer = drive.ask((*backwards(0.8), RateRequest(0.3, "manager")))
    assert answer.rate.min() >= -0.3 - 1e-12
    assert answer.stop_tau < 0.5
    assert answer.ruled_by == "manager"


def test_backing_up_stops_behind_what_was_given_up_and_goes_forwards_from_there() -> None:
    hold = Hold(0.2 * LONG.duration_s, "zone a", until=0.4 * LONG.duration_s)
    drive = Drive(LONG, tau=0.7 * LONG.duration_s)
    drive.run(lambda: drive.standing and drive.tau < 0.6 * LONG.duration_s, (hold,), rate=-1.0)
    assert min(drive.played_tau) >= hold.until
    assert drive.tau == pytest.approx(hold.until, abs=1e-8)
    assert drive.segment.ruled_by == "zone a"
    drive.run(lambda: drive.tau > 0.6 * LONG.duration_s, (hold,))
    drive.check()


@pytest.mark.parametrize(("rate", "start"), [(1.0, 0.0), (-1.0, 0.9 * LONG.duration_s)])
def test_with_a_headway_a_robot_goes_at_the_pace_of_what_it_follows(rate: float, start: float) -> None:
    """What is ahead goes on by a fifth of the planned speed, in steps of 0.1 s."""
    drive, rates = Drive(LONG, tau=start), list[float]()
    for step in range(60):
        ahead = start + rate * (0.2 + 0.2 * 0.1 * (step // 5))
        hold = Hold(ahead, "left", headway_s=0.2) if rate > 0.0 else Hold(0.0, "left", ahead, headway_s=0.2)
        drive.take(drive.ask((RateRequest(rate, "override"),), (hold,)))
        drive.play()
        rates.append(abs(drive.segment.state(drive.index).rate))
    assert np.mean(rates[30:]) == pytest.approx(0.2, abs=0.01)
    assert max(rates[30:]) - min(rates[30:]) < 0.1
    assert drive.segment.ruled_by == "left"
    drive.check()


def test_a_headway_lets_a_robot_come_to_a_hold_that_stays() -> None:
    hold = Hold(0.5 * LONG.duration_s, "left", headway_s=0.2)
    drive = Drive(LONG)
    drive.run(lambda: drive.standing and drive.tau > 0.1, (hold,))
    assert hold.tau - 1e-8 < drive.tau <= hold.tau
    assert drive.segment.ruled_by == "left"
    drive.check()


def test_inside_a_hold_nothing_moves_in_any_direction() -> None:
    drive = Drive(LONG, tau=0.5)
    hold = Hold(0.4, "zone a", until=0.6)
    assert drive.ask((), (hold,)).rest_index == drive.ask(backwards(), (hold,)).rest_index == 0


@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_speed_of_the_tcp_stays_below_its_cap_in_ramps_too(direction: float) -> None:
    drive = Drive(MIXED, tau=0.0 if direction > 0.0 else MIXED.duration_s)
    end = MIXED.duration_s - drive.tau
    while drive.tau != end:
        answer = drive.governor.next(
            drive.segment, drive.index, (RateRequest(direction, "override"),), (), cap_m_s=0.25
        )
        places = ARM.forward(answer.q)[:, :3, 3]
        assert np.linalg.norm(np.diff(places, axis=0), axis=1).max() <= 0.25 * CYCLE_S
        drive.take(answer)
        drive.play()
    drive.check()
    fast = np.linalg.norm(np.diff(ARM.forward(np.array(drive.played))[:, :3, 3], axis=0), axis=1) / CYCLE_S
    assert (fast > 0.23).mean() > 0.5


def test_cap_holds_for_the_tip_of_a_long_tool_that_swings() -> None:
    tip = from_xyz_abc(np.array([0.5, 0.0, 0.1, 0.0, 0.0, 0.0]))
    tool = Tool("lance", tip, 1.0, (0.0, 0.0, 0.0), np.zeros((3, 3)), ())
    lance = SixAxis(replace(description(), tools={"lance": tool}, mounted=Mounted(("lance",))))
    swing = JointMove(START + np.array([0.0, 0.0, 0.0, 1.0, 1.2, 0.0]), 1.0, 1)
    motion = plan(lance, Sequence([swing]), LIMITS, start=START)
    drive = Drive(motion)
    while drive.tau != motion.duration_s:
        drive.take(drive.governor.next(drive.segment, drive.index, (), (), cap_m_s=0.25))
        drive.play()
    q = np.array(drive.played)
    for places in (lance.forward(q), lance.links(q)[:, -1]):
        assert np.linalg.norm(np.diff(places[:, :3, 3], axis=0), axis=1).max() <= 0.25 * CYCLE_S
    fast = np.linalg.norm(np.diff(lance.forward(q)[:, :3, 3], axis=0), axis=1) / CYCLE_S
    assert (fast > 0.23).mean() > 0.5


def test_the_speed_is_that_of_the_fastest_tool_that_may_be_mounted() -> None:
    poses = [from_xyz_abc(np.array([x, 0.0, 0.1, 0.0, 0.0, 0.0])) for x in (0.5, -0.3)]
    tools = {f"t{k}": Tool(f"t{k}", pose, 1.0, (0.0, 0.0, 0.0), np.zeros((3, 3)), ()) for k, pose in enumerate(poses)}
    one_of = SixAxis(replace(description(), tools=tools, mounted=Mounted(tuple(tools))))
    q, qd = np.random.default_rng(2).uniform(-1, 1, (2, 50, 6))
    each = [SixAxis(replace(description(), tools=tools, mounted=Mounted((name,)))) for name in tools]
    np.testing.assert_allclose(one_of.tool_speed(q, qd), np.max([m.tool_speed(q, qd) for m in each], axis=0))
    step = 1e-7 * qd
    ways = (np.linalg.norm((m.forward(q + step) - m.forward(q - step))[:, :3, 3], axis=1) / 2e-7 for m in (*each, ARM))
    np.testing.assert_allclose(one_of.tool_speed(q, qd), np.max(list(ways), axis=0), atol=1e-6)


def test_a_cap_that_comes_in_full_motion_brakes_to_it_at_once_and_goes_on() -> None:
    drive = Drive(LONG, tau=0.0)
    drive.run(lambda: drive.tau > 0.4)
    for _ in range(40):
        drive.take(drive.governor.next(drive.segment, drive.index, (), (), cap_m_s=0.25))
        drive.play()
    speed = np.linalg.norm(np.diff(ARM.forward(np.array(drive.played))[:, :3, 3], axis=0), axis=1) / CYCLE_S
    assert speed.max() > 0.5
    assert 0.2 < speed[-1] <= 0.25
    assert drive.segment.ruled_by == "speed of the TCP, at most 250 mm/s"
    drive.check()


def test_robots_asked_to_end_together_do_in_spite_of_a_halt() -> None:
    drive, end_s = Drive(LONG), 2.5 * LONG.duration_s
    while drive.tau < LONG.duration_s:
        left_s = end_s - CYCLE_S * len(drive.played_tau)
        halted = 0.5 < left_s - LONG.duration_s < 0.8
        asked = RateRequest.ending_in(left_s, LONG.duration_s - drive.tau, "together")
        drive.take(drive.ask((asked, *([RateRequest(0.0, "halt")] if halted else []))))
        drive.play()
    drive.check()
    first_at_end = int(np.argmax(np.array(drive.played_tau) >= LONG.duration_s - 1e-9))
    assert first_at_end * CYCLE_S == pytest.approx(end_s, abs=0.02)


def fastest_stop_s(velocity: float, acceleration: float) -> float:
    """Of the first joint alone, by Ruckig."""
    request = InputParameter(1)
    request.control_interface = ControlInterface.Velocity
    request.current_velocity, request.current_acceleration = [velocity], [acceleration]
    request.target_velocity = request.target_acceleration = [0.0]
    request.max_acceleration, request.max_jerk = [LIMITS.ramp_acceleration_bounds[1][0]], [LIMITS.ramp_jerk[0]]
    trajectory = Trajectory(1)
    Ruckig(1).calculate(request, trajectory)
    return float(trajectory.duration)


@pytest.mark.parametrize("rate", [1.0, 0.4])
def test_ramps_are_nearly_as_short_as_a_single_joint_allows(rate: float) -> None:
    turn = START + np.array([1.5, 0.0, 0.0, 0.0, 0.0, 0.0])
    motion = plan(ARM, Sequence([JointMove(turn, 1.0, 1)]), LIMITS, start=START)
    drive, ratios = Drive(motion), []
    while True:
        answer = drive.ask((RateRequest(rate, "override"),))
        tau = float(answer.tau[answer.nominal])
        if tau > motion.duration_s - 0.15:
            break
        velocity, acceleration = motion.qd(np.array(tau))[0] * rate, motion.qdd(np.array(tau))[0] * rate**2
        ramp_s = answer.stop_time_s - answer.nominal * CYCLE_S
        ratios.append(ramp_s / fastest_stop_s(velocity, acceleration))
        drive.take(answer)
        drive.play()
    assert np.median(ratios) < 1.15
    assert max(ratios) < 1.45


def test_stop_time_and_place_are_those_of_the_ramp_that_is_played() -> None:
    drive = Drive(ROUNDED := MOTIONS[3])
    for _ in range(20):
        drive.take(drive.ask())
        promised_s, promised_tau = drive.segment.stop_time_s, drive.segment.stop_tau
        alone = Drive(ROUNDED)
        alone.take(drive.segment)
        alone.play(drive.segment.length)
        still = np.flatnonzero((np.diff(np.array(alone.played), axis=0) != 0.0).any(axis=1))[-1] + 1
        assert (still * CYCLE_S, alone.played_tau[-1]) == (promised_s, promised_tau)
        drive.play()


@pytest.mark.parametrize("cycle_s", [0.004, 0.02])
def test_what_begins_just_beside_a_rest_of_the_plan_begins_with_what_was_commanded(cycle_s: float) -> None:
    sweep = START + np.radians([30.0, -10.0, 15.0, 0.0, 10.0, 0.0])
    motion = plan(ARM, Sequence([JointMove(sweep, 1.0, 1), JointMove(START, 1.0, 2)]), LIMITS, START, cycle_s)
    governor, (_, inner, _) = Governor(motion, LIMITS, cycle_s, 0.12), motion.rests
    for beside in np.arange(-8e-3, 8e-3, 1e-4):
        segment = governor.next(governor.rest(inner + beside), 0, [], [])
        assert segment.stop_tau > inner + beside
        assert np.abs(segment.qd[0]).max() <= 1e-5, beside


@pytest.mark.parametrize("cycle_s", [0.004, 0.01, 0.02])
def test_who_stands_just_beside_a_rest_of_the_plan_moves_whatever_hold_lies_ahead(cycle_s: float) -> None:
    sweep = START + np.radians([30.0, -10.0, 15.0, 0.0, 10.0, 0.0])
    motion = plan(ARM, Sequence([JointMove(sweep, 1.0, 1), JointMove(START, 1.0, 2)]), LIMITS, START, cycle_s)
    governor, (_, inner, _) = Governor(motion, LIMITS, cycle_s, 0.12), motion.rests
    for beside in (1e-4, 5e-4, 1.7e-3, 3e-3, 6e-3):
        for ahead in np.arange(0.01, 0.3, 0.0103):
            tau = inner + beside
            segment = governor.next(governor.rest(tau), 0, [], [Hold(tau + ahead, "room")])
            assert tau < segment.stop_tau <= tau + ahead, (beside, ahead)
