"""What a robot does on an operator's call: allowed in which mode, and in what words."""

from collections.abc import Collection
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from cell.config.points_file import Point
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
    ForceInput,
    Go,
    Jog,
    ListParameters,
    ListPoints,
    Load,
    Mode,
    ResetDrives,
    ResetRobot,
    Return,
    Run,
    SetManual,
    SetOverride,
    SetParameter,
    SetPart,
    SetTool,
    Step,
    Teach,
)
from robot_agent.agent.blocks.corrections import Corrections
from robot_agent.agent.blocks.executive import Executive
from robot_agent.agent.cell_clock import LONGEST_S, CellClock
from robot_agent.agent.mode import ModeEvent, after, moves, stands
from robot_agent.agent.operator.jogging import Jogging
from robot_agent.agent.operator.loading import Loading, NotLoaded
from robot_agent.agent.operator.teaching import Teaching, Untaught
from robot_agent.agent.parameters import NotSet, Parameters
from robot_agent.agent.planning.planner import Planner
from robot_agent.agent.program.forced_inputs import NotForced
from robot_agent.agent.program.interruption import Interruption
from robot_agent.agent.program.mounted_now import MountedNow
from robot_agent.agent.program.pace import Pace
from robot_agent.agent.program.path_gap import Gap
from robot_agent.agent.program.program_run import ProgramRun
from robot_agent.agent.program.waits import Waits
from robot_agent.language import Excerpt, NotThere, Program
from robot_agent.trajectory.sources import Axes, JointAxes, ToolAxes, WayAxes

_THERE = 1e-6
"""[rad or m] Nearer to a point a robot does not go."""
MOVING = (Enable, Run, Continue, Return, Step, Jog, Go)
"""Calls that move a robot, or let it be moved."""
_OF_A_VIRTUAL_RUN = (Continue, Step, AnswerFlag)
"""Calls that are about the virtual run while there is one; halt and stop are, too."""


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
    virtual: bool = False
    """There is a virtual run."""


@dataclass(frozen=True, slots=True)
class Done:
    """A call was carried out; the robot is now in `mode`."""

    text: str
    mode: Mode
    data: str = ""
    """What was asked for, for programs (`Reply.data`)."""


@dataclass(frozen=True, slots=True)
class Refused:
    text: str


@dataclass(frozen=True, slots=True)
class Passed:
    """The gateway decides; the answer comes later."""

    command: Command
    mode: Mode


@dataclass(frozen=True, slots=True)
class Taught:
    """A point is written; the answer comes once it is."""

    name: str
    point: Point
    planner: Planner


@dataclass(frozen=True, slots=True)
class Wanted:
    """A program is read; the answer comes once it is."""

    file: Path
    planner: Planner


@dataclass(frozen=True, slots=True)
class Virtual:
    """It is the virtual run's, which answers."""


