"""Events of digital outputs in the playout: executed once, at their tick, and never when the robot is stopped."""

from dataclasses import dataclass, field, replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cell.messages import OutputEvent, SetpointBlock
from cell.messages.setpoints import MOST_EVENTS
from drive_gateway.config.settings import OutputSettings
from drive_gateway.gateway.playout.joining import JoinRule, RefusedBlock
from drive_gateway.gateway.playout.outputs import Outputs
from drive_gateway.gateway.playout.playout import Accepted, Playout
from tests.unit.gateway_world import CYCLE_S, axis, block

AXES = (axis("J1", 1), axis("J2", 2))
START = np.array([0.1, -0.2])
LEADS = (0, 3, 20)
OUTPUTS = (
    OutputSettings("gripper", "J2", 16, keep=True),
    OutputSettings("glue", "J2", 3, lead_s=LEADS[1] * CYCLE_S),
    OutputSettings("laser", "J1", 0, lead_s=LEADS[2] * CYCLE_S),
)
GRIPPER, GLUE, LASER = range(3)
QUIET = 25
"""Cycles in 0.1 s."""


def live_playout() -> tuple[Playout, Outputs]:
    outputs = Outputs(OUTPUTS, CYCLE_S)
    playout = Playout(AXES, CYCLE_S, START, tick=100, outputs=outputs)
    playout.own(7)
    playout.go_live()
    return playout, outputs


def hold(sequence: int, first_tick: int, *events: OutputEvent, nominal: int = 30, owner: int = 7) -> SetpointBlock:
    samples = nominal + 3
    held = block(owner, sequence, first_tick, np.tile(START, (samples, 1)), np.zeros((samples, 2)), nominal)
    return replace(held, events=events)


def on(tick: int, output: int, number: int = 1) -> OutputEvent:
    return OutputEvent(tick, number, output, True)


def play_to(playout: Playout, tick: int) -> None:
    while playout.tick < tick:
        playout.advance()


def ticks_on(playout: Playout, outputs: Outputs, output: int, until: int) -> list[int]:
    """The ticks up to `until` at whose samples the output is on."""
    found = []
    while playout.tick < until:
        playout.advance()
        found += [playout.tick] * (outputs.on >> output & 1)
    return found


def test_an_output_is_switched_with_the_sample_of_its_tick() -> None:
    playout, outputs = live_playout()
    off = OutputEvent(120, 2, GRIPPER, False)
    assert playout.offer(hold(1, 103, on(110, GRIPPER), off)) == Accepted(1)
    assert ticks_on(playout, outputs, GRIPPER, 130) == list(range(110, 120))


def test_a_lead_switches_sooner_and_at_once_where_it_reaches_before_the_block() -> None:
    playout, outputs = live_playout()
    playout.offer(hold(1, 103, on(112, GLUE), on(113, LASER, 2)))
    assert ticks_on(playout, outputs, LASER, 102) == [101, 102]
    assert ticks_on(playout, outputs, GLUE, 112) == list(range(109, 113))


def test_leads_that_turn_the_order_round_lose_no_event() -> None:
    playout, outputs = live_playout()
    playout.offer(hold(1, 101, on(125, GRIPPER), on(127, LASER, 2)))
    play_to(playout, 124)
    assert outputs.on == 1 << LASER
    play_to(playout, 125)
    assert outputs.on == 1 << LASER | 1 << GRIPPER


def test_the_newer_block_says_when_and_what_lies_before_it_stays() -> None:
    playout, outputs = live_playout()
    playout.offer(hold(1, 101, on(105, GRIPPER), on(115, GLUE, 2)))
    playout.offer(hold(2, 110, on(125, GLUE, 2)))
    play_to(playout, 121)
    assert outputs.on == 1 << GRIPPER
    play_to(playout, 122)
    assert outputs.on == 1 << GRIPPER | 1 << GLUE


