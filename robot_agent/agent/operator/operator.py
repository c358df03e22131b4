"""Operators' calls to an agent: they wait, are refused when they are too old, and are answered."""

from collections import deque
from dataclasses import replace

from cell.core import Answer, Effect, Request
from cell.messages import (
    Call,
    DisableDrives,
    EnableDrives,
    Halt,
    Heard,
    Mode,
    PlayoutState,
    Reply,
    ResetDrives,
    RobotState,
    Stop,
    Who,
)
from cell.net.freshness import Sent
from robot_agent.agent.drives.gateway_link import GatewayLink, Switching
from robot_agent.agent.mode import ModeEvent, after, stopped
from robot_agent.agent.operator.decisions import (
    MOVING,
    Decision,
    Decisions,
    Done,
    Passed,
    Refused,
    Situation,
    Taught,
    Virtual,
    Wanted,
)
from robot_agent.agent.operator.loading import Loading, ProgramNotRead
from robot_agent.agent.operator.teaching import Teaching


class OperatorCalls:
    """Answers operators.

    A call whose echo is older than `command_s` is refused, but `halt`, `stop` and `who`; one that lets the robot move,
    too, when its echo is of before the end of an emergency stop or of a fault.
    """

    def __init__(
        self,
        robot: str,
        boot: str,
        command_s: float,
        link: GatewayLink,
        decisions: Decisions,
        teaching: Teaching,
        loading: Loading,
    ) -> None:
        self._robot = robot
        self._boot = boot
        self._command_s = command_s
        self._link = link
        self._decisions = decisions
        self._teaching = teaching
        self._loading = loading
        self._states = Sent(boot)
        self._stopped_in = 0
        """The newest state that was sent under an emergency stop or in a fault."""
        self._requests: deque[Request] = deque()
        self._outcomes: deque[tuple[Switching, bool, str]] = deque()
        self._resets: set[str] = set()
        """Calls that were passed on in the present fault; an answer to an earlier one says nothing of it."""
        self._acknowledged = False
        """The drives have let go of that fault."""
        self._virtual: list[Request] = []

    def asked(self, request: Request) -> None:
        self._requests.append(request)

    def switched(self, outcome: tuple[Switching, bool, str] | None) -> None:
        """Take what the gateway said to a call that was passed on."""
        if outcome is not None:
            self._outcomes.append(outcome)

    @property
    def switched_off(self) -> bool:
        """The gateway has just said that the drives are off; this counts with the next `answer`."""
        return any(ok and isinstance(switching.command, DisableDrives) for switching, ok, _ in self._outcomes)

    def sent_state(self, state: RobotState, now: float) -> None:
        """A robot state is sent at `now`: calls that echo it are as young as that."""
        self._states.record(state.sequence, now)
        if stopped(state.mode):
            self._stopped_in = state.sequence

    def age_of(self, heard: Heard, now: float) -> float:
        """Age [s] of what an operator made in view of the robot state `heard`; infinite when it is no longer known."""
        return self._states.age(heard, now)

    def forget_echoes(self) -> None:
        self._states.forget()

    def take_virtual(self) -> list[Request]:
        """What was asked for of a virtual run since the last call; the run answers."""
        taken, self._virtual = self._virtual, []
        return taken

    def refuse_all(self, why: str) -> list[Effect]:
        """Answer everything that waits with a refusal, `who` excepted."""
        effects: list[Effect] = self._loading.answered(False, why)
        while self._requests:
            request = self._requests.popleft()
            call = request.call
            if isinstance(call, Call):
                who = isinstance(call.command, Who)
                effects.append(Answer(request.request_id, Reply(call.id, who, self._who() if who else why)))
        return effects

    def answer(self, mode: Mode, situation: Situation, now: float) -> tuple[Mode, list[Effect]]:
        """Carry out what waits, in a robot in `mode`; return its mode after it, and the effects."""
        effects: list[Effect] = []
        if mode is not Mode.FAULT:
            self._resets.clear()
            self._acknowledged = False
        mode = self._acknowledge(self._settle_outcomes(mode, effects), situation)
        mode = self._take_program(mode, situation, effects)
        while self._requests:
            request = self._requests.popleft()
            call = request.call
            if not isinstance(call, Call):
                continue
            result = self._decide(call, mode, situation, now)
            match result:
                case Passed(command, mode):
                    if isinstance(command, ResetDrives):
                        self._resets.add(call.id)
                    effects.append(self._link.switch(command, request.request_id, call.id))
                case Taught(name, point, planner):
                    effects.append(self._teaching.write(name, point, planner, request.request_id, call.id))
                case Wanted(file, planner):
                    effects.append(self._loading.read(file, planner, request.request_id, call.id))
                case Virtual():
                    self._virtual.append(request)
                    situation = replace(situation, virtual=True)
                case Done(text, mode, data):
                    effects.append(Answer(request.request_id, Reply(call.id, True, text, data=data)))
                case Refused(text):
                    effects.append(Answer(request.request_id, Reply(call.id, False, text)))
        return mode, effects

    def _settle_outcomes(self, mode: Mode, effects: list[Effect]) -> Mode:
        while self._outcomes:
            switching, ok, text = self._outcomes.popleft()
            if switching.request_id:
                effects.append(Answer(switching.request_id, Reply(switching.call_id, ok, text)))
            match switching.command:
                case EnableDrives() if not ok:
                    mode = after(mode, ModeEvent.NOT_ENABLED)
                case DisableDrives() if ok:
                    mode = after(mode, ModeEvent.DISABLED)
                case ResetDrives() if ok and switching.call_id in self._resets:
                    self._acknowledged = True
        return mode

    def _take_program(self, mode: Mode, situation: Situation, effects: list[Effect]) -> Mode:
        """What was read; with a mistake the old program stays."""
        match self._loading.outcome:
            case None:
                return mode
            case ProgramNotRead(reason=reason):
                remedy = "correct it and load again; `cell check` looks at all programs of a cell, `cell plot` at one"
                text = f"{self._robot} keeps its program, the new one is refused:\n{reason}\n{remedy}"
                effects += self._loading.answered(False, text)
                return mode
            case read:
                result = self._decisions.loaded(read.program, mode, situation)
        effects += self._loading.answered(isinstance(result, Done), result.text)
        return result.mode if isinstance(result, Done) else mode

    def _acknowledge(self, mode: Mode, situation: Situation) -> Mode:
        """The drives' answer may come before their feedback of it; what that still says is the fault of before."""
        if not self._acknowledged or situation.feedback.state in (PlayoutState.FAULT, PlayoutState.STOPPING):
            return mode
        self._acknowledged = False
        return after(mode, ModeEvent.ACKNOWLEDGED)

    def _decide(self, call: Call, mode: Mode, situation: Situation, now: float) -> Decision:
        command = call.command
        if isinstance(command, Who):
            return Done(self._who(), mode)
        if isinstance(command, Halt):
            return self._decisions.halt(mode, situation)
        if isinstance(command, Stop):
            return self._decisions.stop(mode, situation)
        age_s = self._states.age(call.heard, now)
        if why := self._too_old(call, age_s, mode):
            text = f"the call is too old to be carried out: it answers a state of {self._robot} {why}"
            return Refused(f"{text}; look at the robot, then call again")
        if self._link.switching_off and isinstance(command, MOVING):
            return Refused(f"{self._robot} is being switched off: when it is disabled, `cell enable {self._robot}`")
        return self._decisions.decide(command, mode, situation, now, now - age_s)

    def _too_old(self, call: Call, age_s: float, mode: Mode) -> str:
        """What is wrong with the state that a call answers; empty for nothing.

        Whoever wanted a robot to move while it was stopped did not see that it no longer is.
        """
        if age_s > self._command_s:
            known = "that is no longer known" if age_s == float("inf") else f"that is {age_s:.2f} s old"
            return f"{known}, {self._command_s:g} s are allowed"
        seen = 0 if call.heard is None else call.heard.sequence
        if isinstance(call.command, MOVING) and not stopped(mode) and seen <= self._stopped_in:
            return "in which it was stopped"
        return ""

    def _who(self) -> str:
        return f"agent of robot {self._robot}, boot {self._boot}"
