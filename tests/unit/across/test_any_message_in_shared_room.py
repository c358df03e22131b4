"""No message that fits the schemas ends a process where robots share room, and one message builds on another one.

All that is said here looks like what a robot says: it counts in plans that were told, owns and asks for sections, and
names the newest state. In between come bodies, numbers, pieces and times that fit no other message.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from typing import Any

import numpy as np
import pytest

from cell.config.settings import SeparationSettings
from cell.core import Effect, Publish
from cell.manager.records import Assured, Stored
from cell.messages import (
    AdoptZone,
    AxisStatus,
    Body,
    BusCounters,
    Clearance,
    ClearZone,
    Command,
    Confinement,
    ConfineRobot,
    Continue,
    Enable,
    EndAssurance,
    GatewayState,
    Halt,
    Heard,
    ManagerState,
    Mode,
    NodeStatus,
    OutputEvent,
    PlannedWay,
    Presence,
    Refusal,
    ResetEstop,
    RobotStands,
    Run,
    SetOverride,
    SetpointBlock,
    Stop,
)
from cell.messages.sections import NO_PIECE, Sections, Stay, Way
from cell.net.binary import FARTHEST_M, MOST_COUNT
from cell.net.codec import decode, encode
from cell.net.errors import CodecError
from tests.unit.across.travelling import fit_to_travel
from tests.unit.agent_runs import until
from tests.unit.agent_world import AgentWorld
from tests.unit.gateway_world import World as GatewayWorld
from tests.unit.manager_world import World as ManagerWorld
from tests.unit.manager_world import settings

ROBOTS = ("left", "middle", "right")
ZONES = ("middle", "press")
SPACING_M = 0.25
"""From one place of the cell to the next: of which neighbours are too near to each other."""

NODES = tuple(NodeStatus(1, robot, "J1", "Operational", AxisStatus.OPERATION_ENABLED) for robot in ROBOTS)
COUNTERS = BusCounters(0, 0, 0.0, 0, 0, 0, 0.0)
GATEWAY = GatewayState("bus", "g1", 0, 0.004, "virtual", True, "", {}, None, (), COUNTERS, era=1)
Random = np.random.Generator


def read(message: Any) -> Any:
    """What arrives of a message; None where the codec refuses it."""
    try:
        return decode(type(message), encode(message))
    except CodecError:
        return None


@dataclass
class Somebody:
    """Speaks for one robot of the cell, whose planned ways all lead from place 0 on to the next ones."""

    robot: str
    rng: Random
    wild: float
    """So often what it says of one thing fits nothing else."""
    hurry: float
    """So often it has moved on since it spoke last."""
    place: int
    backwards: bool = False
    """It passes the places of the cell in the other order."""
    owner: int = 10
    sequence: int = 10**6
    number: int = 0
    pieces: int = 0
    """Of its newest plan."""
    known: bool = True
    """It knows where it is."""
    upto: int = 0
    """The first place that it does not own."""
    cleared: list[Clearance] = field(default_factory=list)

    def take(self, clearance: Clearance) -> None:
        self.cleared.append(clearance)
        if clearance.presence == self.sequence:
            self.upto += clearance.cleared

    def lose_or_find_itself(self) -> None:
        self.known = not self.known

    def start_again(self) -> None:
        """Another agent, which has another claim and no plan."""
        self.owner, self.number, self.upto = self.fit(self.owner + 1, MOST_COUNT), 0, self.place + 1

    def odd(self) -> bool:
        return bool(self.rng.random() < self.wild)

    def one_of(self, *values: Any) -> Any:
        return values[int(self.rng.integers(len(values)))]

    def fit(self, value: Any, *others: Any) -> Any:
        """This value, or one of the others where it is odd."""
        return self.one_of(*others) if self.odd() else value

    def at_m(self, place: int) -> float:
        return SPACING_M * (20 - place if self.backwards else place)

    def sections(self, places: Sequence[int], capsules: int) -> Sections:
        """Balls at these places, under ids by which they are known again; odd ones are anywhere and of any size."""
        n = len(places)
        ids = np.array(places, np.uint64) + np.uint64(1000 * capsules + 100_000 * self.backwards)
        points = np.zeros((n, capsules, 2, 3), np.float32)
        points[..., 0] = np.array([self.at_m(place) for place in places], np.float32)[:, None, None]
        radii = np.full((n, capsules), 0.1, np.float32)
        if self.odd():
            ids = self.rng.choice(np.array([0, 1, 2**63, 2**64 - 1], np.uint64), n)
            points = self.rng.choice(np.float32([-FARTHEST_M, 0.0, 0.3, FARTHEST_M]), points.shape)
            radii = self.rng.choice(np.float32([0.0, 0.1, FARTHEST_M]), radii.shape)
        return Sections(ids, points, radii)

    def body(self) -> Body:
        poses, capsules = self.fit(1, 0, 2), self.one_of(1, 3)
        points = np.zeros((poses, capsules, 2, 3), np.float32)
        points[..., 0] = self.fit(self.at_m(self.place), self.at_m(self.place + 2), FARTHEST_M)
        base, reach_m = self.fit((0.0, 0.0, 0.0), (FARTHEST_M, -FARTHEST_M, 0.0)), self.fit(0.5, 0.0, FARTHEST_M)
        radii, growth = np.full(capsules, 0.1, np.float32), np.zeros(poses, np.float32)
        return Body(self.fit(self.known, not self.known), base, reach_m, radii, points, growth, points[:, -1, 1])

    def way(self) -> Way:
        if self.rng.random() < self.hurry:
            self.place = max(min(self.place + 1, self.upto - 1) + self.fit(0, -1, 3), 0)
        self.upto = max(self.upto, self.place + 1)
        owned, asked = self.fit(self.upto - self.place, 0, 1), max(min(3, self.pieces - self.upto), 0)
        count = owned + self.fit(asked, 0, 3, 300)
        capsules = self.fit(1, 4)
        plan = self.fit(self.number, self.number + 1, 0, MOST_COUNT)
        pieces = np.arange(self.place, self.place + count)
        if self.odd():
            pieces = self.rng.choice([0, self.pieces, self.pieces + 1, 10**6, NO_PIECE], count)
        pieces = pieces.astype(np.uint32)[: self.fit(count if plan else 0, count, 0)]
        links = self.one_of((), ("base", "hand"), tuple(map(str, range(capsules))))
        fixed = self.fit((), (0,), (0, 7, MOST_COUNT))
        committed = int(self.rng.integers(0, owned + 1))
        return Way(
            self.sections(range(self.place, self.place + count), capsules), committed, owned, links, fixed, plan, pieces
        )

    def presence(self, state: ManagerState) -> Presence:
        self.sequence += 1
        newest = self.cleared[-1].number if self.cleared else 0
        return Presence(
            self.robot, f"b{self.owner}", self.fit(self.owner, 0, self.owner - 1), self.sequence,
            self.fit(Heard(state.boot, state.sequence), None, Heard("x", 1)), "digest", self.body(),
            self.fit(0.0, 0.3, 1e9),
            wants=self.one_of({}, {"middle": 0.0}, {"middle": 0.0, "press": 0.0}), standing=self.fit(True, False),
            epoch=self.fit(state.epoch, 0, 6), taken=self.fit(newest, 0, MOST_COUNT), way=self.way(),
            mode=self.one_of(*Mode, None),
        )  # fmt: skip

    def planned_way(self) -> PlannedWay:
        self.number += self.fit(1, 0)
        self.pieces = self.fit(20, 0, 1, 4)
        spans = [sorted(self.rng.integers(0, max(self.pieces, 1), 2).tolist()) for _ in range(self.one_of(0, 1, 2))]
        stays = tuple(Stay(self.fit(self.one_of(*ZONES), "nowhere"), first, last) for first, last in spans)
        if self.odd():
            stays += (Stay("middle", self.one_of(0, MOST_COUNT), self.one_of(0, self.pieces, MOST_COUNT)),)
        pieces = self.sections(range(self.pieces), self.one_of(1, 1, 2))
        return PlannedWay(
            self.robot, f"b{self.owner}", self.owner, self.number, self.one_of(True, False), pieces, stays
        )

    def command(self) -> Command:
        size = self.one_of((1.0, 1.0, 1.0), (1e-6, 1e-6, 1e-6), (FARTHEST_M, FARTHEST_M, FARTHEST_M))
        box = Confinement(size, (SPACING_M * self.place, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0))
        command: Command = self.one_of(
            ConfineRobot(self.robot, box, "op"), ConfineRobot(self.robot, box, "op"), RobotStands(self.robot, "op"),
            RobotStands(self.robot, "op"), EndAssurance(self.robot, "op"), ClearZone("middle", "op"),
            AdoptZone("middle", self.robot, "op"), ResetEstop("op", ()),
        )  # fmt: skip
        return command


class AnyManager(ManagerWorld):
    """All that it says must be fit to travel; clearances reach those who speak for their robots."""

    def __init__(self, rng: Random) -> None:
        super().__init__(settings(ROBOTS, ZONES))
        self.robots = {}
        wild, hurry = float(rng.choice([0.002, 0.01, 0.1])), float(rng.choice([0.0, 0.1, 0.4]))
        first, last = ((0, 6), (0, 14), (8, 13))[int(rng.integers(3))]
        self.speakers = {
            robot: Somebody(robot, rng, wild, hurry, int(rng.integers(first, last)), bool(rng.integers(2)))
            for robot in ROBOTS
        }
        self.gateway = replace(GATEWAY, setup=(ROBOTS[int(rng.integers(3))],) if rng.random() < 0.2 else ())

    def hear(self, message: Any) -> None:
        """What the codec lets through."""
        read_one = read(message)
        if read_one is not None:
            self.manager.receive(read_one, self.now)

    def gateway_speaks(self, rng: Random) -> None:
        """One bus has all robots; some of its drives are on, some robots are to be set up."""
        self.gateway = replace(
            self.gateway, sequence=self.gateway.sequence + 1, heard=Heard(self.state.boot, self.state.sequence),
            nodes=tuple(node for node in NODES if rng.random() < 0.05),
        )  # fmt: skip
        if rng.random() < 0.7:
            self.hear(self.gateway)

    def restart(self) -> None:
        """Another manager, with what operators have said."""
        said = tuple(record for record in self.records if isinstance(record, Assured))
        self.restart_manager(self.state.epoch + 1, f"m{self.state.epoch}", Stored(assured=said))
        self.run(0.01)

    def _perform(self, effect: Effect) -> None:
        fit_to_travel(effect)
        match effect:
            case Publish(Clearance() as clearance):
                self.speakers[clearance.robot].take(clearance)
            case Publish(message) if type(message) is not ManagerState:
                pass
            case _:
                super()._perform(effect)


@cache
def say_anything_to_a_manager(seed: int) -> AnyManager:
    """A world after some messages in a random order, most of which build on what was said before."""
    rng = np.random.default_rng(seed)
    world = AnyManager(rng)
    world.run(0.01)
    for who in world.speakers.values():
        world.hear(who.planned_way())
    pace_s = float(rng.choice([0.01, 0.15]))
    for _ in range(40):
        for who in world.speakers.values():
            what = rng.random()
            if what < 0.01:
                who.start_again()
            elif what < 0.02:
                who.lose_or_find_itself()
            elif what < 0.05:
                world.ask(who.command())
            elif what < 0.08:
                world.hear(who.planned_way())
            elif what < 0.9:
                world.hear(who.presence(world.state))
        world.gateway_speaks(rng)
        world.now += who.fit(pace_s, 0.6)
        world.run(0.01)
        if who.odd() and who.odd():
            world.restart()
    return world


@pytest.mark.parametrize("seed", range(40))
def test_whatever_robots_say_of_their_room_leaves_the_manager_alive(seed: int) -> None:
    say_anything_to_a_manager(seed)


def test_what_is_said_there_is_cleared_and_refused() -> None:
    """Else it would reach nothing of what answers it."""
    answers = [
        each for seed in range(20) for who in say_anything_to_a_manager(seed).speakers.values() for each in who.cleared
    ]
    assert any(each.cleared for each in answers)
    assert {each.refused.by for each in answers if each.refused is not None} >= {*ROBOTS, ""}


class AnyAgent(AgentWorld):
    """All that it says must be fit to travel; its gateway takes what it sends."""

    def _perform(self, effect: Effect) -> None:
        fit_to_travel(effect)
        super()._perform(effect)

    def hear_any_clearance(self, rng: Random) -> None:
        """Of this manager or another one, for this claim or another one, in any order, of more than was asked for."""

        def one_of(*values: Any) -> Any:
            return values[int(rng.integers(len(values)))]

        sequence, number = self.presences[-1].sequence, self._clearances
        refused = Refusal(one_of("right", "left", ""), "so it is", "hand", "hand", one_of(-1e12, 0.0, 1e12), 1e9)
        clearance = Clearance(
            one_of("left", "left", "right"), one_of("m", "m", "x"), one_of(5, 5, 4, 6, MOST_COUNT),
            one_of(7, 7, 6, 8, 0, MOST_COUNT), one_of(sequence, sequence - 1, sequence + 5, 0, MOST_COUNT),
            one_of(number, number + 1, number + 7, 0), one_of(0, 1, 3, 1000, MOST_COUNT), one_of(None, refused),
            one_of(True, False),
        )  # fmt: skip
        self.agent.receive(read(clearance), self.now)


@pytest.mark.parametrize("seed", range(3))
def test_whatever_is_cleared_leaves_an_agent_alive(seed: int) -> None:
    rng = np.random.default_rng(seed)
    world = AnyAgent("MJ J1=40\nML Z=1500 F=500\nMJ J1=0 J2=-20 J3=30 J5=60\nEND", separation=SeparationSettings(0.03))
    until(world, lambda: world.states != [] and world.state.mode is Mode.DISABLED)
    world.call(Enable())
    world.run(0.1)
    world.call(Run())
    world.clears = int(rng.choice([1, 2, 5, 50]))
    orders = Halt(), Continue(), SetOverride(50.0), SetOverride(-50.0), Stop(), Run()
    for _ in range(60):
        if rng.random() < 0.4:
            world.hear_any_clearance(rng)
        if rng.random() < 0.05:
            world.call(orders[int(rng.integers(len(orders)))])
        world.step()


@pytest.mark.parametrize("seed", range(6))
def test_whatever_its_owner_sends_leaves_a_gateway_alive(seed: int) -> None:
    """Blocks that go on where the robot is, but for one thing or another."""
    rng = np.random.default_rng(seed)
    world = GatewayWorld()
    owner = world.enabled()
    for sequence in range(1, 60):

        def fit(value: Any, *others: Any) -> Any:
            return others[int(rng.integers(len(others)))] if rng.random() < 0.1 else value

        feedback = world.feedback
        assert feedback is not None
        n, m = fit(2, 1, 6), fit(10, 1, 300)
        position = np.resize(feedback.commanded, (m, n)) + fit(0.0, 1e-9, 1e12 - 1.0)
        velocity, torque = np.full((m, n), fit(0.0, 1e12)), fit(None, np.zeros((m, n)), np.full((m, n), -1e12))
        first_tick = feedback.tick + fit(5, 0, 1, 200, MOST_COUNT - feedback.tick)
        events = tuple(
            OutputEvent(fit(first_tick, 0, MOST_COUNT), fit(sequence, MOST_COUNT), fit(0, 65535), True)
            for _ in range(fit(0, 1, 100))
        )
        block = SetpointBlock(
            "left", fit(owner, owner + 1, 0), fit(sequence, 0, MOST_COUNT), fit(feedback.block, 0, MOST_COUNT),
            first_tick, fit(0.004, 1.0, 1e-300), fit(m, 0), position, velocity, torque, events, fit(False, True),
            fit(0, MOST_COUNT),
        )  # fmt: skip
        arrived = read(block)
        if arrived is not None:
            world.tell(arrived)
        world.run(0.02)
    assert world.state is not None
    assert world.state.counters.blocks_accepted > 0
