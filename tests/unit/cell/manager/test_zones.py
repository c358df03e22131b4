"""One zone against robots that come, go, fall silent, restart and hear late: what must never happen, does not."""

import random
from dataclasses import dataclass, replace

import pytest
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, rule

from cell.manager.zone_turns import ZoneTurns
from cell.manager.zones import Sight, Zone
from cell.messages import Token, ZoneState

EPOCH = 5
ROBOTS = st.sampled_from(["a", "b"])
GOOD = (ZoneState.GRANTED, ZoneState.OCCUPIED)


@dataclass
class Agent:
    """A robot that keeps the agents' rules: it enters only with a token of the newest state it heard.

    `state` is the newest state it heard: sequence, holder and token, `granted` or blocked; it
    counts while it is `fresh`. A token that the
    agent did not hold in a presence that answered a state with the grant, it never takes up again.
    """

    boot: int = 1
    alive: bool = True
    inside: bool = False
    wants: bool = False
    holds: Token | None = None
    state: tuple[int, str | None, Token | None] = (0, None, None)
    fresh: bool = False
    granted: bool = False
    given_up: Token | None = None
    said: Sight | None = None


class ZoneMachine(RuleBasedStateMachine):
    """Presences (`speak`) and states (`hear`) travel at different times and any of them may be lost."""

    def __init__(self) -> None:
        super().__init__()
        self.zone = Zone("z", ("a", "b"), ("a", "b"), EPOCH)
        self.turns = ZoneTurns({"z": {}})
        self.agents = {name: Agent() for name in "ab"}
        self.sights: dict[str, Sight] = {}
        self.sequence = 0
        self.tokens: list[Token] = []
        self.published: list[tuple[int, str | None, Token | None, bool]] = []
        self.publish()

    def new_token(self) -> Token:
        self.tokens.append(Token(EPOCH, len(self.tokens) + 1))
        return self.tokens[-1]

    def decide(self) -> None:
        """What the manager does in one cycle."""
        before, suspects = self.zone.state, set(self.zone.suspects)
        self.zone.look(self.sights, self.sequence + 1)
        if before is ZoneState.ORPHANED and self.zone.state is ZoneState.FREE:
            assert all(self.sights[s].fresh and not self.sights[s].inside for s in suspects)
        self.turns.line_up({"z": self.zone}, {"z": self.sights})
        self.turns.grant({"z": self.zone}, {"z": self.sights}, self.new_token, self.sequence + 1)
        self.publish()

    def publish(self) -> None:
        self.sequence += 1
        self.published.append((self.sequence, self.zone.holder, self.zone.token, self.zone.state in GOOD))

    def permitted(self, name: str) -> bool:
        agent = self.agents[name]
        _, holder, token = agent.state
        return agent.fresh and agent.granted and holder == name and token is not None and agent.holds == token

    @initialize()
    def all_report(self) -> None:
        for name in self.agents:
            self.hear(name)
            self.speak(name)

    @rule(name=ROBOTS)
    def speak(self, name: str) -> None:
        """A presence: first the agent makes up its mind about the zone, then it says so."""
        agent = self.agents[name]
        if not agent.alive:
            return
        sequence, holder, token = agent.state
        mine = holder == name and token is not None
        if agent.fresh and mine and token != agent.given_up and (agent.wants or agent.inside):
            agent.holds = token
        elif agent.fresh and not agent.inside:
            agent.holds = None
        if mine and agent.holds != token:
            agent.given_up = token
        agent.said = Sight(
            str(agent.boot), agent.fresh, True, agent.inside, False, agent.holds, agent.wants, sequence, ""
        )
        self.sights = self.sights | {name: agent.said}
        self.decide()

    @rule(name=ROBOTS, late=st.integers(0, 3))
    def hear(self, name: str, late: int = 0) -> None:
        """A manager state arrives, the newest or one of the last; the older it is the less often it is news."""
        agent, state = self.agents[name], self.published[-1 - min(late, len(self.published) - 1)]
        if agent.alive and state[0] > agent.state[0]:
            agent.state, agent.granted, agent.fresh = state[:3], state[3], True

    @rule(name=ROBOTS, wants=st.booleans())
    def want(self, name: str, wants: bool) -> None:
        self.agents[name].wants = wants

    @rule(name=ROBOTS)
    def want_and_enter(self, name: str) -> None:
        """The shortest way in, so that the machine spends its steps on what goes wrong there."""
        self.agents[name].wants = True
        for _ in range(2):
            self.hear(name)
            self.speak(name)
        self.enter(name)

    @rule(name=ROBOTS)
    def enter(self, name: str) -> None:
        agent = self.agents[name]
        if agent.alive and self.permitted(name) and agent.said is not None and agent.said.holds == agent.holds:
            agent.inside = True

    @rule(name=ROBOTS)
    def leave(self, name: str) -> None:
        if self.agents[name].alive:
            self.agents[name].inside = self.agents[name].wants = False

    @rule(name=ROBOTS)
    def fall_silent(self, name: str) -> None:
        """The manager hears nothing; the agent notices as well, and stops where it is."""
        self.agents[name].alive = self.agents[name].fresh = False
        if name in self.sights:
            self.sights = self.sights | {name: replace(self.sights[name], fresh=False)}
        self.decide()

    @rule(name=ROBOTS)
    def return_alive(self, name: str) -> None:
        self.agents[name].alive = True

    @rule(name=ROBOTS)
    def restart(self, name: str) -> None:
        old = self.agents[name]
        if not old.alive:
            self.agents[name] = Agent(boot=old.boot + 1, inside=old.inside)

    @rule()
    def operator_clears(self) -> None:
        """An operator who looks: nobody is inside but who says so itself."""
        unheard = [name for name in self.agents if not (name in self.sights and self.sights[name].fresh)]
        if not any(self.agents[name].inside for name in unheard):
            self.zone.clear(self.sights, self.sequence + 1)
            self.decide()

    @rule(name=ROBOTS)
    def operator_lets_adopt(self, name: str) -> None:
        self.zone.adopt(name, self.sights, self.new_token, self.sequence + 1)
        self.publish()

    @invariant()
    def never_two_inside(self) -> None:
        assert sum(agent.inside for agent in self.agents.values()) <= 1

    @invariant()
    def tokens_only_grow(self) -> None:
        assert self.tokens == sorted(set(self.tokens))
        assert self.zone.token is None or self.zone.token in self.tokens

    @invariant()
    def a_grant_has_one_holder_and_a_free_zone_none(self) -> None:
        if self.zone.state in GOOD:
            assert self.zone.holder is not None
            assert self.zone.token is not None
            assert not self.zone.suspects
        if self.zone.state is ZoneState.FREE:
            assert (self.zone.holder, self.zone.token, self.zone.suspects) == (None, None, {})

    @invariant()
    def an_orphan_has_a_reason_and_somebody_to_wait_for(self) -> None:
        if self.zone.state is ZoneState.ORPHANED:
            assert self.zone.suspects
            assert self.zone.reason


