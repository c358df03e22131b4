"""Real managers and the zones of real agents over a network that keeps every message, and brings any of them any time.

Nothing here knows the rules but the code under test: robots are points that go into the zone and out again by what
`ZoneClaims` permits, in the order of the agent's core: presence first, motion after it.
"""

import random
from dataclasses import dataclass, field, replace
from functools import partial

from cell.core import Answer, Frozen, Publish, Request
from cell.manager.core import ManagerCore
from cell.manager.records import EstopCleared, EstopLatched, Store, Stored
from cell.messages import (
    AdoptZone,
    Body,
    Call,
    ClearZone,
    Command,
    Estop,
    Event,
    Heard,
    ManagerState,
    Presence,
    Reply,
    ResetEstop,
    TokenGone,
    ZoneState,
)
from cell.net.runner import FREEZE_S
from robot_agent.agent.zones.zone_claims import ZoneClaims
from tests.unit.manager_world import INSIDE, OUTSIDE, ball, settings
from tests.unit.plain_body import plain_body

ZONE = "middle"
NAMES = ("a", "b", "c")
STEP_S = 0.02
KEPT = 400
"""So many of the newest messages can still arrive."""


@dataclass
class Agent:
    """One run of a robot's agent; the robot outlives it."""

    robot: str
    boot: str
    owner: int
    zones: ZoneClaims
    stepped: float
    sequence: int = 0
    inbox: list[object] = field(default_factory=list)
    wants: bool = False
    goal: float = OUTSIDE
    estop: str | None = None
    cleared: set[str] = field(default_factory=set)


class ZoneNetwork:
    """`now` passes only by `wait`; a process that was not stepped meanwhile was frozen."""

    def __init__(self, names: tuple[str, ...] = NAMES) -> None:
        self.cell = settings(robots=names)
        self.now = 100.0
        self.sent: list[tuple[str, object]] = []
        """To whom, and what; all that was ever sent, the newest last."""
        self.events: list[Event] = []
        self.replies: dict[str, Reply] = {}
        self.stored = Stored()
        self.x = dict.fromkeys(names, OUTSIDE)
        self.entered = 0
        self.epoch = self.boots = self.calls = 0
        self.manager: ManagerCore
        self.inbox: list[object] = []
        self.stepped = 0.0
        self.state: ManagerState | None = None
        self.orphaned_at = self.now
        self.start_manager()
        self.agents = {name: self._agent(name, 1) for name in names}

    # Life and death

    def start_manager(self) -> None:
        self.epoch += 1
        self.boots += 1
        self.manager = ManagerCore(self.cell, f"m{self.boots}", self.epoch, self.stored)
        self.inbox, self.stepped, self.state = [], self.now, None

    def restart_agent(self, name: str) -> None:
        """The next run of an agent; the gateway gave it the next claim, so the one before is over."""
        old = self.agents[name]
        self._send("manager", TokenGone("robot", name, old.boot))
        self.agents[name] = self._agent(name, old.owner + 1)

    def _agent(self, name: str, owner: int) -> Agent:
        self.boots += 1
        boot = f"{name}{self.boots}"
        return Agent(name, boot, owner, ZoneClaims(name, boot, self.cell.times.fresh_s), self.now)

    # Time and messages

    def wait(self, seconds: float) -> None:
        self.now += seconds

    def deliver(self, back: int) -> None:
        """The message that was sent `back` before the newest arrives, for the first time or once more."""
        if back < len(self.sent):
            to, message = self.sent[-1 - back]
            (self.inbox if to == "manager" else self.agents[to].inbox).append(message)

    def _send(self, to: str, message: object) -> None:
        self.sent = [*self.sent[-KEPT:], (to, message)]

    # Processes

    def step_manager(self) -> None:
        if self.now - self.stepped > FREEZE_S:
            self.manager.receive(Frozen(self.now - self.stepped), self.now)
        self.stepped = self.now
        inbox, self.inbox = self.inbox, []
        for message in inbox:
            self.manager.receive(message, self.now)
        for effect in self.manager.step(self.now):
            match effect:
                case Publish(ManagerState() as state):
                    self._follow(state)
                    for name in self.agents:
                        self._send(name, state)
                case Publish(Event() as event):
                    self.events.append(event)
                case Publish(message):
                    for name in self.agents:
                        self._send(name, message)
                case Store(EstopLatched(estop)):
                    self.stored = replace(self.stored, estops=(*self.stored.estops, estop))
                case Store(EstopCleared(id)):
                    left = tuple(estop for estop in self.stored.estops if estop.id != id)
                    self.stored = replace(self.stored, estops=left, cleared=self.stored.cleared | {id})
                case Answer(request_id, Reply() as reply):
                    self.replies[request_id] = reply

    def _follow(self, state: ManagerState) -> None:
        before = self.state.zones[ZONE].state if self.state is not None else None
        if state.zones[ZONE].state is ZoneState.ORPHANED and before is not ZoneState.ORPHANED:
            self.orphaned_at = self.now
        self.state = state

    def step_agent(self, name: str) -> None:
        """As `AgentCore._move`: what may be entered, what is held, the presence, and only then the motion."""
        agent, zones = self.agents[name], self.agents[name].zones
        if self.now - agent.stepped > FREEZE_S:
            zones.forget_echoes()
        agent.stepped = self.now
        inbox, agent.inbox = agent.inbox, []
        for message in inbox:
            self._hear(agent, message)
        here = self.x[name]
        goal = agent.goal if agent.estop is None and zones.fresh(self.now) else here
        body = _from_to(here, goal)
        if not all(zones.permitted(zone, self.now) for zone in zones.touched(body)):
            goal, body = here, ball(here)
        wants = {ZONE: 0.0} if agent.wants else {}
        zones.update_holds(self.now, zones.touched(body), set(wants))
        agent.sequence += 1
        zones.sent_presence(agent.sequence, body, self.now)
        stop_time_s = 0.3 if goal != here else 0.0
        self._send(
            "manager",
            Presence(
                name, agent.boot, agent.owner, agent.sequence, zones.heard, "digest", body, stop_time_s,
                dict(zones.holds), wants, agent.estop,
            ),
        )  # fmt: skip
        self.entered += self.x[name] != INSIDE and goal == INSIDE
        self.x[name] = goal

    def _hear(self, agent: Agent, message: object) -> None:
        match message:
            case ManagerState():
                agent.zones.heard_state(message, self.now)
                for zone in self.manager._spaces.values():
                    agent.zones.heard_geometry(zone.geometry)
                for estop in message.estops:
                    self._hear(agent, estop)
            case Estop(id, True) if id not in agent.cleared:
                agent.estop = agent.estop or id
            case Estop(id, False):
                agent.cleared.add(id)
                agent.estop = None if agent.estop == id else agent.estop

    # What robots and operators want

    def want(self, name: str, inside: bool) -> None:
        self.agents[name].wants, self.agents[name].goal = inside, INSIDE if inside else OUTSIDE

    def operate(self, command: Command) -> None:
        """An order in view of the newest state that the manager has sent; it arrives when it is delivered."""
        if self.state is not None:
            self.calls += 1
            id = f"o{self.calls}"
            heard = Heard(self.state.boot, self.state.sequence)
            self._send("manager", Request(id, Call(id, command, heard)))

    def clear(self) -> None:
        """An operator looks, and nobody is inside."""
        if INSIDE not in self.x.values():
            self.operate(ClearZone(ZONE, "me"))

    def adopt(self, name: str) -> None:
        self.operate(AdoptZone(ZONE, name, "me"))

    def reset(self) -> None:
        if self.state is not None:
            self.operate(ResetEstop("me", tuple(estop.id for estop in self.state.estops)))

    # What must be so

    def settle(self, seconds: float = 1.5, asleep: str = "", deaf: str = "", dumb: str = "") -> None:
        """The network is good for a while, and everybody lives.

        But for a process that is `asleep` (frozen), a robot that hears nothing, and one that is not heard.
        """
        for _ in range(round(seconds / STEP_S)):
            self.wait(STEP_S)
            before = len(self.sent) and self.sent[-1]
            for name in self.agents:
                if name != asleep:
                    self.step_agent(name)
            self._deliver_since(before, deaf, dumb)
            before = self.sent[-1]
            if asleep != "manager":
                self.step_manager()
            self._deliver_since(before, deaf, dumb)

    def _deliver_since(self, last: object, deaf: str, dumb: str) -> None:
        new = next((i for i, each in enumerate(reversed(self.sent)) if each is last), len(self.sent))
        for back in range(new - 1, -1, -1):
            to, message = self.sent[-1 - back]
            if to != deaf and not (isinstance(message, Presence) and message.robot == dumb):
                self.deliver(back)

    def check_safe(self) -> None:
        """No two robots in the zone; and no breach, since everybody keeps to the rules."""
        inside = [name for name, x in self.x.items() if x == INSIDE]
        assert len(inside) <= 1, inside
        breaches = [event.text for event in self.events if event.code == "zone_breach"]
        assert breaches == [], breaches

    def check_alive(self) -> None:
        """After `settle`: the living runs are heard, and no other."""
        state = self.state
        assert state is not None
        for name, agent in self.agents.items():
            assert state.heard[name].boot == agent.boot, name
            assert name not in state.refused, state.refused[name]
            assert agent.zones.fresh(self.now), name


