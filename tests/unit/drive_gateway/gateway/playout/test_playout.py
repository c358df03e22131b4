"""Playout: whole blocks or none, never a step, always an end at rest."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cell.messages import PlayoutState, SetpointBlock
from drive_gateway.gateway.playout.joining import JoinRule, RefusedBlock
from drive_gateway.gateway.playout.playout import Accepted, Ignored, Playout
from tests.unit.gateway_world import CYCLE_S, axis, block, s_motion

AXES = (axis("J1", 1), axis("J2", 2))
START = np.array([0.1, -0.2])


def live_playout() -> Playout:
    playout = Playout(AXES, CYCLE_S, START, tick=100)
    playout.own(7)
    playout.go_live()
    return playout


def move(first_tick: int, sequence: int = 1, distance: float = 0.2, duration_s: float = 0.4) -> SetpointBlock:
    position, velocity = s_motion(duration_s, distance)
    return block(7, sequence, first_tick, START + position, velocity)


def refusal(playout: Playout, offered: SetpointBlock) -> JoinRule:
    outcome = playout.offer(offered)
    assert isinstance(outcome, RefusedBlock), outcome
    return outcome.reason


def play(playout: Playout, cycles: int) -> np.ndarray:
    return np.array([playout.advance()[0] for _ in range(cycles)])


def test_a_block_is_played_sample_by_sample_from_its_first_tick() -> None:
    playout = live_playout()
    offered = move(103)
    assert playout.offer(offered) == Accepted(1)
    played = play(playout, 2 + len(offered.position))
    np.testing.assert_array_equal(played[:2], [START, START])
    np.testing.assert_array_equal(played[2:], offered.position)


def test_after_the_last_sample_it_is_held_with_zero_velocity() -> None:
    playout = live_playout()
    offered = move(101)
    playout.offer(offered)
    play(playout, len(offered.position) + 50)
    position, velocity = playout.advance()
    np.testing.assert_array_equal(position, offered.position[-1])
    assert not velocity.any()


def test_states_go_from_playing_over_ramp_to_starved() -> None:
    playout = live_playout()
    position, velocity = s_motion(0.4, 0.2)
    playout.offer(block(7, 1, 101, START + position, velocity, nominal=30))
    states = []
    for _ in range(len(position) + 1):
        playout.advance()
        states.append(playout.state)
    assert states[:30] == [PlayoutState.PLAYING] * 30
    assert states[30:-2] == [PlayoutState.RAMP] * (len(position) - 31)
    assert states[-2:] == [PlayoutState.STARVED] * 2


def test_a_hold_at_standstill_is_playing_and_at_rest() -> None:
    playout = live_playout()
    playout.offer(block(7, 1, 101, np.tile(START, (30, 1)), np.zeros((30, 2))))
    play(playout, 10)
    assert (playout.state, playout.at_rest, playout.level) == (PlayoutState.PLAYING, True, 20)


def test_a_queued_move_is_not_at_rest_before_it_began() -> None:
    playout = live_playout()
    playout.offer(move(120))
    assert not playout.at_rest


def test_when_starved_the_same_owner_goes_on_from_the_end() -> None:
    playout = live_playout()
    playout.offer(move(101))
    play(playout, 300)
    position, velocity = s_motion(0.4, -0.2)
    assert playout.offer(block(7, 2, playout.tick + 3, START + 0.2 + position, velocity)) == Accepted(2)


def test_a_block_replaces_the_tail_of_the_one_before() -> None:
    playout = live_playout()
    first = move(101)
    playout.offer(first)
    play(playout, 10)
    later = block(7, 2, 120, first.position[19:], first.velocity[19:])
    assert playout.offer(later) == Accepted(2)
    np.testing.assert_array_equal(play(playout, len(first.position) - 10), first.position[10:])


def test_while_the_drives_are_off_blocks_are_only_a_sign_of_life() -> None:
    playout = Playout(AXES, CYCLE_S, START)
    playout.own(7)
    assert playout.offer(move(10)) == Ignored()
    playout.follow(START + 0.5)
    np.testing.assert_array_equal(playout.advance()[0], START + 0.5)
    assert (playout.state, playout.refused) == (PlayoutState.FOLLOWING, 0)


def test_a_stop_forgets_what_was_queued() -> None:
    playout = live_playout()
    playout.offer(move(101))
    last = play(playout, 40)[-1]
    playout.stop()
    np.testing.assert_array_equal(play(playout, 5), np.tile(last, (5, 1)))
    assert playout.state is PlayoutState.STOPPING


def changed(offered: SetpointBlock, **fields: object) -> SetpointBlock:
    names = ("robot", "owner", "sequence", "follows", "first_tick", "dt_s", "nominal", "position", "velocity")
    return SetpointBlock(**{**{name: getattr(offered, name) for name in names}, **fields})  # type: ignore[arg-type]


GOOD = move(103)
JUMP = GOOD.position.copy()
JUMP[50, 1] += 1e-3
BROKEN = GOOD.position.copy()
BROKEN[5, 0] = np.nan
SURGE = GOOD.velocity.copy()
SURGE[50, 1] += 0.5
REFUSED = {
    "another owner": (changed(GOOD, owner=8), JoinRule.OWNER),
    "an old sequence": (changed(GOOD, sequence=0), JoinRule.SEQUENCE),
    "a tick that was sent": (changed(GOOD, first_tick=100), JoinRule.LATE),
    "a tick far ahead": (changed(GOOD, first_tick=100_000), JoinRule.FAR),
    "another cycle": (changed(GOOD, dt_s=0.002), JoinRule.CYCLE),
    "no cycle": (changed(GOOD, dt_s=float("nan")), JoinRule.CYCLE),
    "a velocity of another motion": (changed(GOOD, velocity=SURGE), JoinRule.VALUES),
    "an axis too few": (
        changed(GOOD, position=GOOD.position[:, :1], velocity=GOOD.velocity[:, :1]),
        JoinRule.SHAPE,
    ),
    "no samples": (
        changed(GOOD, position=GOOD.position[:0], velocity=GOOD.velocity[:0], nominal=0),
        JoinRule.SHAPE,
    ),
    "a sample that is no number": (changed(GOOD, position=BROKEN), JoinRule.VALUES),
    "a position beyond the counts": (changed(GOOD, position=GOOD.position + 1e6), JoinRule.RANGE),
    "a start beside the queue": (changed(GOOD, position=GOOD.position + 1e-5), JoinRule.POSITION),
    "a start with a speed": (changed(GOOD, velocity=GOOD.velocity + 1e-3), JoinRule.VELOCITY),
    "a jump inside": (changed(GOOD, position=JUMP), JoinRule.ACCELERATION),
    "an end in motion": (
        changed(GOOD, position=GOOD.position[:50], velocity=GOOD.velocity[:50], nominal=50),
        JoinRule.END,
    ),
    "an end that only claims to rest": (
        changed(
            GOOD, position=GOOD.position[:50], velocity=GOOD.velocity[:50] * np.linspace(1, 0, 50)[:, None], nominal=9
        ),
        JoinRule.END,
    ),
    "too much speed": (move(103, distance=4.0, duration_s=1.5), JoinRule.SPEED),
}


@pytest.mark.parametrize("what", REFUSED)
def test_a_block_is_refused_whole_and_the_old_one_plays_on(what: str) -> None:
    offered, reason = REFUSED[what]
    playout = live_playout()
    assert refusal(playout, offered) is reason
    np.testing.assert_array_equal(play(playout, 5), np.tile(START, (5, 1)))
    assert playout.refused == 1


def test_a_robot_that_nobody_owns_takes_no_motion_from_anybody() -> None:
    playout = live_playout()
    playout.own(0)
    assert {refusal(playout, changed(GOOD, owner=owner)) for owner in (0, 7)} == {JoinRule.OWNER}


def test_a_closing_gateway_takes_no_new_motion() -> None:
    playout = live_playout()
    playout.closing = True
    assert refusal(playout, GOOD) is JoinRule.CLOSING


def test_a_new_owner_begins_its_own_sequence_at_the_commanded_position() -> None:
    playout = live_playout()
    playout.offer(move(101, sequence=40))
    play(playout, 300)
    playout.own(8)
    position, velocity = s_motion(0.4, 0.1)
    assert playout.block == 0
    assert playout.offer(block(8, 1, playout.tick + 2, START + 0.2 + position, velocity)) == Accepted(1)


class Agent:
    """Speeds a path parameter up and brakes it in each block; joins what the gateway really plays."""

    def __init__(self, playout: Playout) -> None:
        self.playout = playout
        self.sequence = 0
        self.queued = [0.0]
        self.first = playout.tick

    def tau_at(self, tick: int) -> tuple[float, float]:
        row = min(max(tick - self.first, 0), len(self.queued) - 1)
        after = self.queued[min(row + 1, len(self.queued) - 1)]
        before = self.queued[max(row - 1, 0)]
        return self.queued[row], (after - before) / (2 * CYCLE_S)

    def offer(self, lead: int, nominal: int, spoil: float) -> None:
        """A block from `lead` ticks ahead: path parameter speeds up or holds its speed, then brakes to rest."""
        first = self.playout.tick + lead
        tau, speed = self.tau_at(first)
        taus = [tau]
        for index in range(nominal + 400):
            change = 2.0 if index < nominal else -2.0
            new = min(max(speed + change * CYCLE_S, 0.0), 0.8)
            tau += 0.5 * (speed + new) * CYCLE_S
            speed = new
            taus.append(tau)
            if speed == 0.0:
                break
        tau_of = np.array(taus)
        speeds = np.gradient(tau_of, CYCLE_S)
        speeds[0] = self.tau_at(first)[1]
        speeds[-1] = 0.0
        self.sequence += 1
        ratio = np.array([1.0, -2.0])
        position = START + tau_of[:, None] * ratio + spoil
        offered = block(7, self.sequence, first, position, speeds[:, None] * ratio, nominal=min(nominal, len(taus)))
        if isinstance(self.playout.offer(offered), Accepted):
            kept = [self.tau_at(tick)[0] for tick in range(self.playout.tick - 1, first)]
            self.first, self.queued = self.playout.tick - 1, kept + taus


steps = st.lists(
    st.tuples(
        st.integers(0, 60),  # cycles until the next offer
        st.integers(-1, 12),  # lead in ticks; not positive is late
        st.integers(0, 40),  # nominal samples
        st.sampled_from([0.0, 0.0, 0.0, 1e-4]),  # now and then a block that does not fit
    ),
    max_size=25,
)


@settings(max_examples=60, deadline=None)
@given(steps)
def test_whatever_is_offered_or_lost_no_limit_is_passed_and_the_end_is_rest(sequence: list[tuple[int, ...]]) -> None:
    playout = live_playout()
    agent = Agent(playout)
    played = [START, START]
    for cycles, lead, nominal, spoil in sequence:
        played += list(play(playout, cycles))
        agent.offer(lead, nominal, spoil)
    played += list(play(playout, 700))
    series = np.array(played)
    speed = np.diff(series, axis=0) / CYCLE_S
    acceleration = np.diff(speed, axis=0) / CYCLE_S
    assert np.all(np.abs(speed) <= 3.0 * 1.011)
    assert np.all(np.abs(acceleration) <= 20.0 * 1.011)
    assert not speed[-3:].any()
    assert playout.at_rest


def test_the_property_above_accepts_most_blocks_of_an_agent_without_losses() -> None:
    playout = live_playout()
    agent = Agent(playout)
    for _ in range(20):
        agent.offer(5, 30, 0.0)
        play(playout, 5)
    assert playout.accepted == 20, playout.refused
