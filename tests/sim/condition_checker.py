"""Programs with branches, loops, subroutines, inputs, outputs and flags, drawn from a seed.

They run on one agent that is halted at bad moments, and let back along its path.

What each program has to do is worked out from the tree that it was written from, without the product. Inputs are wrong
until the robot stands where they are asked for, or come in time or too late, by time in which the program goes on; some
stay wrong there, and are forced until the program has gone on.

python -m tests.sim.condition_checker --seeds 0:40
"""

import random
import sys
from collections.abc import Iterator
from dataclasses import dataclass, field
from enum import Enum, auto

import numpy as np

from cell.messages import AnswerFlag, Continue, Enable, ForceInput, Halt, Mode, ProgramState, Run, SetOverride
from tests.sim.checker import search
from tests.unit.agent_world import STEP_S, AgentWorld
from tests.unit.output_ticks import FIRST_TICK

_LONGEST_S = 200.0
_AT_DEG = 0.6
"""A tick of a fast move, and the round edge."""
_TIMEOUT_S = 1.0
_IN_TIME_S = 0.3
_FORCED = 0.3
"""Share of the questions without a time-out that a force answers."""
_HALTED, _HALTED_AT_TIMEOUT = 0.02, 0.08
"""Share of the steps that begin with a halt."""
_BACK = 0.004
"""Share of the steps from which on the robot goes back for a while."""


@dataclass(frozen=True, slots=True)
class Do:
    """A move, and a flag that is counted at its end; or a flag that is waited for. Then perhaps an output."""

    flag: int
    waits: bool
    switches: bool | None


@dataclass(frozen=True, slots=True)
class Fork:
    """An IF, or a WAIT DI that has a way out at its time-out."""

    timed: bool
    holds: "tuple[Node, ...]"
    otherwise: "tuple[Node, ...]"


class Counted(Enum):
    """How a loop is written."""

    BY_VARIABLE = auto()
    BY_GOTO = auto()
    BY_SUB = auto()


@dataclass(frozen=True, slots=True)
class Loop:
    """So many rounds."""

    rounds: int
    counted: Counted
    body: "tuple[Node, ...]"


Node = Do | Fork | Loop


def draw(rng: random.Random, depth: int = 0) -> tuple[Node, ...]:
    """A few nodes."""
    nodes: list[Node] = []
    for _ in range(rng.randint(1, 3)):
        kind = rng.random()
        if kind < 0.4 or depth == 2:
            nodes.append(Do(rng.randint(1, 99), rng.random() < 0.3, rng.choice([None, True, False])))
        elif kind < 0.8:
            nodes.append(Fork(rng.random() < 0.4, draw(rng, depth + 1), draw(rng, depth + 1)))
        else:
            nodes.append(Loop(rng.randint(1, 3), rng.choice(list(Counted)), draw(rng, depth + 1)))
    return tuple(nodes)


