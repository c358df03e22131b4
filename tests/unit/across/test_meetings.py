"""A meeting between real halves: the manager's core, and of each agent its zones, its clock and its meetings.

The network keeps every message and brings any of them at any time, also twice; processes die, sleep and are started
again; programs are halted, started anew, and come to the MEET as often as they like.
"""

from dataclasses import dataclass, field, replace
from typing import cast

import numpy as np
import pytest
from hypothesis import Phase, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, rule

from cell.core import Frozen, Publish
from cell.manager.core import ManagerCore
from cell.manager.records import Stored
from cell.messages import Arrival, AxisStatus, DriveFeedback, ManagerState, Mode, PlayoutState, Presence
from cell.net.runner import FREEZE_S
from robot_agent.agent.cell_clock import CellClock
from robot_agent.agent.program.meetings import Meetings
from robot_agent.agent.program.program_run import ProgramRun
from robot_agent.agent.zones.zone_claims import ZoneClaims
from robot_agent.language import Meet
from tests.unit import manager_world
from tests.unit.manager_world import OUTSIDE, ball

NAMES = ("a", "b", "c")
CYCLE_S, STEP_S = 0.004, 0.02
KEPT = 200
"""So many of the newest messages can still arrive."""
BODY = ball(OUTSIDE)


@dataclass
class Leave:
    """A robot leaves a MEET."""

    robot: str
    own: Arrival
    by: dict[str, Arrival]
    """The arrivals that were released together."""
    at: float
    """When [s]."""
    error_s: float
    late: bool
    """It says so."""


@dataclass
class Program:
    """What `Meetings` asks of a program's run; halted it is at no MEET, as the run is."""

    waits: Meet | None = None
    halted: bool = False
    held_up: str = ""
    at_wait: object = None
    left_at: int | None = None
    failed: str = ""

    @property
    def at_meeting(self) -> Meet | None:
        return None if self.halted else self.waits

    @property
    def held(self) -> bool:
        return self.halted

    def leave_meeting(self, _tick: int, at_tick: int) -> None:
        self.waits, self.left_at = None, at_tick

    def fail(self, why: str) -> None:
        self.waits, self.failed = None, why


@dataclass
class Agent:
    """One run of a robot's agent."""

    robot: str
    boot: str
    owner: int
    zones: ZoneClaims
    clock: CellClock
    stepped: float
    program: Program = field(default_factory=Program)
    sequence: int = 0
    inbox: list[object] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.clock.ticks_last(CYCLE_S)
        run = cast("ProgramRun", self.program)
        self.meetings = Meetings(self.robot, self.boot, run, self.zones, self.clock)


