"""Two robots on a line of sections, under the rules by which real robots share space, with the worst of networks.

The rules are the product's (`Ledger`, `OwnedSpace`); gateways, agents and manager around them are as small as can be.
Any message may be lost, doubled, late for as long as one likes; agents and managers freeze, are cut off, are started
again while the old one lives on. In all of that no robot may be where the other one is.

python -m tests.sim.space_checker --seeds 0:20000
"""

import random
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import TypeVar

import numpy as np

from cell.geometry import Box
from cell.manager.separation.ledger import Ledger
from cell.messages import Body, Clearance, Heard, Presence, Refusal, Sections, Way
from cell.messages.common import Vector
from robot_agent.agent.space.owned_space import OwnedSpace
from tests.sim.checker import search

P = TypeVar("P", "Agent", "Manager")
PLACES = 24
_LOSS, _DOUBLE, _MOST_UNDER_WAY, _NEXT_ONES, _JUMPS_QUEUE = 0.1, 0.05, 60, 12, 0.1
STEPS = 6000
"""Of a run, for about 30 moves."""
_SILENT = 12
"""So many steps of a gateway without a block end a claim at rest."""


def sections(places: Sequence[int]) -> Sections:
    """The place is its id, less one."""
    n = len(places)
    return Sections(
        np.array(places, np.uint64) + np.uint64(1), np.zeros((n, 0, 2, 3), np.float32), np.zeros((n, 0), np.float32)
    )


def places(some: Sections) -> list[int]:
    return [int(each) - 1 for each in some.ids]


class OnTheLine:
    """Two places are too near when they are the same or side by side."""

    def first_too_near(
        self, _robot: str, asked: Sections, other: str, reserved: Sections
    ) -> tuple[int, Refusal] | None:
        taken = set(places(reserved))
        for k, place in enumerate(places(asked)):
            if not taken.isdisjoint((place - 1, place, place + 1)):
                return k, Refusal(other, "too near")
        return None

    def first_nearer(
        self, robot: str, asked: Sections, other: str, reserved: Sections, _present: Sections
    ) -> tuple[int, Refusal] | None:
        return self.first_too_near(robot, asked, other, reserved)

    def first_in_reach(
        self, _robot: str, _asked: Sections, other: str, _base: Vector, _reach_m: float, _why: str
    ) -> tuple[int, Refusal] | None:
        return 0, Refusal(other, f"{other} may be anywhere")

    def first_at_box(self, _robot: str, _asked: Sections, other: str, _box: Box) -> tuple[int, Refusal] | None:
        return 0, Refusal(other, f"{other} stays there")

    def meets(self, _robot: str, body: Sections, _other: str, sections: Sections, _within_m: float = 0.0) -> bool:
        return not set(places(body)).isdisjoint(places(sections))


def presence(
    robot: str, boot: str, owner: int, sequence: int, way: Way, heard: Heard | None, epoch: int, taken: int = 0
) -> Presence:
    """Of a robot that knows where it is."""
    body = Body(True, (0.0, 0.0, 0.0), 0.0)
    return Presence(robot, boot, owner, sequence, heard, "", body, 0.0, epoch=epoch, taken=taken, way=way)


@dataclass(frozen=True, slots=True)
class Block:
    """From a place to rest at another."""

    owner: int
    sequence: int
    start: int
    end: int
    epoch: int


@dataclass(slots=True)
class Gateway:
    """Plays blocks place by place; a claim is given at rest."""

    place: int
    end: int
    owner: int = 0
    next_owner: int = 1
    sequence: int = 0
    silent: int = 0
    epoch: int = 0
    told: int = 0

    def step(self) -> None:
        self.place += (self.end > self.place) - (self.end < self.place)
        self.silent += 1
        if self.place == self.end and self.silent > _SILENT:
            self.owner = 0

    def take(self, block: Block) -> None:
        if block.owner != self.owner or self.owner == 0:
            return
        self.silent = 0
        joins = min(self.place, self.end) <= block.start <= max(self.place, self.end)
        turns = (block.start - self.place) * (self.end - self.place) < 0
        turns |= self.place != self.end and (block.end - block.start) * (self.end - self.place) < 0
        if block.sequence <= self.sequence or not joins or turns:
            return
        self.end, self.sequence, self.epoch = block.end, block.sequence, max(self.epoch, block.epoch)

    def claim(self) -> int:
        """0 when the robot moves or has an owner."""
        if self.owner != 0 or self.place != self.end:
            return 0
        self.owner, self.sequence, self.silent = self.next_owner, 0, 0
        self.next_owner += 1
        return self.owner

    @property
    def occupied(self) -> tuple[int, int]:
        return min(self.place, self.end), max(self.place, self.end)