@dataclass(slots=True)
class Written:
    """A program, and the line in which each fork stands."""

    rng: random.Random
    lines: list[str] = field(default_factory=list)
    forks: dict[int, bool] = field(default_factory=dict)
    """By line, whether it has a time-out."""
    line_of: dict[int, int] = field(default_factory=dict)
    """By the identity of a node."""
    place_of: dict[int, tuple[int, int]] = field(default_factory=dict)
    """Where the move of a node ends, J1 and J2 [deg], by its identity; not of one that only waits."""
    names: int = 0
    subs: list[tuple[int, "tuple[Node, ...]"]] = field(default_factory=list)
    """Those that are called and not written yet."""

    def program(self, nodes: tuple[Node, ...]) -> str:
        """Of these nodes, with its subroutines."""
        self.write(nodes)
        self.lines.append("END")
        while self.subs:
            name, body = self.subs.pop(0)
            self.lines.append(f"LABEL sub{name}")
            self.write(body)
            self.lines.append("END")
        return "\n".join(self.lines)

    def write(self, nodes: tuple[Node, ...]) -> None:
        """Add these nodes."""
        for node in nodes:
            self.names += 1
            name = self.names
            match node:
                case Do(flag, waits, switches):
                    edge = self.rng.choice(["", " R=5"])
                    move = list[str]()
                    if not waits:
                        j1, j2 = self.place_of[id(node)] = self.rng.randint(-8, 8), self.rng.randint(-4, 4)
                        move = [f"MJ J1={j1} J2={j2}{edge}"]
                    self.lines += [*move, f"M {flag}" if waits else f"M {flag} ASYNC"]
                    if switches is not None:
                        self.lines.append(f"{'SET' if switches else 'RESET'} DO gripper")
                case Fork(timed, holds, otherwise):
                    asked = f"WAIT DI part TIMEOUT {_TIMEOUT_S} GOTO late{name}" if timed else "IF DI part"
                    self.lines.append(asked)
                    self.forks[len(self.lines)], self.line_of[id(node)] = timed, len(self.lines)
                    self.write(holds)
                    self.lines += [f"GOTO on{name}", f"LABEL late{name}"] if timed else ["ELSE"]
                    self.write(otherwise)
                    self.lines.append(f"LABEL on{name}" if timed else "ENDIF")
                case Loop(rounds, Counted.BY_SUB, body):
                    self.lines.append(f"SUB sub{name} {rounds}")
                    self.subs.append((name, body))
                case Loop(rounds, Counted.BY_GOTO, body):
                    self.lines.append(f"LABEL again{name}")
                    self.write(body)
                    self.lines += [f"GOTO again{name} {rounds - 1}"] if rounds > 1 else []
                case Loop(rounds, _, body):
                    self.lines += [f"LET n{name} = 0", f"LABEL again{name}"]
                    self.write(body)
                    self.lines += [f"LET n{name} = n{name} + 1", f"IF n{name} < {rounds}", f"GOTO again{name}", "ENDIF"]


@dataclass(slots=True)
class Truth:
    """What is asked at a line, each time the robot comes there, by lot."""

    seed: int

    def holds(self, line: int, time: int) -> bool:
        """The time-th one, from 0."""
        return random.Random(f"{self.seed} {line} {time}").random() < 0.5

    def forced(self, line: int, time: int) -> bool:
        """Whether it is told by a force, and measured otherwise."""
        return random.Random(f"{self.seed} force {line} {time}").random() < _FORCED


@dataclass(frozen=True, slots=True)
class Switched:
    """An output is switched, with J1 and J2 [deg] there; None before the first move."""

    on: bool
    place: tuple[int, int] | None


@dataclass(slots=True)
class Going:
    """What of the past matters for what comes."""

    asked: dict[int, int] = field(default_factory=dict)
    """How often, by line, less one."""
    place: tuple[int, int] | None = None


def expected(nodes: tuple[Node, ...], written: Written, truth: Truth, going: Going) -> Iterator[int | Switched]:
    """The flags that come up, and what is switched, in their order."""
    for node in nodes:
        match node:
            case Do(flag, _, switches):
                going.place = written.place_of.get(id(node), going.place)
                yield flag
                if switches is not None:
                    yield Switched(switches, going.place)
            case Fork(_, holds, otherwise):
                line = written.line_of[id(node)]
                going.asked[line] = going.asked.get(line, -1) + 1
                chosen = holds if truth.holds(line, going.asked[line]) else otherwise
                yield from expected(chosen, written, truth, going)
            case Loop(rounds, _, body):
                for _ in range(rounds):
                    yield from expected(body, written, truth, going)