class Network:
    """`now` passes only by `wait`; a process that was not stepped meanwhile was frozen."""

    def __init__(self, names: tuple[str, ...] = NAMES) -> None:
        self.cell = replace(manager_world.settings(names), meetings={"load": names, "other": names})
        self.digests = dict.fromkeys(names, "digest")
        self.now = 100.0
        self.sent: list[tuple[str, object]] = []
        self.arrived: dict[Arrival, str] = {}
        """All that ever came to a MEET."""
        self.leaves: list[Leave] = []
        self.epoch = self.boots = 0
        self.began: dict[str, float] = {}
        """By boot of the manager, when its cell time was 0."""
        self.manager: ManagerCore
        self.state: ManagerState | None = None
        self.start_manager()
        self.agents = {name: self._agent(name, 1) for name in names}

    # Life and death

    def start_manager(self) -> None:
        self.epoch += 1
        self.boots += 1
        self.manager = ManagerCore(self.cell, f"m{self.boots}", self.epoch, Stored())
        self.inbox: list[object] = []
        self.stepped = self.now

    def restart_agent(self, name: str) -> None:
        self.agents[name] = self._agent(name, self.agents[name].owner + 1)

    def _agent(self, name: str, owner: int) -> Agent:
        self.boots += 1
        boot = f"{name}{self.boots}"
        zones = ZoneClaims(name, boot, self.cell.times.fresh_s)
        return Agent(name, boot, owner, zones, CellClock(name, zones.sent, 0.05), self.now)

    # Time and messages

    def wait(self, seconds: float) -> None:
        self.now += seconds

    def deliver(self, back: int) -> None:
        """The message that was sent `back` before the newest arrives, for the first time or once more."""
        if back < len(self.sent):
            to, message = self.sent[-1 - back]
            if to == "manager":
                self.inbox.append(message)
            else:
                self.agents[to].inbox.append(message)

    # Processes

    def step_manager(self) -> None:
        if self.now - self.stepped > FREEZE_S:
            self.manager.receive(Frozen(self.now - self.stepped), self.now)
        self.stepped = self.now
        inbox, self.inbox = self.inbox, []
        for message in inbox:
            self.manager.receive(message, self.now)
        for effect in self.manager.step(self.now):
            if isinstance(effect, Publish) and isinstance(effect.message, ManagerState):
                self.state = effect.message
                self.began.setdefault(self.state.boot, self.now - self.state.cell_time)
                self.sent += [(name, self.state) for name in self.agents]
        self.sent = self.sent[-KEPT:]

    def step_agent(self, name: str) -> None:
        """As `AgentCore`: messages, the program, the presence."""
        agent = self.agents[name]
        if self.now - agent.stepped > FREEZE_S:
            agent.zones.forget_echoes()
        agent.stepped = self.now
        tick = round(self.now / CYCLE_S)
        agent.clock.arrived(feedback(name, agent.sequence, tick), tick * CYCLE_S)
        inbox, agent.inbox = agent.inbox, []
        for message in inbox:
            assert isinstance(message, ManagerState)
            agent.zones.heard_state(message, self.now)
            agent.clock.arrived(message, self.now)
        own = Arrival(agent.boot, agent.meetings._number)
        late = agent.meetings.follow(tick, CYCLE_S, self.now)
        mode = Mode.HALTED if agent.program.halted else Mode.RUNNING
        said = agent.meetings.told(mode)
        if said.waits is not None:
            self.arrived[Arrival(agent.boot, said.waits.number)] = name
        if agent.program.left_at is not None:
            at, agent.program.left_at = agent.program.left_at * CYCLE_S, None
            status = agent.clock.status(self.now)
            assert status is not None
            leave = Leave(name, own, said.left["load"], at, status.error_s, bool(late))
            self.leaves.append(leave)
            self.check(leave)
        agent.sequence += 1
        agent.zones.sent_presence(agent.sequence, BODY, self.now)
        presence = Presence(
            name, agent.boot, agent.owner, agent.sequence, agent.zones.heard, self.digests[name], BODY, 0.0
        )
        self.sent = [*self.sent[-KEPT:], ("manager", replace(presence, mode=mode, meets=said))]

    # What programs and operators do

    def come(self, name: str, timeout_s: float | None = None) -> None:
        """The program comes to its MEET, unless it waits there."""
        program = self.agents[name].program
        program.waits = program.waits or Meet(3, "load", timeout_s)

    def halt(self, name: str, halted: bool) -> None:
        self.agents[name].program.halted = halted

    def run_anew(self, name: str) -> None:
        """An operator starts the program from its first line."""
        self.agents[name].program.waits = None

    def settle(self, seconds: float, deaf: str = "", dumb: str = "") -> None:
        """The network is good for a while, but for a robot that does not hear, and one that is not heard."""
        for _ in range(round(seconds / STEP_S)):
            self.wait(STEP_S)
            for name in self.agents:
                self.step_agent(name)
                if name != dumb:
                    self.deliver(0)
            before = self.state
            self.step_manager()
            for back, name in enumerate(reversed(self.agents)) if self.state is not before else ():
                if name != deaf:
                    self.deliver(back)

    def reason(self, name: str) -> str:
        return self.agents[name].program.held_up

    # What must be so

    def check(self, leave: Leave) -> None:
        """Nobody leaves without the others, twice, by what was before, or at another time than they."""
        assert leave.by[leave.robot] == leave.own
        assert set(leave.by) == set(self.agents)
        for robot, arrival in leave.by.items():
            assert self.arrived[arrival] == robot, "an arrival that never was"
        for before in self.leaves[:-1]:
            shared = [robot for robot in leave.by if before.by[robot] == leave.by[robot]]
            if before.robot == leave.robot:
                assert shared == [], "left twice by one arrival"
            elif shared and not (before.late or leave.late):
                assert before.by == leave.by
                assert abs(before.at - leave.at) <= max(before.error_s, leave.error_s) + 2 * CYCLE_S


def feedback(robot: str, sequence: int, tick: int) -> DriveFeedback:
    none = np.zeros(1)
    return DriveFeedback(
        robot, "g", sequence, tick, 1, 0, PlayoutState.PLAYING, 0, 0, True, True, none, none, none,
        (AxisStatus.OPERATION_ENABLED,),
    )  # fmt: skip


NAME = st.sampled_from(NAMES)