def _from_to(start: float, end: float) -> Body:
    """A ball that goes from one place to another."""
    body = ball(start)
    way = ((start, 0.0, 0.0, end, 0.0, 0.0),)
    return body if start == end else replace(body, poses=plain_body((0.1,), (way,), (0.0,)).poses)


def random_walk(seed: int, steps: int) -> ZoneNetwork:
    """A history by one seed: mostly work, with all that goes wrong in between."""
    chance, net = random.Random(seed), ZoneNetwork()
    for _ in range(steps):
        name, kind = chance.choice(NAMES), chance.random()
        if kind < 0.30:
            net.step_agent(name)
            if chance.random() < 0.8:
                net.deliver(0)
        elif kind < 0.50:
            net.step_manager()
            for back in range(len(NAMES)):
                if chance.random() < 0.8:
                    net.deliver(back)
        elif kind < 0.65:
            net.wait(chance.choice([0.0, 0.005, 0.01, 0.02]))
        elif kind < 0.73:
            net.deliver(min(int(chance.expovariate(1.0 / 40.0)), KEPT))
        elif kind < 0.85:
            net.want(name, chance.random() < 0.6)
        elif kind < 0.91:
            net.settle(chance.choice([0.04, 0.1, 0.3]))
        elif kind < 0.96:
            who = chance.choice([*NAMES, "manager"])
            net.settle(chance.choice([0.1, 0.4, 0.7]), **{chance.choice(["asleep", "deaf", "dumb"]): who})
        elif kind < 0.98:
            chance.choice([net.clear, net.reset, partial(net.adopt, name)])()
            net.deliver(0)
        elif kind < 0.985:
            net.wait(chance.choice([0.1, 0.3, 0.6, 2.0]))
        elif kind < 0.993:
            net.restart_agent(name)
        elif kind < 0.998:
            net.start_manager()
        net.check_safe()
    net.settle()
    net.check_safe()
    net.check_alive()
    return net