@dataclass(frozen=True, slots=True)
class Feedback:
    robot: int
    number: int
    owner: int
    place: int
    end: int
    sequence: int


@dataclass(slots=True)
class Agent:
    """Goes from goal to goal, within what it owns."""

    line: "Line"
    robot: int
    boot: str
    goal: int
    space: OwnedSpace
    owner: int = 0
    newest: Feedback | None = None
    told: int = -1
    sent: int = 0
    presences: int = 0
    open: list[Block] = field(default_factory=list)
    manager: str | None = None
    inbox: list[object] = field(default_factory=list)

    def step(self) -> None:
        if not self._owns():
            return
        for message in self.inbox:
            self._hear(message)
            if self.owner == 0:
                break
        self.inbox = []
        if self.owner == 0 or self.newest is None:
            return
        rng, place, end = self.line.rng, self.newest.place, self.newest.end
        if place == self.goal:
            self.goal = rng.randrange(PLACES)
        onward = 1 if self.goal > place else -1
        way, committed = self._way(onward)
        owned = self.space.follow(way, committed, renounce=rng.random() < 0.15)
        if rng.random() < 0.8:
            self._send_block(onward, way[:owned], place, end)
        way, committed = self._way(onward)
        owned = self.space.follow(way, committed)
        self._say(way, committed, owned)

    def _owns(self) -> bool:
        gateway = self.line.gateways[self.robot]
        if self.owner == 0:
            self.owner = gateway.claim()
            if self.owner == 0:
                self.inbox = []
                return False
            self.space = self.space.claimed(self.owner, gateway.epoch)
            self.inbox = [message for message in self.inbox if isinstance(message, Clearance)]
            self.newest, self.told, self.sent = None, gateway.told, 0
        return True

    def _hear(self, message: object) -> None:
        if isinstance(message, Feedback) and message.number > self.told:
            if message.owner != self.owner:
                self.owner, self.open, self.newest = 0, [], None
                return
            self.told, self.newest = message.number, message
            self.open = [block for block in self.open if block.sequence > message.sequence]
        if isinstance(message, Clearance):
            if message.epoch > self.space.epoch or self.manager is None or message.epoch == self.space.epoch:
                self.manager = message.boot
            self.space.heard_epoch(message.epoch)
            if message.robot == f"r{self.robot}":
                self.space.take(message)

    def _way(self, onward: int) -> tuple[list[int], int]:
        """All places from where it may be on, in the order of travel, and how many of them it may pass anyway."""
        assert self.newest is not None
        ends = [self.newest.place, self.newest.end, *(p for b in self.open for p in (b.start, b.end))]
        low, high = min(ends), max(ends)
        if onward > 0:
            return [place + 1 for place in range(low, PLACES)], high - low + 1
        return [place + 1 for place in range(high, -1, -1)], high - low + 1

    def _send_block(self, onward: int, owned: list[int], place: int, end: int) -> None:
        rng = self.line.rng
        mine = [each - 1 for each in owned]
        start = rng.randint(min(place, end), max(place, end))
        reach = min(rng.randint(0, 4), abs(mine[-1] - start))
        to = start + onward * reach
        if place != end and (end - place) * onward < 0:
            to = start
        if start in mine and to in mine:
            self.sent += 1
            block = Block(self.owner, self.sent, start, to, self.space.epoch)
            self.open.append(block)
            self.line.send((self.robot, block))

    def _say(self, way: list[int], committed: int, owned: int) -> None:
        self.presences += 1
        upto = owned + (self.line.rng.randint(1, 4) if self.manager is not None else 0)
        self.space.ask(self.presences, way[owned:upto])
        heard = None if self.manager is None else Heard(self.manager, 1)
        way_said = Way(sections([each - 1 for each in way[:upto]]), committed, owned)
        said = (self.boot, self.owner, self.presences, way_said, heard, self.space.epoch, self.space.taken)
        self.line.send(presence(f"r{self.robot}", *said))


@dataclass(slots=True)
class Manager:
    line: "Line"
    ledger: Ledger
    boot: str
    epoch: int
    inbox: list[Presence] = field(default_factory=list)

    def step(self) -> None:
        for said in self.inbox:
            self.ledger.hear(said)
        self.inbox = []
        for clearance in self.ledger.clear():
            self.line.send(clearance)
        if not self.ledger.deposed:
            for robot in (0, 1):  # its state, as far as agents look at it here
                self.line.send(Clearance(f"r{robot}", self.boot, self.epoch, 0, 0, 0, 0))