Decision = Done | Refused | Passed | Taught | Wanted | Virtual


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
        mounted: MountedNow,
        teaching: Teaching,
        loading: Loading,
        waits: Waits,
        parameters: Parameters,
    ) -> None:
        self._robot = robot
        self._teaching = teaching
        self._loading = loading
        self._run = run
        self._interruption = interruption
        self._mounted = mounted
        self._waits = waits
        self._parameters = parameters
        self._pace = pace
        self._jogging = jogging
        self._corrections = corrections

    def halt(self, mode: Mode, situation: Situation) -> Done | Virtual:
        """Braking is never refused, whatever the operator knew when he called."""
        if situation.virtual:
            return Virtual()
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

    def stop(self, mode: Mode, situation: Situation) -> Done | Virtual:
        """As `halt`; and what moves the robot, or would go on, has ended."""
        if situation.virtual:
            return Virtual()
        if mode is Mode.JOGGING:
            self._jogging.end("stopped")
            self._interruption.stop()
            return Done(f"{self._robot} comes to rest", mode)
        if not (self._run.running or self._run.interrupted):
            return Done(f"{self._robot} is not running a program", mode)
        brakes = "brakes on its path, and " if mode in (Mode.RUNNING, Mode.RETURNING) else ""
        self._pace.no_step()
        self._interruption.stop()
        mode = after(mode, ModeEvent.PROGRAM_ENDED if mode is Mode.RUNNING else ModeEvent.FORGOTTEN)
        text = f"{self._robot} {brakes}has ended its program; `cell run {self._robot}` starts it from its first line"
        return Done(text, mode)

    def decide(self, command: Command, mode: Mode, situation: Situation, now: float, made_at: float) -> Decision:
        """On a call that was made at `made_at` [s], in view of the robot."""
        situation = replace(situation, planner=situation.planner.mounting(self._mounted.present))  # of just now
        if (virtual := self._virtually(command, mode, situation)) is not None:
            return virtual
        if situation.kept_still and isinstance(command, MOVING):
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
            case SetTool() | SetPart():
                return self._mount(command, mode, situation)
            case AnswerFlag(flag):
                why = self._waits.answer(flag)
                return Refused(f"{self._robot}: {why}") if why else Done(f"{self._robot}: M {flag} is answered", mode)
            case ForceInput():
                return self._force(command, mode, situation)
            case Jog() | Go():
                return self._jog(command, mode, situation, made_at)
            case SetParameter():
                try:
                    return Done(self._parameters.set(command.name, command.value, command.by, now), mode)
                except NotSet as error:
                    return Refused(str(error))
            case ListParameters():
                return Done(self._parameters.told(now), mode)
            case Teach():
                return self._teach(command, situation)
            case Load():
                return self._load(command, mode, situation)
            case ListPoints():
                return Done(self._teaching.told(situation.planner), mode, self._teaching.named())
            case ResetRobot():
                return self._reset(mode, situation)
            case _:
                return Refused(f"`{command.verb}` is not a call for a robot")

    def _virtually(self, command: Command, mode: Mode, situation: Situation) -> Virtual | Refused | None:
        """The answer where a virtual run is to begin, or there is one that it concerns; None: it is the robot's."""
        begins, ends = isinstance(command, Run) and command.virtual, f"`cell stop {self._robot}` ends that"
        if situation.virtual:
            if isinstance(command, _OF_A_VIRTUAL_RUN):
                return Virtual()
            return Refused(f"{self._robot} runs virtually: {ends}") if isinstance(command, MOVING) else None
        if not begins:
            return None
        if isinstance(command, Run) and command.at is not None:
            return Refused(f"{self._robot} has no common start with others in a virtual run: leave out the time")
        if not situation.feedback.referenced:
            missing = f"`cell status` says which axes, `cell home {self._robot}` references them"
            return Refused(f"{self._robot} does not know where it is, and a virtual run begins there: {missing}")
        if moves(mode) or mode in (Mode.ENABLING, Mode.STARTING):
            return Refused(f"{self._robot} is in mode {mode.value}: {self._way_out(mode)}")
        executive = situation.executive
        if not situation.standing or not (executive is None or executive.at_rest(situation.feedback.tick)):
            return Refused(f"{self._robot} still moves: call again when it is at rest")
        return Virtual()

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
        if unsaid := self._unsaid():
            return Refused(unsaid)
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
        part = self._part(run)
        if isinstance(part, Refused):
            return part
        executive.stand(situation.planner.standstill(feedback.commanded, ()), feedback.tick)
        self._run.start(feedback.commanded, self._mounted.present, part, tick, end_tick)
        if self._run.mounts:
            self._mounted.begin()
        self._pace.no_step()
        begins = "its first line" if run.first_line is None else f"line {run.first_line}"
        ends = "" if run.last_line is None else f" to line {run.last_line}"
        dry = ", and switches nothing" if run.dry else ""
        text = f"{self._robot} runs {self._run.status.name} from {begins}{ends}{dry}"
        return Done(text, after(mode, ModeEvent.RUN))

    def _part(self, run: Run) -> Excerpt | Refused:
        """What is to run of the program, with what the robot carries."""
        try:
            part = self._run.part(run.first_line, run.last_line, dry=run.dry)
        except NotThere as error:
            return Refused(f"{self._robot}: {error}")
        for kind, wanted, there in (
            ("tool", part.begins.tools, self._mounted.present.tools),
            ("part", part.begins.held, self._mounted.present.parts),
        ):
            if wanted is not None and wanted != there:
                named, present = ("|".join(each) or "none" for each in (wanted, there))
                say = f"`cell {kind} {self._robot} {named}`"
                return Refused(
                    f"{self._robot}: before line {run.first_line} the program has {kind} {named}, the robot has "
                    f"{present}: begin at an earlier line, or see to it and say so with {say}"
                )
        return part

    def _unsaid(self) -> str:
        """What the program has to know and nobody has said, for people; empty when it may run."""
        now, robot = self._mounted, self._robot
        changes, moves = self._run.changes_tools, "moves the TCP of its tool"
        takes = "takes or gives away a part"
        for kind, told, names, wanted, does in (
            ("tool", now.tool, now.tools or (), True, "changes its tool" if changes else moves),
            ("part", now.part, now.parts, self._run.mounts, "changes its tool" if changes else takes),
        ):
            if wanted and told is None:
                which = "which tool is mounted" if kind == "tool" else "what it holds"
                unsaid = f"nobody has said {which} since its agent was started"
                if why := now.why_unknown:
                    unsaid += f", and mounted_at_start of the cell file does not count: {why}"
                return (
                    f"{robot} cannot run its program, which {does}: {unsaid}; look, then "
                    f"`cell {kind} {robot} {'|'.join((*names, 'none'))}`"
                )
        return ""

    def _mount(self, said: SetTool | SetPart, mode: Mode, situation: Situation) -> Done | Refused:
        """Take an operator's word; a program that was planned with something else at the flange has ended."""
        now = self._mounted
        if isinstance(said, SetTool):
            name, names, told = said.tool, now.tools or (), now.tool
            text = f"{self._robot} has {'no tool' if name is None else f'the tool {name}'} mounted"
        else:
            name, names, told = said.part, now.parts, now.part
            text = f"{self._robot} holds {'nothing' if name is None else name}"
        if name is not None and name not in names:
            known = ", ".join(names) or "none"
            return Refused(f"no {said.verb} {name!r}; in the robot file of {self._robot} are: {known}")
        if (refused := self._busy(mode, situation)) is not None:
            return refused
        if isinstance(said, SetTool):
            now.say_tool(name)
        else:
            now.say_part(name)
        if told == (name or ""):
            return Done(f"{text}, as before", mode)
        if self._run.running or self._run.interrupted:
            self._interruption.forget(f"an operator said that {text}: start it anew")
            mode = after(mode, ModeEvent.FORGOTTEN)
        return Done(text, mode)

    def _force(self, command: ForceInput, mode: Mode, situation: Situation) -> Done | Refused:
        forced, name = self._waits.forced, command.input
        try:
            if command.on is None:
                return Done(forced.follow(name, situation.inputs), mode)
            return Done(forced.force(name, command.on, situation.inputs), mode)
        except NotForced as error:
            return Refused(str(error))

    def _busy(self, mode: Mode, situation: Situation) -> Refused | None:
        """Why nothing is exchanged by which the robot moves; None where it stands, and nobody moves it."""
        if not (stands(mode) or mode is Mode.DISABLED):
            return Refused(f"{self._robot} is in mode {mode.value}: {self._way_out(mode)}")
        executive = situation.executive
        if not situation.standing or not (executive is None or executive.at_rest(situation.feedback.tick)):
            return Refused(f"{self._robot} still moves: call again when it is at rest")
        return None

    def _load(self, command: Load, mode: Mode, situation: Situation) -> Wanted | Refused:
        if (refused := self._busy(mode, situation)) is not None:
            return refused
        if self._teaching.writing:
            return Refused(f"point {self._teaching.writing} is being written: load once it is there")
        try:
            return Wanted(self._loading.file(command.file), situation.planner)
        except NotLoaded as error:
            return Refused(str(error))

    def loaded(self, program: Program, mode: Mode, situation: Situation) -> Done | Refused:
        """A program was read: take it, unless the robot has begun to do something meanwhile."""
        if (refused := self._busy(mode, situation)) is not None:
            return Refused(f"{program.name} is good, and was not taken: {refused.text}, then load it again")
        ended = self._run.running or self._run.interrupted
        if ended:
            self._interruption.forget("an operator loaded a program")
            mode = after(mode, ModeEvent.FORGOTTEN)
        self._run.load(program)
        self._teaching.takes(program)
        return Done(self._loading.taken(program, ended=ended), mode)

    def _teach(self, command: Teach, situation: Situation) -> Taught | Refused:
        if self._loading.under_way:
            return Refused(f"a program of {self._robot} is being read, and its points: teach once that is done")
        executive, planner = situation.executive, situation.planner
        rests = situation.standing and (executive is None or executive.at_rest(situation.feedback.tick))
        try:
            point = self._teaching.taught(command, planner, situation.feedback, rests)
        except Untaught as error:
            return Refused(str(error))
        return Taught(command.point, point, planner)

    def _jog(self, command: Jog | Go, mode: Mode, situation: Situation, made_at: float) -> Done | Refused:
        executive = situation.executive
        if not (stands(mode) or mode is Mode.JOGGING) or executive is None:
            return Refused(f"{self._robot} is in mode {mode.value}: {self._way_out(mode)}")
        if situation.refused_by_manager:
            return Refused(f"the manager refuses {self._robot}: {situation.refused_by_manager}")
        if mode is not Mode.JOGGING and not executive.at_rest(situation.feedback.tick):
            return Refused(f"{self._robot} still moves: call again when it is at rest")
        planner = situation.planner
        why = self._jogging.why_not(command, planner)
        if why:
            return Refused(why)
        try:
            axes = self._axes(command, planner, situation.feedback.commanded)
        except Untaught as error:
            return Refused(str(error))
        if self._run.running:
            self._interruption.leave("the robot was jogged off its path by an operator")
        self._jogging.begin(command, planner, made_at, axes)
        doing = f"goes to {command.point}" if isinstance(command, Go) else f"jogs along {command.axis}"
        return Done(f"{self._robot} {doing} while the key is held", after(mode, ModeEvent.JOG))

    def _axes(self, command: Jog | Go, planner: Planner, q: NDArray[np.float64]) -> Axes:
        """Along what a robot at `q` `(n,)` is to move. Raises `Untaught`."""
        model, limits = planner.model, planner.limits
        if isinstance(command, Go):
            axes = WayAxes(limits, q, self._teaching.joints_of(command.point, planner, q))
            if axes.length < _THERE:
                raise Untaught(f"{self._robot} is at {command.point} already")
            return axes
        if command.axis in model.joint_names:
            return JointAxes(limits)
        if command.in_frame is None:
            return ToolAxes(model, limits, command.frame, planner.pose_world_base)
        return ToolAxes(model, limits, self._teaching.pose_base_frame(command.in_frame, planner)[:3, :3])

    def _continue(self, mode: Mode, situation: Situation, now: float) -> Done | Refused:
        if mode is Mode.RUNNING:
            self._pace.no_step()
            return Done(f"{self._robot} is running", mode)
        if mode is not Mode.HALTED:
            return Refused(
                f"{self._robot} is in mode {mode.value}, only a halted program can continue"
                f"{f' ({self._run.error})' if self._run.error else ''}: {self._way_out(mode)}"
            )
        refused = self._stands_again(now) or self._to_path(situation)
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

    def _stands_again(self, now: float) -> Refused | None:
        """The answer where the program would stand again at once."""
        if self._interruption.outdated:
            return Refused(
                f"{self._robot} cannot go on: the zones have changed since its motion was planned: "
                f"`cell run {self._robot}`, or `cell run {self._robot} --from LINE`"
            )
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
        elif (refused := self._stands_again(now) or self._to_path(situation)) is not None:
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
            back = "no farther than what is kept of it, and not into a zone that it has given up"
            return Done(f"{self._robot} goes back along its path at {-percent:g} %, {back}", mode)
        return Done(f"{self._robot} follows its path at {percent:g} % of the planned speed", mode)

    def _manual(self, on: bool, mode: Mode) -> Done:
        self._pace.manual = on
        if not on:
            return Done(f"{self._robot} is in automatic operation, at its planned speed", mode)
        return Done(
            f"{self._robot} is in manual operation, at most {1000.0 * self._pace.manual_speed_m_s:.4g} mm/s", mode
        )

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