def test_what_its_lead_executed_before_it_was_superseded_is_not_executed_again() -> None:
    playout, outputs = live_playout()
    playout.offer(hold(1, 101, on(118, LASER), OutputEvent(119, 2, LASER, False)))
    play_to(playout, 104)
    assert outputs.on == 0
    playout.offer(hold(2, 110, on(128, LASER), OutputEvent(129, 2, LASER, False)))
    assert ticks_on(playout, outputs, LASER, 135) == []


def test_each_owner_counts_its_own_events() -> None:
    playout, outputs = live_playout()
    playout.offer(hold(1, 101, on(105, GRIPPER)))
    play_to(playout, 140)
    playout.own(8)
    playout.offer(hold(1, 145, OutputEvent(146, 1, GRIPPER, False), owner=8))
    play_to(playout, 146)
    assert outputs.on == 0


@pytest.mark.parametrize(
    "events",
    [
        (on(105, 3),),
        (on(105, -1),),
        (on(100, GRIPPER),),
        (on(132, GRIPPER),),
        (on(105, GRIPPER), on(105, GLUE)),
        (on(105, GRIPPER, 2), on(106, GLUE)),
        (on(106, GRIPPER), on(105, GLUE, 2)),
        (on(105, GRIPPER, 0),),
        tuple(on(105, GRIPPER, number) for number in range(1, MOST_EVENTS + 2)),
    ],
    ids=["unknown", "negative", "before", "in the ramp", "a number twice", "falling number", "falling tick", "zero",
         "too many"],
)  # fmt: skip
def test_a_block_whose_events_break_a_rule_is_refused_whole(events: tuple[OutputEvent, ...]) -> None:
    playout, outputs = live_playout()
    outcome = playout.offer(hold(1, 102, *events))
    assert isinstance(outcome, RefusedBlock)
    assert outcome.reason is JoinRule.EVENTS
    play_to(playout, 140)
    assert (outputs.on, playout.accepted) == (0, 0)


def test_events_may_share_a_tick_and_fill_the_nominal_part_to_its_ends() -> None:
    playout, outputs = live_playout()
    playout.offer(hold(1, 101, on(101, GLUE), on(101, GRIPPER, 2), OutputEvent(130, 3, GRIPPER, False)))
    assert ticks_on(playout, outputs, GRIPPER, 140) == list(range(101, 130))


@pytest.mark.parametrize("stop", ["stop", "fail", "follow"])
def test_a_stop_switches_off_what_must_not_stay_on_and_forgets_the_rest(stop: str) -> None:
    playout, outputs = live_playout()
    playout.offer(hold(1, 101, on(105, GRIPPER), on(108, GLUE, 2), on(129, LASER, 3)))
    play_to(playout, 107)
    assert outputs.on == 1 << GRIPPER | 1 << GLUE
    if stop == "follow":
        playout.follow(START)
    else:
        getattr(playout, stop)()
    playout.advance()
    assert outputs.on == 1 << GRIPPER
    assert [name for name, _ in outputs.take_stopped()] == ["glue"]
    playout.go_live()
    assert playout.offer(hold(2, 135)) == Accepted(2)
    play_to(playout, 200)
    assert outputs.on == 1 << GRIPPER
    assert not outputs.take_stopped()


def test_when_blocks_stop_coming_it_is_off_from_the_first_sample_of_the_ramp_on() -> None:
    playout, outputs = live_playout()
    playout.offer(hold(1, 101, on(105, GRIPPER), on(108, GLUE, 2)))
    assert ticks_on(playout, outputs, GLUE, 150) == list(range(105, 131))
    assert outputs.take_stopped() == [("glue", "no more blocks come")]


def test_blocks_without_a_nominal_part_keep_an_output_on_as_long_as_they_come() -> None:
    """A robot that waits at rest sends such blocks."""
    playout, outputs = live_playout()
    playout.offer(hold(1, 101, on(104, GLUE)))
    for sequence in range(2, 30):
        play_to(playout, playout.tick + 5)
        playout.offer(hold(sequence, playout.tick + 3, nominal=0))
    assert outputs.on == 1 << GLUE