class Checked:
    """One run."""

    def __init__(self, seed: int) -> None:
        self._rng = random.Random(seed)
        self._truth = Truth(seed)
        nodes = draw(self._rng)
        self._written = Written(self._rng)
        text = self._written.program(nodes)
        self.expected = list(expected(nodes, self._written, self._truth, Going()))
        self.world = AgentWorld(text)
        self.world.outputs = ("gripper",)
        self.came: list[int] = []
        self._asked: dict[int, int] = {}
        self._waiting = self._forced = False
        self._left_at: int | None = None
        """The line of the question from which the robot was let back, and to which it comes again."""
        self._counted: dict[str, int] = {}

    def run(self) -> str:
        """What is wrong; empty for nothing."""
        world = self.world
        world.inputs = {"part": True}
        self._until(Mode.DISABLED, None)
        self._until(Mode.READY, Enable())
        self._until(Mode.RUNNING, Run())
        until = world.now + _LONGEST_S
        while world.state.program.state is ProgramState.RUNNING and world.now < until:
            self._halt_perhaps()
            self._tell()
            world.step()
            self._look()
        if world.state.program.state is not ProgramState.DONE:
            return f"a program comes to its end: {world.state.program.error or world.state.waiting_for}"
        if self.came != [each for each in self.expected if isinstance(each, int)]:
            return "a program does what its text says"
        for _ in range(20):  # what is switched at the end may still be under way
            world.step()
        due = [each for each in self.expected if isinstance(each, Switched)]
        if [event.value for _, event in world.switched] != [each.on for each in due]:
            return "it switches what it says"
        in_place = all(self._is_at(each, tick) for each, (tick, _) in zip(due, world.switched, strict=True))
        return "" if in_place else "it switches where the move before ends"

    def _is_at(self, due: Switched, tick: int) -> bool:
        """Whether the robot was where an output is due, or in the round edge there."""
        if due.place is None:
            return True
        j1, j2 = np.degrees(self.world.played[tick - FIRST_TICK][:2])
        return abs(j1 - due.place[0]) < _AT_DEG and abs(j2 - due.place[1]) < _AT_DEG

    def _until(self, mode: Mode, order: Enable | Run | None) -> None:
        if order is not None:
            self.world.call(order)
        for _ in range(500):
            self.world.step()
            if self.world.states and self.world.state.mode is mode:
                return

    def _halt_perhaps(self) -> None:
        program = self.world.state.program
        timed = program.waits_s is not None and self._written.forks.get(program.line, False)
        share = _HALTED_AT_TIMEOUT if timed else _HALTED
        if self._rng.random() < share and self.world.state.mode is Mode.RUNNING:
            self.world.call(Halt())
            for _ in range(self._rng.randint(1, 60)):
                self.world.step()
                self._look()
            self.world.call(Continue())
        elif self._rng.random() < _BACK:
            self._left_at = self.world.state.program.line if self._waiting else None
            self.world.call(SetOverride(-100.0))
            for _ in range(self._rng.randint(5, 100)):
                self.world.step()
                self._look()
            self.world.call(SetOverride(100.0))

    def _tell(self) -> None:
        """The input, wrong unless the robot waits for it, where there is a time-out for some time."""
        program = self.world.state.program
        if self._left_at is not None and program.line != self._left_at:
            return
        self._left_at = None
        if program.waits_s is None or program.line not in self._written.forks or program.flag is not None:
            if self._forced:
                self.world.call(ForceInput("part", None))
            self._waiting = self._forced = False
            self.world.inputs = {"part": not any(self._written.forks.values()) and self._rng.random() < 0.5}
            return
        if not self._waiting:
            self._waiting = True
            self._asked[program.line] = self._asked.get(program.line, -1) + 1
        holds = self._truth.holds(program.line, self._asked[program.line])
        timed = self._written.forks[program.line]
        if not timed and self._truth.forced(program.line, self._asked[program.line]):
            self.world.inputs, self._forced = {"part": not holds}, True
            self.world.call(ForceInput("part", holds))
            return
        self.world.inputs = {"part": holds and (not timed or program.waits_s > _IN_TIME_S)}

    def _look(self) -> None:
        """Note the flags that came up; answer one that waits."""
        program = self.world.state.program
        for flag, count in program.raised.items():
            self.came += [int(flag)] * (count - self._counted.get(flag, 0))
        self._counted = dict(program.raised)
        if program.flag is not None:
            self.came.append(program.flag)
            self.world.call(AnswerFlag(program.flag))


def broken(seed: int) -> tuple[str, float]:
    """What is wrong in the run of a seed, empty for nothing; and when [s]."""
    checked = Checked(seed)
    return checked.run(), len(checked.world.states) * STEP_S


if __name__ == "__main__":
    sys.exit(search("search programs with conditions that do not do what they say", broken))
