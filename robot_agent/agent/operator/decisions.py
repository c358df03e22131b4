"""What a robot does on an operator's call: allowed in which mode, and in what words."""

from collections.abc import Collection
from dataclasses import dataclass, replace

from cell.messages import (
    AnswerFlag,
    Command,
    Continue,
    Disable,
    DisableDrives,
    DriveFeedback,
    Enable,
    EnableDrives,
    Estop,
    Jog,
    Mode,
    ResetDrives,
    ResetRobot,
    Return,
    Run,
    SetManual,
    SetOverride,
    SetPart,
    Step,
)
from robot_agent.agent.blocks.corrections import Corrections
from robot_agent.agent.blocks.executive import Executive
from robot_agent.agent.cell_clock import LONGEST_S, CellClock
from robot_agent.agent.mode import ModeEvent, after, stands
from robot_agent.agent.operator.jogging import Jogging
from robot_agent.agent.planning.planner import Planner
from robot_agent.agent.program.held_parts import HeldParts
from robot_agent.agent.program.interruption import Interruption
from robot_agent.agent.program.pace import MANUAL_SPEED_M_S, Pace
from robot_agent.agent.program.path_gap import Gap
from robot_agent.agent.program.program_run import ProgramRun
from robot_agent.agent.program.waits import Waits

_MOVING = (Enable, Run, Continue, Return, Step, Jog)
"""Calls that move a robot, or let it be moved."""


@dataclass(frozen=True, slots=True)
class Situation:
    """What decides whether a call is allowed."""

    executive: Executive | None
    planner: Planner
    estop: Estop | None
    feedback: DriveFeedback
    refused_by_manager: str
    clock: CellClock
    standing: bool
    """As its drives measure it."""
    kept_still: str = ""
    """Why nothing may move the robot now; empty when it may."""
    inputs: Collection[str] | None = None
    """Of the robot; None before its gateway has told them."""


@dataclass(frozen=True, slots=True)
class Done:
    """A call was carried out; the robot is now in `mode`."""

    text: str
    mode: Mode


@dataclass(frozen=True, slots=True)
class Refused:
    text: str


@dataclass(frozen=True, slots=True)
class Passed:
    """The gateway decides; the answer comes later."""

    command: Command
    mode: Mode


Decision = Done | Refused | Passed