ZoneMachine.TestCase.settings = settings(max_examples=100, stateful_step_count=50, deadline=None)
TestZone = ZoneMachine.TestCase


@pytest.mark.parametrize("seed", range(8))
def test_long_histories_never_bring_two_robots_into_a_zone(seed: int) -> None:
    """The same machine on long walks: several of its dangers need a dozen steps in the right order."""
    chance, machine = random.Random(seed), ZoneMachine()
    machine.all_report()
    named = {
        machine.speak: 8, machine.hear: 6, machine.enter: 6, machine.leave: 4, machine.want_and_enter: 1,
        machine.fall_silent: 0.5, machine.return_alive: 3, machine.restart: 0.5, machine.operator_lets_adopt: 3,
    }  # fmt: skip
    for _ in range(12000):
        kind = chance.random()
        if kind < 0.03:
            machine.operator_clears()
        elif kind < 0.10:
            machine.hear(chance.choice("ab"), chance.randrange(1, 5))
        elif kind < 0.20:
            machine.want(chance.choice("ab"), chance.random() < 0.6)
        else:
            chance.choices(list(named), list(named.values()))[0](chance.choice("ab"))
        machine.never_two_inside()
        machine.a_grant_has_one_holder_and_a_free_zone_none()
        machine.an_orphan_has_a_reason_and_somebody_to_wait_for()
    machine.tokens_only_grow()
    assert len(machine.tokens) > 40