def test_under_an_emergency_stop_outputs_go_off_while_the_robot_still_brakes_on_its_path() -> None:
    playout, outputs = live_playout()
    playout.offer(hold(1, 101, on(105, GRIPPER), on(108, GLUE, 2)))
    play_to(playout, 110)
    outputs.barred = "an emergency stop is active"
    playout.advance()
    playout.offer(hold(2, 115, on(120, LASER, 3)))
    play_to(playout, 130)
    assert outputs.on == 1 << GRIPPER
    assert outputs.take_stopped() == [("glue", "an emergency stop is active")]


@dataclass
class Model:
    """Says it by searching all that was ever accepted, anew for each tick."""

    said: list[tuple[int, SetpointBlock]] = field(default_factory=list)
    """Tick of its arrival, block."""
    forgotten: int = 0
    """So many of `said` came before the newest stop."""
    done: set[int] = field(default_factory=set)
    over: int = 0
    on: int = 0

    def accept(self, tick: int, block: SetpointBlock) -> None:
        self.said.append((tick, block))

    def sample(self, tick: int) -> None:
        if self._stopped(tick):
            self.forgotten = len(self.said)
            self.on &= 1 << GRIPPER
            return
        valid = [
            event
            for place, (_, block) in enumerate(self.said)
            for event in block.events
            if place >= self.forgotten and all(later.first_tick > event.tick for _, later in self.said[place + 1 :])
        ]
        for event in sorted(valid, key=lambda event: (event.tick, event.number)):
            due = event.tick - LEADS[event.output] <= tick
            if due and event.number > self.over and event.number not in self.done:
                self.done.add(event.number)
                self.on = self.on & ~(1 << event.output) | event.value << event.output
        self.over = max([self.over, *(event.number for event in valid if event.tick <= tick)])

    def _stopped(self, tick: int) -> bool:
        if not self.said:
            return True
        arrived, block = self.said[-1]
        return tick >= block.first_tick + block.nominal and tick - arrived > QUIET


steps = st.lists(
    st.tuples(
        st.integers(1, 40),  # cycles until the block arrives: lost blocks are long pauses
        st.integers(-2, 8),  # ticks from the newest sample to its first; not positive is late
        st.integers(0, 35),  # nominal samples
        st.integers(-2, 2),  # the number of its first event, from the one that is due
        st.lists(st.tuples(st.integers(0, 12), st.sampled_from(range(3)), st.booleans()), max_size=4),
    ),
    max_size=12,
)


@settings(max_examples=60, deadline=None)
@given(steps)
def test_whatever_is_lost_late_or_superseded_each_event_is_executed_once_as_the_newest_block_says(
    sequence: list[tuple[int, int, int, int, list[tuple[int, int, bool]]]],
) -> None:
    playout, outputs = live_playout()
    model, number = Model(), 1
    for count, (cycles, lead, nominal, back, said) in enumerate(sequence, start=1):
        for _ in range(cycles):
            playout.advance()
            model.sample(playout.tick)
            assert outputs.on == model.on, playout.tick
        tick = playout.tick + lead
        events = []
        first = max(1, number + back)
        for gap, output, value in said:
            tick += gap
            events.append(OutputEvent(tick, first + len(events), output, value))
        events = [event for event in events if event.tick < playout.tick + lead + nominal]
        offered = hold(count, playout.tick + lead, *events, nominal=nominal)
        if isinstance(playout.offer(offered), Accepted):
            model.accept(playout.tick, offered)
            number = first + len(events)
        else:
            assert lead <= 0
    for _ in range(80):
        playout.advance()
        model.sample(playout.tick)
        assert outputs.on == model.on, playout.tick
