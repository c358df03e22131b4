"""A robot with an unkind drive to which things happen, an operator who goes on trying, and calm after it.

All of it is drawn from one seed, so a life that fails is lived again by its number.
"""

import random
from collections.abc import Callable, Sequence

import numpy as np

from cell.core import Frozen
from cell.messages import AcceptPosition, EnableDrives, HoldSetup, Home, MoveAxes, PlayoutState, ResetDrives
from drive_gateway.canopen.cob_id import EMCY, ERROR_CONTROL, SDO_FROM_NODE, SYNC, TPDO1
from drive_gateway.canopen.frame import CanFrame
from drive_gateway.gateway.bus.bus_news import BusBack, BusDisturbed, BusFailed, SecondMaster
from tests.sim.unkind.bench import AT_REST, BRAKE, MOVE_S, PLAIN, UNKIND, WAY, Changes, Refused, UnkindBench
from tests.sim.unkind.expected import REFUSED
from tests.sim.unkind.traits.register import TRAITS

TROUBLED_S = 8.0
CALM_S = 1.5
TOLD_S = 5.0
"""Whoever is not ready for so long says why."""
CODES = (0x4310, 0x2310, 0x8611, 0x8120, 0x8130, 0x5530, 0xFF01, 0x0000)
STRIKES = (
    "dropped", "power", "emergency", "blocked", "deaf", "loss", "news", "adapter", "stall", "frames", "messages",
)  # fmt: skip
EACH, IN_ALL = 3, 4
"""So many things happen in a life, and all of them in so many lives, from a seed that they divide."""
FASTEST = 2.4
"""[rad/s] No axis goes faster, told or not: 1.2 times its speed."""