class MeetingNetwork(RuleBasedStateMachine):
    @initialize()
    def begin(self) -> None:
        self.net = Network()
        self.net.settle(0.1)

    @rule(name=NAME, delivered=st.booleans())
    def an_agent_goes_on(self, name: str, delivered: bool) -> None:
        self.net.step_agent(name)
        if delivered:
            self.net.deliver(0)

    @rule(delivered=st.sets(st.sampled_from(range(len(NAMES)))))
    def the_manager_goes_on(self, delivered: set[int]) -> None:
        self.net.step_manager()
        for back in delivered:
            self.net.deliver(back)

    @rule(back=st.integers(0, KEPT))
    def any_message_arrives(self, back: int) -> None:
        self.net.deliver(back)

    @rule(seconds=st.sampled_from([0.005, 0.02, 0.1, 0.3, 2.5]))
    def time_passes(self, seconds: float) -> None:
        self.net.wait(seconds)

    @rule(names=st.sets(NAME, min_size=1), seconds=st.sampled_from([0.06, 0.2, 0.5]), deaf=NAME, dumb=NAME)
    def they_come_while_one_is_cut_off(self, names: set[str], seconds: float, deaf: str, dumb: str) -> None:
        for name in names:
            self.net.come(name)
        self.net.settle(seconds, deaf, dumb)

    @rule(seconds=st.sampled_from([0.06, 0.5]))
    def all_come(self, seconds: float) -> None:
        for name in NAMES:
            self.net.come(name)
        self.net.settle(seconds)

    @rule(name=NAME, halted=st.booleans())
    def one_is_halted_or_goes_on(self, name: str, halted: bool) -> None:
        self.net.halt(name, halted)

    @rule(name=NAME)
    def one_runs_its_program_anew(self, name: str) -> None:
        self.net.run_anew(name)

    @rule(name=NAME)
    def an_agent_is_started_again(self, name: str) -> None:
        self.net.restart_agent(name)

    @rule()
    def the_manager_is_started_again(self) -> None:
        self.net.start_manager()

    @rule()
    def all_that_come_leave(self) -> None:
        for name in NAMES:
            self.net.halt(name, False)
        self.net.settle(1.0)
        before = len(self.net.leaves)
        for name in NAMES:
            self.net.come(name)
        self.net.settle(1.0)
        left = [leave.robot for leave in self.net.leaves[before:]]
        assert set(left) == set(NAMES), {name: self.net.reason(name) for name in NAMES}

    @invariant()
    def no_robot_is_ahead_by_more_than_one(self) -> None:
        """Each leave of a robot uses up an arrival of each other one (also checked leave by leave)."""
        for name in NAMES:
            used = [leave.by[other] for leave in self.net.leaves if leave.robot == name for other in NAMES]
            assert len(used) == len(set(used))


TestMeetingNetwork = MeetingNetwork.TestCase
TestMeetingNetwork.settings = settings(
    max_examples=6, stateful_step_count=20, deadline=None, phases=[Phase.explicit, Phase.generate]
)


@pytest.fixture
def net() -> Network:
    net = Network()
    net.settle(0.3)
    return net


def test_nobody_leaves_before_the_last_one_has_come_and_all_leave_at_one_time(net: Network) -> None:
    net.come("a")
    net.come("b")
    net.settle(2.0)
    assert net.leaves == []
    assert net.reason("a") == "meeting load: waits for c, which is on its way, but stands now"
    net.come("c")
    came_at = net.now
    net.settle(1.0)
    assert [leave.robot for leave in net.leaves] == list(NAMES)
    first, *others = [leave.at for leave in net.leaves]
    assert others == pytest.approx([first] * 2, abs=CYCLE_S)
    assert 0.25 < first - came_at < 0.45


def test_the_time_at_which_they_leave_is_the_same_for_one_that_hears_of_it_a_little_later(net: Network) -> None:
    for name in NAMES:
        net.come(name)
    net.settle(0.16, deaf="c")
    assert {leave.robot for leave in net.leaves} == {"a", "b"}
    net.settle(0.1)
    assert [(leave.robot, leave.late) for leave in net.leaves] == [("a", False), ("b", False), ("c", False)]
    assert net.leaves[2].at == pytest.approx(net.leaves[0].at, abs=CYCLE_S)


def test_the_manager_says_who_is_there_and_who_is_missing(net: Network) -> None:
    net.come("b")
    net.halt("c", True)
    net.settle(0.3)
    assert net.state is not None
    status = net.state.meetings["load"]
    assert status.there == ("b",)
    assert status.missing == {"a": "which is on its way, but stands now", "c": "which is halted"}
    assert net.state.meetings["other"].missing == {}


def test_one_that_falls_silent_is_named(net: Network) -> None:
    for name in NAMES[:2]:
        net.come(name)
    net.settle(1.0, dumb="c")
    assert net.reason("a") == "meeting load: waits for c, which is silent"


def test_one_with_another_configuration_has_not_come(net: Network) -> None:
    net.digests["c"] = "another one"
    for name in NAMES:
        net.come(name)
    net.settle(1.0)
    assert net.leaves == []
    assert "waits for c, which gets no grants: its configuration another" in net.reason("a")