class Decisions:
    """Decides on calls and carries them out, as far as the robot's program, pace and jogging do that."""

    def __init__(
        self,
        robot: str,
        run: ProgramRun,
        pace: Pace,
        jogging: Jogging,
        corrections: Corrections,
        interruption: Interruption,
        parts: HeldParts,
        waits: Waits,
    ) -> None:
        self._robot = robot
        self._run = run
        self._interruption = interruption
        self._parts = parts
        self._waits = waits
        self._pace = pace
        self._jogging = jogging
        self._corrections = corrections

    def halt(self, mode: Mode, situation: Situation) -> Done:
        """Braking is never refused, whatever the operator knew when he called."""
        if mode is Mode.RUNNING:
            self._pace.no_step()
            text = f"{self._robot} brakes on its path; `cell continue {self._robot}` goes on"
            return Done(text, after(mode, ModeEvent.HALT))
        if mode is Mode.RETURNING:
            self._pace.no_step()
            mode = after(mode, self._interruption.leave_there(situation.feedback, situation.planner))
            return Done(f"{self._robot} brakes on its way back; {self._way_out(mode)}", mode)
        if mode is Mode.JOGGING:
            self._jogging.end("halted")
            return Done(f"{self._robot} comes to rest", mode)
        return Done(f"{self._robot} is not running a program", mode)

    def decide(self, command: Command, mode: Mode, situation: Situation, now: float, made_at: float) -> Decision:
        """On a call that was made at `made_at` [s], in view of the robot."""
        situation = replace(situation, planner=situation.planner.holding(self._parts.held))  # of just now
        if situation.kept_still and isinstance(command, _MOVING):
            over = "call again when that is over, by `cell status`"
            return Refused(f"{self._robot} stays at rest: {situation.kept_still}; {over}")
        match command:
            case Enable():
                return self._enable(mode, situation)
            case Disable():
                return self._disable(mode, situation)
            case Run():
                return self._start(mode, situation, command, now)
            case Continue():
                return self._continue(mode, situation, now)
            case Return():
                return self._return(mode, situation)
            case Step():
                return self._step(mode, situation, now)
            case SetOverride(percent):
                return self._override(percent, mode)
            case SetManual(on):
                return self._manual(on, mode)
            case SetPart(part):
                return self._hold(part, mode, situation)
            case AnswerFlag(flag):
                why = self._waits.answer(flag)
                return Refused(f"{self._robot}: {why}") if why else Done(f"{self._robot}: M {flag} is answered", mode)
            case Jog():
                return self._jog(command, mode, situation, made_at)
            case ResetRobot():
                return self._reset(mode, situation)
            case _:
                return Refused(f"`{command.verb}` is not a call for a robot")

    def _enable(self, mode: Mode, situation: Situation) -> Done | Refused | Passed:
        if mode in (Mode.READY, Mode.RUNNING, Mode.HALTED, Mode.OFF_PATH, Mode.RETURNING):
            return Done(f"{self._robot} is enabled already", mode)
        if mode is Mode.DISABLED:
            return Passed(EnableDrives(self._robot, situation.feedback.owner), after(mode, ModeEvent.ENABLE))
        return Refused(f"{self._robot} is in mode {mode.value}: {self._way_out(mode)}")

    def _disable(self, mode: Mode, situation: Situation) -> Done | Refused | Passed:
        executive = situation.executive
        if mode is Mode.DISABLED:
            return Done(f"{self._robot} is disabled already", mode)
        if not stands(mode) or executive is None:
            return Refused(f"{self._robot} is in mode {mode.value}: {self._way_out(mode)}")
        if not executive.at_rest(situation.feedback.tick):
            return Refused(f"{self._robot} still moves: call again when it is at rest")
        self._interruption.interrupt("the drives were switched off by an operator")
        return Passed(DisableDrives(self._robot, situation.feedback.owner), after(mode, ModeEvent.DISABLE))

    def _start(self, mode: Mode, situation: Situation, run: Run, now: float) -> Done | Refused:
        executive, feedback = situation.executive, situation.feedback
        if mode is Mode.RUNNING:
            return Refused(f"{self._robot} is running already: halt it first")
        if not stands(mode) or executive is None:
            return Refused(f"{self._robot} is in mode {mode.value}: {self._way_out(mode)}")
        if situation.refused_by_manager:
            return Refused(f"the manager refuses {self._robot}: {situation.refused_by_manager}")
        if unknown := self._run.unknown_output or self._run.unknown_signal(situation.inputs):
            return Refused(f"{self._robot} cannot run its program: {unknown}")
        if self._run.uses_parts and not self._parts.known:
            words = "|".join((*self._parts.names, "none"))
            return Refused(
                f"{self._robot} cannot run its program, which takes or gives away a part: nobody has said what it "
                f"holds since its agent was started; look, then `cell part {self._robot} {words}`"
            )
        if not executive.at_rest(feedback.tick):
            return Refused(f"{self._robot} still moves: call again when it is at rest")
        if self._pace.backwards:
            override = f"`cell override {self._robot} 100`"
            return Refused(f"{self._robot} has a negative override, a program begins forwards: {override}, then run it")
        tick = situation.clock.start_tick(run.at, now) if run.at is not None else None
        if isinstance(tick, str):
            return Refused(tick)
        end_tick = None
        if tick is not None and run.lasting_s is not None:
            if not 0.0 < run.lasting_s <= LONGEST_S:
                allowed = f"allowed is more than 0 and at most {LONGEST_S:g}: order it again"
                return Refused(f"the first motion shall last {run.lasting_s:.4g} s, {allowed}")
            end_tick = tick + round(run.lasting_s / executive.cycle_s)
        executive.stand(situation.planner.standstill(feedback.commanded, ()), feedback.tick)
        self._run.start(feedback.commanded, tick, end_tick, self._parts.held)
        self._pace.no_step()
        return Done(f"{self._robot} runs {self._run.status.name} from its first line", after(mode, ModeEvent.RUN))

    def _hold(self, part: str | None, mode: Mode, situation: Situation) -> Done | Refused:
        """Take an operator's word; a program that was planned with something else in the gripper has ended."""
        if part is not None and part not in self._parts.names:
            known = ", ".join(self._parts.names) or "it has none"
            return Refused(f"no part {part!r}; in the robot file of {self._robot} are: {known}")
        if not (stands(mode) or mode is Mode.DISABLED):
            return Refused(f"{self._robot} is in mode {mode.value}: {self._way_out(mode)}")
        executive = situation.executive
        if not situation.standing or not (executive is None or executive.at_rest(situation.feedback.tick)):
            return Refused(f"{self._robot} still moves: call again when it is at rest")
        text = f"{self._robot} holds {'nothing' if part is None else part}"
        if self._parts.told == (part or ""):
            return Done(f"{text}, as before", mode)
        self._parts.take(() if part is None else (part,))
        if self._run.running or self._run.interrupted:
            self._interruption.forget(f"an operator said that {text}: start it anew")
            mode = after(mode, ModeEvent.FORGOTTEN)
        return Done(text, mode)

    def _jog(self, command: Jog, mode: Mode, situation: Situation, made_at: float) -> Done | Refused:
        executive = situation.executive
        if not (stands(mode) or mode is Mode.JOGGING) or executive is None:
            return Refused(f"{self._robot} is in mode {mode.value}: {self._way_out(mode)}")
        if situation.refused_by_manager:
            return Refused(f"the manager refuses {self._robot}: {situation.refused_by_manager}")
        if mode is not Mode.JOGGING and not executive.at_rest(situation.feedback.tick):
            return Refused(f"{self._robot} still moves: call again when it is at rest")
        why = self._jogging.why_not(command, situation.planner)
        if why:
            return Refused(why)
        if mode is Mode.HALTED:
            self._run.fail("the robot was jogged off its path by an operator")
        self._jogging.begin(command, situation.planner, made_at)
        return Done(f"{self._robot} jogs along {command.axis} while the key is held", after(mode, ModeEvent.JOG))

    def _continue(self, mode: Mode, situation: Situation, now: float) -> Done | Refused:
        if mode is Mode.RUNNING:
            self._pace.no_step()
            return Done(f"{self._robot} is running", mode)
        if mode is not Mode.HALTED:
            return Refused(
                f"{self._robot} is in mode {mode.value}, only a halted program can continue"
                f"{f' ({self._run.error})' if self._run.error else ''}: {self._way_out(mode)}"
            )
        refused = self._led_astray(now) or self._to_path(situation)
        if refused is not None:
            return refused
        self._pace.no_step()
        return Done(f"{self._robot} goes on", self._going_on(mode))

    def _return(self, mode: Mode, situation: Situation) -> Done | Refused:
        gap = self._interruption.gap(situation.feedback, situation.planner)
        if mode not in (Mode.OFF_PATH, Mode.HALTED) or gap is None:
            return Refused(f"{self._robot} is in mode {mode.value}, with no path to return to: {self._way_out(mode)}")
        refused = self._go_back(situation, gap, goes_on=False)
        if refused is not None:
            return refused
        text = f"{gap.text}; {self._robot} returns slowly, and is then halted on its path"
        return Done(text, after(mode, ModeEvent.GO_BACK))

    def _going_on(self, mode: Mode) -> Mode:
        """Of a program that is running or halted; an interrupted one goes back to its path first."""
        return after(mode, ModeEvent.GO_BACK if self._run.interrupted else ModeEvent.CONTINUE)

    def _to_path(self, situation: Situation) -> Refused | None:
        """Bring a robot that is halted beside its path back to it, from where it goes on; or say why not."""
        gap = self._interruption.gap(situation.feedback, situation.planner)
        if gap is None:
            return None
        if not gap.on_path:
            return Refused(f"{self._robot} cannot continue, {gap.text}: {self._way_out(Mode.OFF_PATH)}")
        return self._go_back(situation, gap, goes_on=True)

    def _go_back(self, situation: Situation, gap: Gap, *, goes_on: bool) -> Refused | None:
        executive, feedback = situation.executive, situation.feedback
        if situation.refused_by_manager:
            return Refused(f"the manager refuses {self._robot}: {situation.refused_by_manager}")
        if executive is None or not executive.at_rest(feedback.tick):
            return Refused(f"{self._robot} still moves: call again when it is at rest")
        self._interruption.go_back(executive, situation.planner, feedback, gap, goes_on)
        return None

    def _led_astray(self, now: float) -> Refused | None:
        """The answer where what the program follows would halt it again at once."""
        why = self._corrections.problem(now)
        if not why:
            return None
        remedy = f"`cell continue {self._robot}`, or start it anew with `cell run {self._robot}`"
        return Refused(f"{self._robot} would halt again at once: {why}; see to what is measured, then {remedy}")

    def _step(self, mode: Mode, situation: Situation, now: float) -> Done | Refused:
        if mode in (Mode.OFF_PATH, Mode.RETURNING):
            return Refused(f"{self._robot} is in mode {mode.value}: {self._way_out(mode)}")
        if mode not in (Mode.RUNNING, Mode.HALTED):
            started = self._start(mode, situation, Run(), now)
            if isinstance(started, Refused):
                return started
            mode = started.mode
        elif (refused := self._led_astray(now) or self._to_path(situation)) is not None:
            return refused
        else:
            mode = self._going_on(mode)
        self._pace.step()
        where = "back to the beginning" if self._pace.backwards else "to the end"
        return Done(f"{self._robot} goes {where} of the present move and halts there", mode)

    def _override(self, percent: float, mode: Mode) -> Done | Refused:
        if not -100.0 <= percent <= 100.0:
            return Refused(f"an override of {percent:g} % is not possible: -100 to 100 % are allowed")
        followed = self._corrections.followed
        if percent < 0.0 and followed:
            return Refused(
                f"{self._robot} follows {followed}, and a path that is led from outside cannot be gone back: "
                f"0 to 100 % are allowed until its program comes to TRACK OFF; "
                f"to back off, `cell halt {self._robot}`, then `cell jog {self._robot}`"
            )
        self._pace.override = percent / 100.0
        if percent < 0.0:
            back = "no farther than this motion's beginning, and not into a zone that it has given up"
            return Done(f"{self._robot} goes back along its path at {-percent:g} %, {back}", mode)
        return Done(f"{self._robot} follows its path at {percent:g} % of the planned speed", mode)

    def _manual(self, on: bool, mode: Mode) -> Done:
        self._pace.manual = on
        if not on:
            return Done(f"{self._robot} is in automatic operation, at its planned speed", mode)
        return Done(f"{self._robot} is in manual operation, at most {1000.0 * MANUAL_SPEED_M_S:.0f} mm/s", mode)

    def _reset(self, mode: Mode, situation: Situation) -> Done | Refused | Passed:
        if mode is Mode.FAULT:
            return Passed(ResetDrives(self._robot, situation.feedback.owner), mode)
        if situation.estop is not None:
            return Refused(f"an emergency stop by {situation.estop.by} is active: clear it with `cell reset`")
        return Done(f"{self._robot} has no fault", mode)

    def _way_out(self, mode: Mode) -> str:
        match mode:
            case Mode.DISABLED | Mode.ENABLING:
                return f"enable it with `cell enable {self._robot}`"
            case Mode.READY:
                return f"start its program with `cell run {self._robot}`"
            case Mode.OFF_PATH:
                anew = f"start anew with `cell run {self._robot}`"
                return f"let it return slowly with `cell return {self._robot}`, or {anew}"
            case Mode.RUNNING | Mode.RETURNING:
                return f"halt it first with `cell halt {self._robot}`"
            case Mode.HALTED:
                return f"go on with `cell continue {self._robot}`"
            case Mode.JOGGING:
                return "let the jog key go"
            case Mode.ESTOP:
                return "clear the emergency stop with `cell reset`"
            case Mode.FAULT:
                return f"acknowledge it with `cell reset {self._robot}`"
            case Mode.STARTING:
                return "wait until its gateway has accepted it"
