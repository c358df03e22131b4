"""Programs with branches, loops, inputs and flags, drawn from a seed, on one agent that is halted at bad moments.

What each program has to do is worked out from the tree that it was written from, without the product. Inputs are wrong
until the robot stands where they are asked for, or come in time or too late, by time in which the program goes on; some
stay wrong there, and are forced until the program has gone on.

python -m tests.sim.condition_checker --seeds 0:40
"""

import argparse
import json
import random
import sys
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from cell.messages import AnswerFlag, Continue, Enable, ForceInput, Halt, Mode, ProgramState, Run
from tests.unit.agent_world import STEP_S, AgentWorld

_LONGEST_S = 200.0
_TIMEOUT_S = 1.0
_IN_TIME_S = 0.3
_FORCED = 0.3
"""Share of the questions without a time-out that a force answers."""
_HALTED, _HALTED_AT_TIMEOUT = 0.02, 0.08
"""Share of the steps that begin with a halt."""


@dataclass(frozen=True, slots=True)
class Do:
    """A move, and a flag that is counted at its end; or a flag that is waited for."""

    flag: int
    waits: bool


@dataclass(frozen=True, slots=True)
class Fork:
    """An IF, or a WAIT DI that has a way out at its time-out."""

    timed: bool
    holds: "tuple[Node, ...]"
    otherwise: "tuple[Node, ...]"


@dataclass(frozen=True, slots=True)
class Loop:
    """So many rounds, counted by a variable."""

    rounds: int
    body: "tuple[Node, ...]"


Node = Do | Fork | Loop


def draw(rng: random.Random, depth: int = 0) -> tuple[Node, ...]:
    """A few nodes."""
    nodes: list[Node] = []
    for _ in range(rng.randint(1, 3)):
        kind = rng.random()
        if kind < 0.4 or depth == 2:
            nodes.append(Do(rng.randint(1, 99), rng.random() < 0.3))
        elif kind < 0.8:
            nodes.append(Fork(rng.random() < 0.4, draw(rng, depth + 1), draw(rng, depth + 1)))
        else:
            nodes.append(Loop(rng.randint(1, 3), draw(rng, depth + 1)))
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
    names: int = 0

    def write(self, nodes: tuple[Node, ...]) -> None:
        """Add these nodes."""
        for node in nodes:
            self.names += 1
            name = self.names
            match node:
                case Do(flag, waits):
                    edge = self.rng.choice(["", " R=5"])
                    move = [] if waits else [f"MJ J1={self.rng.randint(-8, 8)} J2={self.rng.randint(-4, 4)}{edge}"]
                    self.lines += [*move, f"M {flag}" if waits else f"M {flag} ASYNC"]
                case Fork(timed, holds, otherwise):
                    asked = f"WAIT DI part TIMEOUT {_TIMEOUT_S} GOTO late{name}" if timed else "IF DI part"
                    self.lines.append(asked)
                    self.forks[len(self.lines)], self.line_of[id(node)] = timed, len(self.lines)
                    self.write(holds)
                    self.lines += [f"GOTO on{name}", f"LABEL late{name}"] if timed else ["ELSE"]
                    self.write(otherwise)
                    self.lines.append(f"LABEL on{name}" if timed else "ENDIF")
                case Loop(rounds, body):
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


def expected(nodes: tuple[Node, ...], written: Written, truth: Truth, asked: dict[int, int]) -> Iterator[int]:
    """The flags that come up, in their order."""
    for node in nodes:
        match node:
            case Do(flag):
                yield flag
            case Fork(_, holds, otherwise):
                line = written.line_of[id(node)]
                asked[line] = asked.get(line, -1) + 1
                chosen = holds if truth.holds(line, asked[line]) else otherwise
                yield from expected(chosen, written, truth, asked)
            case Loop(rounds, body):
                for _ in range(rounds):
                    yield from expected(body, written, truth, asked)


class Checked:
    """One run."""

    def __init__(self, seed: int) -> None:
        self._rng = random.Random(seed)
        self._truth = Truth(seed)
        nodes = draw(self._rng)
        self._written = Written(self._rng)
        self._written.write(nodes)
        self.expected = list(expected(nodes, self._written, self._truth, {}))
        self.world = AgentWorld("\n".join([*self._written.lines, "END"]))
        self.came: list[int] = []
        self._asked: dict[int, int] = {}
        self._waiting = self._forced = False
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
        return "" if self.came == self.expected else "a program does what its text says"

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

    def _tell(self) -> None:
        """The input, wrong unless the robot waits for it, where there is a time-out for some time."""
        program = self.world.state.program
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


def main() -> int:
    """The command; what it writes is as `tests.sim.search` has it."""
    parser = argparse.ArgumentParser(description="search programs with conditions that do not do what they say")
    parser.add_argument("--seeds", metavar="A:B", required=True, help="from A up to before B")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write what was found there")
    parser.add_argument("--stop-at-first", action="store_true", help="end at the first run that is broken")
    options = parser.parse_args()
    first, _, last = options.seeds.partition(":")
    found: list[dict[str, object]] = []
    runs = 0
    for seed in range(int(first), int(last)):
        runs += 1
        what, at_s = broken(seed)
        if what:
            print(f"run {seed}: {what}", flush=True)
            found.append({"seed": seed, "invariant": what, "at_s": at_s})
        if found and options.stop_at_first:
            break
    print(f"{runs} runs, {len(found)} broken")
    if options.json is not None:
        options.json.write_text(json.dumps({"seeds": runs, "broken": found}) + "\n")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