def test_one_that_waits_elsewhere_is_named_with_the_place(net: Network) -> None:
    net.come("a")
    net.agents["b"].program.waits = Meet(7, "other")
    net.settle(0.3)
    assert "b, which waits at meeting other" in net.reason("a")


def test_one_that_is_halted_at_its_meet_has_not_come(net: Network) -> None:
    for name in NAMES:
        net.come(name)
    net.halt("c", True)
    net.settle(1.0)
    assert net.leaves == []
    assert net.reason("a") == "meeting load: waits for c, which is halted"
    net.halt("c", False)
    net.settle(1.0)
    assert len(net.leaves) == 3


def test_in_a_loop_nobody_leaves_by_the_arrival_of_the_round_before(net: Network) -> None:
    for _ in range(3):
        for name in NAMES:
            net.come(name)
        net.settle(1.0)
    net.come("a")
    net.settle(2.0)
    assert [len([leave for leave in net.leaves if leave.robot == name]) for name in NAMES] == [3, 3, 3]
    assert net.reason("a").startswith("meeting load: waits for b, which is on its way, but stands now, and for c")


def test_one_that_did_not_hear_the_release_leaves_late_and_says_so(net: Network) -> None:
    for name in NAMES:
        net.come(name)
    net.settle(1.0, deaf="c")
    assert {leave.robot for leave in net.leaves} == {"a", "b"}
    net.settle(0.5)
    assert net.leaves[-1].robot == "c"
    assert net.leaves[-1].late
    assert net.leaves[-1].by == net.leaves[0].by


def test_a_manager_that_is_started_again_lets_the_last_one_leave_by_the_round_that_it_is_in(net: Network) -> None:
    for name in NAMES:
        net.come(name)
    net.settle(1.0, deaf="c")
    net.start_manager()
    net.come("a")
    net.come("b")
    net.settle(2.0)
    by = [(leave.robot, leave.own.number) for leave in net.leaves]
    assert by == [("a", 1), ("b", 1), ("c", 1)], "and nobody by the second arrivals of a and b"
    net.come("c")
    net.settle(1.0)
    assert [leave.robot for leave in net.leaves[3:]] == list(NAMES)


def test_a_robot_that_does_not_know_cell_time_well_enough_keeps_the_others_waiting_and_says_so(net: Network) -> None:
    poor = net.agents["c"]
    poor.clock._allowed_s = 0.001
    for name in NAMES:
        net.come(name)
    net.settle(1.0)
    assert net.leaves == []
    assert net.reason("a") == "meeting load: waits for c, which is there, but does not know cell time well enough"
    assert "allowed are 1 ms (times: clock_error_s)" in net.reason("c")


def test_a_time_out_ends_the_program_with_the_names_of_the_missing(net: Network) -> None:
    net.come("a", timeout_s=1.0)
    net.halt("a", True)
    net.settle(3.0)
    net.halt("a", False)
    net.settle(0.9)
    assert net.agents["a"].program.failed == ""
    net.settle(0.3)
    assert net.agents["a"].program.failed == (
        "line 3: not left within 1 s: meeting load: waits for b, which is on its way, but stands now, and for c, "
        "which is on its way, but stands now"
    )
    assert net.state is not None
    assert net.state.meetings["load"].there == ()


def test_robots_that_wait_at_each_others_meetings_are_named_with_the_way_out(net: Network) -> None:
    net.come("a")
    net.agents["b"].program.waits = Meet(7, "other")
    net.agents["c"].program.waits = Meet(9, "other")
    net.settle(0.5)
    assert "for ever" not in net.reason("a")
    net.settle(1.5)
    for name in "ab":
        assert (
            "that lasts for ever, a waits at meeting load for b; b waits at meeting other for a: their programs come "
            "to these MEETs in different order: `cell halt b`, then `cell run b --from LINE` with the line behind its "
            "MEET other, or `cell run b`" in net.reason(name)
        )
    assert net.state is not None
    assert next(deadlock.robots for deadlock in net.state.deadlocks) == ("a", "b")
    for name in "bc":
        net.agents[name].program.waits = None
        net.come(name)
    net.settle(1.5)
    assert net.state.deadlocks == ()
    assert len(net.leaves) == 3


def test_one_whose_program_waits_for_something_else_is_named_with_that(net: Network) -> None:
    net.come("a")
    flagged = net.agents["b"].program
    flagged.at_wait, flagged.held_up = object(), "M 7 waits for an answer: `cell flag b 7`"
    net.settle(0.3)
    assert "waits for b, whose program waits: M 7 waits for an answer: `cell flag b 7`" in net.reason("a")