class TroubledBench(UnkindBench):
    """Every `strike` ends by itself."""

    def __init__(self, seed: int) -> None:
        self.rng = random.Random(seed)
        self.names = self.rng.sample(sorted(TRAITS), self.rng.randint(0, 3))
        self.helped = self.rng.random() < 0.8
        self.story: list[str] = []
        self._ends: list[tuple[float, Callable[[], None]]] = []
        self._strikes: list[tuple[float, str]] = []
        self._not_ready_since: float | None = None
        self._watched = False
        super().__init__(
            [TRAITS[name] for name in self.names], _changes(self.names) if self.helped else Changes({}, {})
        )
        kinds = list(STRIKES)
        random.Random(seed // IN_ALL).shuffle(kinds)
        mine = [kinds[(EACH * (seed % IN_ALL) + number) % len(kinds)] for number in range(EACH)]
        self._strikes = sorted((self.now + self.rng.uniform(0.0, TROUBLED_S), kind) for kind in mine)

    def cycle(self, late_s: float = 0.0) -> None:
        while self._strikes and self._strikes[0][0] <= self.now:
            self._strike(self._strikes.pop(0)[1])
        for item in [item for item in self._ends if item[0] <= self.now]:
            self._ends.remove(item)
            item[1]()
        before = self.places
        self.frames.clear()
        super().cycle(late_s)
        assert [frame.id == SYNC for frame in self.frames].count(True) == 1, "one SYNC in every cycle"
        assert np.abs(self.places - before).max() <= FASTEST * self.settings.cycle_s + AT_REST, "an axis jumped"
        self._tells_why()

    def _tells_why(self) -> None:
        state = self.state
        if state is None or state.ready or state.problem:
            self._not_ready_since = None
        elif self._not_ready_since is None:
            self._not_ready_since = self.now
        slow = {"starts_in_half_a_minute", "very_slow_sdo", "slow_sdo"} & set(self.names)
        assert slow or self._not_ready_since is None or self.now - self._not_ready_since < TOLD_S, "nobody says why"

    def says_why(self, refused: str) -> str:
        """What an operator reads of a robot that does not do as he wants: the answer, and what is wrong anyway."""
        assert "\n" not in refused
        return refused if self.state is None or not self.state.problem else f"{refused}; {self.state.problem}"

    @property
    def hopeless(self) -> bool:
        """A drive of which the file does not say what it needs, or cannot."""
        bad = [REFUSED[name] for name in self.names if name in REFUSED]
        return any(not self.helped or expected.helped_by is None for expected in bad)

    # What happens to it

    def _strike(self, what: str) -> None:
        node = self.bus.nodes[self.rng.choice((UNKIND, PLAIN))]
        self.story.append(f"{self.now - 10.0:.3f} s: {what} {node.node_id}")
        lasts_s = self.rng.choice((0.02, 0.2, 1.0))
        servo = node.servo
        match what:
            case "dropped":
                node.silence()
                self._later(lasts_s, lambda: node.silence(False))
            case "power":
                node.power_cycle()
            case "emergency":
                node.raise_emergency(self.rng.choice(CODES))
            case "blocked":
                servo.block(True)
                self._later(lasts_s, lambda: servo.block(False))
            case "deaf":
                servo.interpolate = lambda _target, _period_s: None
                self._later(lasts_s, lambda: servo.__dict__.pop("interpolate", None) and None)
            case "loss":
                share = self.rng.choice((0.02, 0.3))
                self.lost = lambda _frame: self.rng.random() < share
                self._later(lasts_s, self._whole)
            case "news":
                self.tell(self.rng.choice((BusDisturbed("no node acknowledges"), SecondMaster("somebody sends 080h"))))
            case "adapter":
                self.lost = lambda _frame: True
                self.tell(BusFailed("No such device"))
                self._later(lasts_s, self._back_again)
            case "stall":
                self._stall(self.rng.choice((0.001, 0.01, 0.03, 0.05, 0.3)))
            case "frames":
                self._hostile_frames(node.node_id)
            case "messages":
                self._hostile_messages()

    def _later(self, after_s: float, action: Callable[[], None]) -> None:
        self._ends.append((self.now + after_s, action))

    def _whole(self) -> None:
        self.lost = lambda _frame: False

    def _back_again(self) -> None:
        self._whole()
        self.tell(BusBack())

    def _stall(self, stall_s: float) -> None:
        """The loop stands still, the drives do not."""
        until = self.now + stall_s
        while self.now < until:
            self.now = min(until, self.now + 0.004)
            self.bus.step(self.now)
        if stall_s > 0.25:
            self._back.insert(0, Frozen(stall_s))

    def _hostile_frames(self, node_id: int) -> None:
        """Of any kind and length, but for process data of a whole drive: nobody can tell those from its own."""
        for _ in range(self.rng.choice((1, 20, 200))):
            number = self.rng.choice((EMCY, ERROR_CONTROL, SDO_FROM_NODE, TPDO1, 0x000, 0x280, 0x600))
            most = 5 if number == TPDO1 else 8
            number += self.rng.choice((0, node_id, 3, 127)) if number else 0
            self._deliver(CanFrame(number, self.rng.randbytes(self.rng.randint(0, most)), self.rng.random() < 0.1))

    def _hostile_messages(self) -> None:
        odd = self.rng.choice((float("nan"), float("inf"), -1e308, 1e308, 0.0, -1.0))
        if self.feedback is not None:
            with np.errstate(all="ignore"):
                self.tell(self._block(self.rng.choice((0, self.feedback.owner, 2**62)), 2**62, odd))
        self.request(MoveAxes("left", {"J1": odd, "X": 1.0}, True, 1.0, False))
        self.request(MoveAxes("left", {"J1": odd if odd else 1e300}, True, self.rng.choice((odd, 1.0)), True))
        self.request(Home("left", ("", "J9")))
        self.request(HoldSetup("left", "nobody"))
        self.request(EnableDrives("left", 2**62))
        self.request(ResetDrives("left", -1))

    # What an operator does about it

    def lives(self) -> None:
        """Raises `Refused`: it does not run although all is well again."""
        until = self.now + TROUBLED_S + CALM_S
        while self.now < until:
            try:
                self._tries()
            except Refused:
                self.run(0.1)
        self.run(0.5)
        self.stands()
        self.comes_up(self.hopeless)
        self._find_itself(last=True)
        self.moves(self.returns(), -WAY / 2)

    def _tries(self) -> None:
        """Once from wherever it is to a motion. Raises `Refused`."""
        if self.state is None or not self.state.ready or self.feedback is None:
            self.run(0.05)
            return
        self._find_itself()
        self._go(self.returns(), self.rng.choice((WAY, -WAY)))

    def _find_itself(self, last: bool = False) -> None:
        """`last`: nothing disturbs its homing any more."""
        assert self.state is not None
        missing = [node.reference_missing for node in self.state.nodes if not node.referenced]
        if any("home" in text for text in missing):
            if last:
                self._acknowledges()
                self.homes()
            else:
                self._home()
        elif missing:
            self.ask(AcceptPosition("left", ()))
            self.run(0.3)

    def _acknowledges(self) -> None:
        """A robot in a fault is reset, and stays off."""
        if self.feedback is not None and self.feedback.state is PlayoutState.FAULT:
            self._asked_for(ResetDrives(self.robot, self._claimed()))
            self.run(1.0)

    def _home(self) -> None:
        """For some time: whatever comes of it."""
        self._acknowledges()
        reply = self.ask(Home("left", ()))
        if not reply.ok:
            raise Refused(reply.text)
        self.stands(False)
        before = self.places[1]
        self.holder, self.said = self.robot, ("", "moving")
        until = self.now + 6.0
        while self.said[1] == "moving" and self.now < until:
            self.cycle()
            assert abs(self.places[1] - before) < AT_REST, "only J1 homes"
        self.holder = ""
        self._settles()

    def _go(self, owner: int, way: float) -> None:
        assert self.feedback is not None
        self.stands(False)
        start = self.places
        self.tell(self._block(owner, round(self.now * 1000), way))
        until = self.now + MOVE_S + 0.4
        low, high = np.minimum(start, start + way) - BRAKE, np.maximum(start, start + way) + BRAKE
        while self.now < until:
            self.cycle()
            assert ((low < self.places) & (self.places < high)).all(), "beyond the ends of the move"
        self._settles()

    def _settles(self) -> None:
        """Whatever happened, it comes to rest, and then it stays there."""
        self.run(0.7)
        self.stands()


def _changes(names: Sequence[str]) -> Changes:
    """What the drives file must say for drives with these traits."""
    bus: dict[str, object] = {}
    axis: dict[str, object] = {}
    for name in names:
        if name in REFUSED and (help_ := REFUSED[name].helped_by) is not None:
            bus |= help_.bus
            axis |= help_.axis
    return Changes(bus, axis)
