"""Zones between real managers and real agents' claims: loss, doubles, reorder, freezes and restarts, in any order.

Always: no two robots in the zone, and no breach, since everybody keeps to the rules. And once the network is good, the
living runs are heard again, whatever late messages of dead ones have come before.
"""

import pytest
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, rule

from tests.unit.zone_network import NAMES, ZoneNetwork, random_walk

ROBOTS = st.sampled_from(NAMES)


class NetworkMachine(RuleBasedStateMachine):
    """Any message that was ever sent may come at any time, and again."""

    def __init__(self) -> None:
        super().__init__()
        self.net = ZoneNetwork()
        self.net.settle(0.2)

    @rule(name=ROBOTS, heard=st.booleans())
    def step_agent(self, name: str, heard: bool) -> None:
        self.net.step_agent(name)
        if heard:
            self.net.deliver(0)

    @rule()
    def step_manager(self) -> None:
        self.net.step_manager()

    @rule(back=st.integers(0, 12) | st.integers(0, 400))
    def deliver(self, back: int) -> None:
        self.net.deliver(back)

    @rule(seconds=st.sampled_from([0.01, 0.02, 0.1, 0.24, 0.3, 0.6, 3.0]))
    def wait(self, seconds: float) -> None:
        self.net.wait(seconds)

    @rule(name=ROBOTS, inside=st.booleans())
    def want(self, name: str, inside: bool) -> None:
        self.net.want(name, inside)

    @rule(name=ROBOTS)
    def restart_agent(self, name: str) -> None:
        self.net.restart_agent(name)

    @rule()
    def restart_manager(self) -> None:
        self.net.start_manager()

    @rule(name=ROBOTS, order=st.sampled_from(["adopt", "clear", "reset"]))
    def operate(self, name: str, order: str) -> None:
        {"adopt": lambda: self.net.adopt(name), "clear": self.net.clear, "reset": self.net.reset}[order]()
        self.net.deliver(0)

    @rule(seconds=st.sampled_from([0.06, 0.3]))
    def work(self, seconds: float) -> None:
        self.net.settle(seconds)

    @rule(who=ROBOTS | st.just("manager"), how=st.sampled_from(["asleep", "deaf", "dumb"]))
    def work_without(self, who: str, how: str) -> None:
        self.net.settle(0.5, **{how: who})

    @rule()
    def the_living_are_heard_once_the_network_is_good(self) -> None:
        self.net.settle()
        self.net.check_alive()

    @invariant()
    def safe(self) -> None:
        self.net.check_safe()


NetworkMachine.TestCase.settings = settings(max_examples=5, stateful_step_count=30, deadline=None)
TestNetwork = NetworkMachine.TestCase


@pytest.mark.parametrize("seed", range(2))
def test_long_histories_are_safe_and_end_with_everybody_heard(seed: int) -> None:
    assert random_walk(seed, 700).entered > 2


@pytest.mark.soak
@pytest.mark.parametrize("seed", range(100, 130))
def test_soak_long_histories(seed: int) -> None:
    random_walk(seed, 10_000)
