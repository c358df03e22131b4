"""Where a program rests until something is so: WAIT DI, IF and M.

An input counts there by what the gateway measured after the robot had come to rest, or had gone on after a halt: what
was before says nothing of what the program has just done. One that an operator has forced counts as that. Time at a
wait counts while the program goes on, forwards.
"""

import math
from dataclasses import replace

from cell.messages import DriveFeedback, ProgramStatus
from robot_agent.agent.program.forced_inputs import ForcedInputs
from robot_agent.agent.program.pace import Pace
from robot_agent.agent.program.plain_keys import PlainKeys
from robot_agent.agent.program.program_run import ProgramRun
from robot_agent.agent.program.shared_variables import SharedVariables
from robot_agent.agent.zones.gateway_signals import FRESH_S, GatewaySignals
from robot_agent.language import AwaitAnswer, AwaitInput, Decide, Question, Relation


class Waits:
    """At most one at a time, that of `run`."""

    def __init__(
        self,
        robot: str,
        run: ProgramRun,
        pace: Pace,
        signals: GatewaySignals,
        forced: ForcedInputs,
        keys: PlainKeys,
        variables: SharedVariables,
    ) -> None:
        self._robot = robot
        self._run = run
        self._pace = pace
        self._signals = signals
        self.forced = forced
        self._keys, self._variables = keys, variables
        self._step: AwaitInput | AwaitAnswer | Decide | None = None
        """The newest to which the program came."""
        self._waited = 0
        """Ticks there, without those in which the program was halted."""
        self._tick: int | None = None
        """The newest at which it waited; None while it does not."""
        self._since = 0.0
        """When the program came to it, or went on there."""
        self._answered = False
        self._now = 0.0
        self._cycle_s = 0.0
        self._outputs = 0
        run.lookahead.known = self._known_ahead

    def look(self, feedback: DriveFeedback, cycle_s: float, now: float) -> None:
        """Outputs are as the newest feedback has them."""
        self._outputs, self._cycle_s, self._now = feedback.outputs, cycle_s, now

    def follow(self, tick: int) -> None:
        """Wait where the program has come to by `tick`, go on, or end the program at a time-out."""
        step = None if self._pace.backwards else self._run.at_wait
        if step is None:
            self._tick = None
            return
        if step is not self._step:
            self._step, self._tick, self._waited, self._answered = step, None, 0, False
        if self._tick is None:
            self._since = self._now
        else:
            self._waited += tick - self._tick
        self._tick = tick
        match step:
            case AwaitAnswer(flag=flag):
                way_out = f"`cell flag {self._robot} {flag}`"
                self._settle(tick, self._answered or None, f"M {flag} waits for an answer: {way_out}")
            case AwaitInput(signal=signal, on=on):
                is_on = self._known_here(signal)
                self._settle(tick, None if is_on is None else is_on is on, self._why_not(step, is_on))
            case Decide(test=test):
                holds = test.holds(self._known_here)
                unknown = [signal for signal, _ in test.asked if self._known_here(signal) is None]
                self._settle(tick, holds, "; ".join(f"IF: {self._why_unknown(signal)}" for signal in unknown[:1]))

    def _settle(self, tick: int, holds: bool | None, why: str) -> None:
        """Go on if what is waited for holds, or an IF is decided; else wait for the reason `why`."""
        step = self._step
        if holds is True or (holds is False and isinstance(step, Decide)):
            self._run.leave_wait(tick, holds)
            return
        self._run.held_up = why
        if not isinstance(step, AwaitInput) or step.timeout_s is None or self.waited_s < step.timeout_s:
            return
        if step.target is not None:
            self._run.leave_wait(tick, False)
        else:
            self._run.fail(f"line {step.line}: {step.signal} was not in time, within {step.timeout_s:g} s: {why}")

    def answer(self, flag: int) -> str:
        """Somebody answers a flag: why that is not taken, for people; empty when it is."""
        waiting = self._flag
        if waiting == flag:
            self._answered = True
            return ""
        why = "no program waits at a flag" if waiting is None else f"its program waits at M {waiting}"
        return f"{why}: it goes on by `cell flag {self._robot} N` with the number of the M at which it waits"

    def told(self, status: ProgramStatus) -> ProgramStatus:
        """With what the program waits for."""
        waits = self._step is not None and self._step is self._run.lookahead.head
        return replace(status, flag=self._flag, waits_s=self.waited_s if waits else None)

    @property
    def waited_s(self) -> float:
        """At the newest wait [s]."""
        return self._waited * self._cycle_s

    @property
    def _flag(self) -> int | None:
        """The flag that is up: the program has come to it, halted there or not."""
        step = self._step
        waits = isinstance(step, AwaitAnswer) and step is self._run.lookahead.head and not self._answered
        return step.flag if waits and isinstance(step, AwaitAnswer) else None

    def _known_ahead(self, question: Question) -> bool | None:
        """As it is now, for an IF that is decided ahead of the motion."""
        return self._known(question, math.inf)

    def _known_here(self, question: Question) -> bool | None:
        """By what was measured, or told, since the program came here."""
        return self._known(question, self._here_s)

    @property
    def _here_s(self) -> float:
        return self._now - self._since

    def _known(self, signal: Question, oldest_s: float) -> bool | None:
        if isinstance(signal, Relation):
            return self._variables.holds(signal, self._now, oldest_s)
        if signal.kind == "DI" and signal.name in self.forced.on:
            return self.forced.on[signal.name]
        if signal.kind == "DI":
            return self._signals.closed(signal.name, self._now, min(oldest_s, FRESH_S))
        if signal.kind == "KEY":
            return self._keys.on(signal, self._now, oldest_s)
        names = self._run.outputs.names
        return bool(self._outputs >> names.index(signal.name) & 1) if signal.name in names else None

    def _why_unknown(self, signal: Question) -> str:
        if isinstance(signal, Relation):
            return self._variables.why_unknown(signal, self._now, self._here_s)
        if signal.kind == "DI":
            return self._signals.why_unknown(signal.name, self._now, min(self._here_s, FRESH_S))
        if signal.kind == "KEY":
            return self._keys.why_unknown(signal, self._now, self._here_s)
        return f"its gateway knows no output {signal.name}"

    def _why_not(self, step: AwaitInput, is_on: bool | None) -> str:
        if is_on is None:
            return f"WAIT DI: {self._why_unknown(step.signal)}"
        is_now, wanted = ("on", "off") if is_on else ("off", "on")
        if step.signal.name in self.forced.on:
            ends = f"`cell input {self._robot} {step.signal.name} follow` ends that"
            return f"{step.signal} is forced {is_now}, WAIT DI goes on when it is {wanted}; {ends}"
        if step.signal.kind == "KEY":
            return f"{step.signal} is {is_now}, WAIT DI goes on when it is {wanted}"
        tried = f"`cell simulate input {self._robot} {step.signal.name} {wanted}`"
        return f"{step.signal} is {is_now}, WAIT DI goes on when it is {wanted}; in a simulated cell {tried}"
