"""One zone against robots that come, go, fall silent, restart and hear late: what must never happen, does not."""

from dataclasses import dataclass, replace

from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, rule

from cell.manager.zones import Sight, Zone
from cell.messages import Token, ZoneState

EPOCH = 5
ROBOTS = st.sampled_from(["a", "b"])
GOOD = (ZoneState.GRANTED, ZoneState.OCCUPIED)


@dataclass
class Agent:
    """A robot that keeps the agents' rules: it enters only with a token of the newest state it heard.

    `state` is the newest state it heard: sequence, holder and token. What it once did not hold in a presence that
    answered a state with the grant, it never takes up again.
    """

    boot: int = 1
    alive: bool = True
    inside: bool = False
    wants: bool = False
    holds: Token | None = None
    state: tuple[int, str | None, Token | None] = (0, None, None)
    given_up: Token | None = None
    said: Sight | None = None


class ZoneMachine(RuleBasedStateMachine):
    """Presences (`speak`) and states (`hear`) travel at different times and any of them may be lost."""

    def __init__(self) -> None:
        super().__init__()
        self.zone = Zone("z", ("a", "b"), ("a", "b"), EPOCH)
        self.agents = {name: Agent() for name in "ab"}
        self.sights: dict[str, Sight] = {}
        self.sequence = 0
        self.tokens: list[Token] = []
        self.published: tuple[int, str | None, Token | None] = (0, None, None)

    def new_token(self) -> Token:
        self.tokens.append(Token(EPOCH, len(self.tokens) + 1))
        return self.tokens[-1]

    def decide(self) -> None:
        """What the manager does in one cycle."""
        before, suspects = self.zone.state, set(self.zone.suspects)
        self.zone.look(self.sights, self.sequence + 1)
        if before is ZoneState.ORPHANED and self.zone.state is ZoneState.FREE:
            assert all(self.sights[s].fresh and not self.sights[s].inside for s in suspects)
        self.zone.grant(self.sights, self.new_token, self.sequence + 1)
        self.publish()

    def publish(self) -> None:
        self.sequence += 1
        self.published = (self.sequence, self.zone.holder, self.zone.token)

    def permitted(self, name: str) -> bool:
        _, holder, token = self.agents[name].state
        return holder == name and token is not None and self.agents[name].holds == token

    @initialize()
    def all_report(self) -> None:
        for name in self.agents:
            self.speak(name)
            self.hear(name)

    @rule(name=ROBOTS)
    def speak(self, name: str) -> None:
        """A presence: first the agent makes up its mind about the zone, then it says so."""
        agent = self.agents[name]
        if not agent.alive:
            return
        sequence, holder, token = agent.state
        mine = holder == name and token is not None
        if mine and token != agent.given_up and (agent.wants or agent.inside):
            agent.holds = token
        elif not agent.inside:
            agent.holds = None
        if mine and agent.holds != token:
            agent.given_up = token
        agent.said = Sight(str(agent.boot), True, True, agent.inside, False, agent.holds, agent.wants, sequence, "")
        self.sights = self.sights | {name: agent.said}
        self.decide()

    @rule(name=ROBOTS)
    def hear(self, name: str) -> None:
        if self.agents[name].alive:
            self.agents[name].state = self.published

    @rule(name=ROBOTS, wants=st.booleans())
    def want(self, name: str, wants: bool) -> None:
        self.agents[name].wants = wants

    @rule(name=ROBOTS)
    def want_and_enter(self, name: str) -> None:
        """The shortest way in, so that the machine spends its steps on what goes wrong there."""
        self.agents[name].wants = True
        self.speak(name)
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
        self.agents[name].alive = False
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
        """An operator who looks before clearing: nobody silent is inside."""
        if not any(agent.inside and not agent.alive for agent in self.agents.values()):
            self.zone.clear(self.sights)
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
            assert (self.zone.holder, self.zone.token, self.zone.suspects) == (None, None, set())

    @invariant()
    def an_orphan_has_a_reason_and_somebody_to_wait_for(self) -> None:
        if self.zone.state is ZoneState.ORPHANED:
            assert self.zone.suspects
            assert self.zone.reason


ZoneMachine.TestCase.settings = settings(max_examples=150, stateful_step_count=60, deadline=None)
TestZone = ZoneMachine.TestCase