@dataclass(frozen=True, slots=True)
class Rules:
    """The product's, or some with one of them left out."""

    space: Callable[[int, int], OwnedSpace] = OwnedSpace
    ledger: Callable[..., Ledger] = Ledger


class Line:
    """One random run."""

    def __init__(self, seed: int, rules: Rules) -> None:
        self.rng, self.rules = random.Random(seed), rules
        self.gateways = [Gateway(3, 3), Gateway(PLACES - 4, PLACES - 4)]
        self.under_way: list[object] = []
        self.agents = [[self._agent(robot)] for robot in (0, 1)]
        self.epoch = 1
        self.managers = [self._manager()]
        self.frozen: dict[int, int] = {}
        self.cut: dict[int, int] = {}
        self.moves = self.now = 0

    def _agent(self, robot: int) -> Agent:
        return Agent(self, robot, f"a{self.rng.random()}", self.rng.randrange(PLACES), self.rules.space(0, 0))

    def _manager(self) -> Manager:
        boot = f"m{self.epoch}"
        return Manager(self, self.rules.ledger({"r0", "r1"}, boot, self.epoch, OnTheLine()), boot, self.epoch)

    def send(self, message: object) -> None:
        if self.rng.random() < _LOSS:
            return
        self.under_way += [message] * (2 if self.rng.random() < _DOUBLE else 1)
        if len(self.under_way) > _MOST_UNDER_WAY:
            self.under_way.pop(self.rng.randrange(20))

    def run(self, steps: int) -> int | None:
        """The step at which the robots met; None where they never did."""
        for self.now in range(steps):
            self._happens()
            (low, high), (other_low, other_high) = (gateway.occupied for gateway in self.gateways)
            if low <= other_high and other_low <= high:
                return self.now
        return None

    def _happens(self) -> None:
        rng, what = self.rng, self.rng.random()
        if self.under_way and what < 0.5:
            some = len(self.under_way)
            first = some if rng.random() < _JUMPS_QUEUE else min(some, _NEXT_ONES)
            self._deliver(self.under_way.pop(rng.randrange(first)))
        elif what < 0.66:
            robot = rng.randrange(2)
            gateway = self.gateways[robot]
            before = gateway.place
            gateway.step()
            self.moves += gateway.place != before
            gateway.told += 1
            self.send(Feedback(robot, gateway.told, gateway.owner, gateway.place, gateway.end, gateway.sequence))
        elif what < 0.84:
            self._step(rng.choice(rng.choice(self.agents)))
        elif what < 0.99:
            self._step(rng.choice(self.managers))
        else:
            self._trouble(rng.random(), rng.randrange(2))

    def _step(self, process: Agent | Manager) -> None:
        if self.frozen.get(id(process), 0) <= self.now:
            process.step()

    def _trouble(self, what: float, robot: int) -> None:
        rng = self.rng
        if what < 0.45:
            which = self.frozen if what < 0.25 else self.cut
            which[id(rng.choice([*self.agents[robot], *self.managers]))] = self.now + rng.randrange(20, 600)
        elif what < 0.6:
            kept = 2 if rng.random() < 0.5 else 1
            self.agents[robot] = [*self.agents[robot], self._agent(robot)][-kept:]
        elif what < 0.75:
            self.epoch += 1
            kept = 2 if rng.random() < 0.5 else 1
            self.managers = [*self.managers, self._manager()][-kept:]

    def _deliver(self, message: object) -> None:
        match message:
            case (int() as robot, Block() as block):
                self.gateways[robot].take(block)
            case Feedback():
                for agent in self.agents[message.robot]:
                    agent.inbox.append(message)
            case Presence():
                for manager in self._reached(self.managers):
                    manager.inbox.append(message)
            case Clearance():
                for agent in self._reached([agent for both in self.agents for agent in both]):
                    agent.inbox.append(message)

    def _reached(self, processes: list[P]) -> list[P]:
        return [process for process in processes if self.cut.get(id(process), 0) <= self.now]


def broken(seed: int) -> tuple[str, float]:
    """What is wrong in the run of a seed, empty for nothing; and at which step."""
    step = Line(seed, Rules()).run(STEPS)
    return ("", 0.0) if step is None else ("two robots never meet on a line", float(step))


if __name__ == "__main__":
    sys.exit(search("search runs on a line of places for two robots that meet", broken))
