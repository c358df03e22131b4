"""One run of the program: its state, the line in execution, pauses, and the time spent waiting for zones."""

import itertools
from collections.abc import Collection, Iterable

import numpy as np
from numpy.typing import NDArray

from cell.core import Effect
from cell.messages import DriveFeedback, OutputEvent, ProgramState, ProgramStatus, ZoneGeometry
from robot_agent.agent.blocks.executive import Executive
from robot_agent.agent.blocks.motion_source import SentBlock
from robot_agent.agent.blocks.output_marks import OutputMarks
from robot_agent.agent.blocks.timeline import Timeline
from robot_agent.agent.planning.lookahead import Lookahead, Waiting
from robot_agent.agent.planning.planner import Planner
from robot_agent.agent.planning.plans import Extended, PlanFailed, Planned
from robot_agent.agent.program.flag_counts import FlagCounts
from robot_agent.agent.program.shared_variables import SharedVariables
from robot_agent.agent.program.trail import Trail
from robot_agent.language import (
    AwaitAnswer,
    AwaitInput,
    Decide,
    Excerpt,
    Finished,
    Mark,
    Meet,
    Mount,
    Pause,
    Program,
    ProgramFault,
    SwitchNow,
    TrackingOff,
    TrackingOn,
    changes_tools,
    excerpt,
    forks,
    mounts,
)
from robot_agent.model.description import Mounted


class ProgramRun:
    """Follows the program along the blocks that the gateway has accepted."""

    def __init__(self, program: Program, cell_variables: SharedVariables) -> None:
        self._program = program
        self.keys = program.keys
        """The Zenoh keys that it asks for."""
        self.lookahead = Lookahead()
        self.outputs = OutputMarks()
        self.trail = Trail()
        self.flags = FlagCounts(program.name, cell_variables)
        self._cell_variables = cell_variables
        self.variables: dict[str, float] = {}
        """Of the newest run, as far as it was interpreted."""
        self.state = ProgramState.LOADED
        self.error = ""
        self.line = 0
        self.waited_s: dict[str, float] = {}
        self._booked_at = 0.0
        self.resume_tick = 0
        """A programmed pause lasts until this tick."""
        self.correction = ""
        """What is measured under this name is followed; empty for nothing."""
        self.correction_ends = False
        """The program waits for the correction to come to rest."""
        self.starting = False
        """The first motion is still to come, and has to begin exactly at `resume_tick`."""
        self.end_tick: int | None = None
        """The first motion ends then; None when nobody says so, or after it."""
        self._pause = (0, 0, "")
        """Line of the newest pause, the tick at which it begins, and what it is."""
        self._leaves_at = 0
        """The tick at which all leave the newest meeting: a halt before it delays nothing."""
        self._held_since: int | None = None
        """The tick at which the program was halted; None while it goes on."""
        self._goes_since = 0
        """The tick from which on it goes on."""
        self._beside: Planned | None = None
        """Where the robot stands, while what it follows takes it from there before a next motion does."""
        self.to_mount: Mount | None = None
        """The program has come to this T, ATTACH or DETACH, at rest."""
        self.at_meeting: Meet | None = None
        """The program has come to this MEET, at rest."""
        self.at_wait: AwaitInput | AwaitAnswer | Decide | None = None
        """The program has come to this WAIT DI, M or IF, at rest."""
        self._stands_at: Meet | AwaitInput | AwaitAnswer | Decide | None = None
        """The newest step at which it waits, or was halted while it did."""
        self.held_up = ""
        """Why that is not done yet, for people."""

    @property
    def running(self) -> bool:
        return self.state is ProgramState.RUNNING

    @property
    def interrupted(self) -> bool:
        return self.state is ProgramState.INTERRUPTED

    def load(self, program: Program) -> None:
        """From here on it is about this program; none is running."""
        self._program, self.keys = program, program.keys
        self.state, self.error, self.line = ProgramState.LOADED, "", 0
        self.variables, self.waited_s = {}, {}
        self.flags.drop()
        self.flags.program = program.name
        self.lookahead.stop()

    def start(
        self,
        q: NDArray[np.float64],
        mounted: Mounted,
        part: Excerpt,
        at_tick: int | None = None,
        end_tick: int | None = None,
    ) -> None:
        """Begin a part of the program, with `at_tick` exactly then; the robot stands at `q` `(n,)`, carries `mounted`.

        With `end_tick` the first motion is slowed down so that it ends then.
        """
        self.state, self.error, self.line = ProgramState.RUNNING, "", 0
        self.waited_s = {}
        self.resume_tick, self._pause = at_tick or 0, (0, 0, "")
        self._leaves_at = 0
        self.starting, self.end_tick = at_tick is not None, end_tick
        self._held_since, self._goes_since, self._beside = None, 0, None
        self.correction, self.correction_ends = "", False
        self.outputs.drop()
        self.flags.drop()
        self.trail.forget()
        part.begins.variables |= self._cell_variables.mine
        self.lookahead.start(part.program, q, mounted, begins=part.begins)

    def part(self, first_line: int | None, last_line: int | None, *, dry: bool) -> Excerpt:
        """As `excerpt`. Raises NotThere."""
        return excerpt(self._program, first_line, last_line, dry=dry)

    @property
    def changes_tools(self) -> bool:
        """Whether the program says which tool is mounted."""
        return changes_tools(self._program)

    @property
    def mounts(self) -> bool:
        """Whether what the robot carries matters to the program."""
        return mounts(self._program)

    @property
    def unknown_output(self) -> str:
        """Which statement switches an output that the robot does not have, for people; empty when none does."""
        unknown = self._program.unknown_output(self.outputs.names)
        if unknown is None:
            return ""
        line, output = unknown
        known = ", ".join(self.outputs.names) or "none"
        return (
            f"line {line} of {self._program.name} switches the output {output!r}, "
            f"which its gateway does not know; in its drives file are: {known}"
        )

    def unknown_signal(self, inputs: Collection[str] | None) -> str:
        """Which statement asks for what the gateway does not have, for people; `inputs` are None while untold."""
        unknown = self._program.unknown_signal({"DI": inputs, "DO": self.outputs.names})
        if unknown is None:
            return ""
        line, signal = unknown
        known = ", ".join((inputs if signal.kind == "DI" else self.outputs.names) or ()) or "none"
        return (
            f"line {line} of {self._program.name} asks for the {signal}, "
            f"which its gateway does not know; in its drives file are: {known}"
        )

    @property
    def program(self) -> Program:
        return self._program

    def stop(self) -> None:
        """An operator ends a running or interrupted program: nothing is wrong with it."""
        self._end(ProgramState.LOADED, "")

    def fail(self, why: str) -> None:
        """End a running or interrupted program before its end."""
        self._end(ProgramState.FAILED, why)

    def _end(self, state: ProgramState, error: str) -> None:
        if self.running or self.interrupted:
            self.state, self.error = state, error
        self.correction, self.correction_ends = "", False
        self.outputs.drop()
        self.trail.forget()
        self.lookahead.stop()

    def interrupt(self, why: str) -> None:
        """The robot is about to leave its path: nothing is settled until `resume`, what comes next is kept."""
        self.state, self.error = ProgramState.INTERRUPTED, why
        self.end_tick = None

    def resume(self) -> None:
        """The robot rests on its path again, where it left it."""
        self.state, self.error = ProgramState.RUNNING, ""

    def hold(self, tick: int) -> None:
        """The program stands still from a tick on, a pause with it, until it goes on."""
        if self._held_since is None:
            self._held_since = tick

    def go_on(self, tick: int) -> None:
        """The program goes on at a tick, with the rest of a pause that was begun."""
        if self._held_since is None:
            return
        longer = self._held_for(tick)
        self._held_since, self._goes_since = None, tick
        if longer > 0 and not self.starting:
            self.resume_tick += longer
            self.outputs.postpone(tick - longer, longer)

    def _held_for(self, tick: int) -> int:
        """How many ticks of a pause under way a halt has taken by then."""
        if self._held_since is None:
            return 0
        since = max(self._held_since, self._leaves_at)
        return max(0, tick - since) if self.resume_tick > since else 0

    @property
    def held(self) -> bool:
        """Whether the program stands still, a pause with it."""
        return self._held_since is not None

    def accepted(self, block: SentBlock) -> None:
        """The gateway has accepted a block."""
        if self.running:
            self.outputs.accepted(block)

    def advance(self, timeline: Timeline, tick: int) -> None:
        """Once the robot is on the next motion and nothing under way can take it back, that one is no longer ahead.

        A block that is accepted may still be superseded by one that was sent before anyone knew of it, and a stop may
        come before it is played.
        """
        if not self.running:
            return
        head, path = self.lookahead.head, timeline.certain(tick)
        if isinstance(head, Planned) and head.motion is timeline.at(tick)[0].path.motion:
            self.starting = False
        if path is not None:
            self.outputs.ahead(path)
        if path is not None and isinstance(head, Planned) and head.motion is path.motion:
            self.trail.begun(head)
            self.lookahead.advance()

    def events(self, block: SentBlock, executive: Executive, halted: bool) -> tuple[OutputEvent, ...]:
        """The outputs that a block is to switch; none once the program has ended, and where all of them were."""
        if not self.running or self.trail.behind(block.path):
            return ()
        return self.outputs.events(block, executive.supply.nominal, halted)

    def start_missed(self, tick: int) -> bool:
        """Whether the first motion has not begun at the tick at which it had to."""
        return self.running and self.starting and tick > self.resume_tick

    def planned(self, result: Planned | PlanFailed, executive: Executive | None, stepping: bool, now: float) -> None:
        """Take the worker's result: a motion to come, or one in place of the motion that runs; not while stepping."""
        old = self.lookahead.extends(result)
        if old is None:
            self.lookahead.planned(result, now)
            return
        if isinstance(result, Extended) and executive is not None and self.running and not stepping:
            taken = executive.timeline.exchange(old, result)
            if taken:
                self.trail.extended(result)
        else:
            taken = False
        self.lookahead.extended(result, taken, now)

    def extend(
        self, executive: Executive, tick: int, stepping: bool, zones: tuple[ZoneGeometry, ...] | None, now: float
    ) -> list[Effect]:
        """Ask for more of the motion that runs.

        A step or a common end would lose its end. After a common end the robot rests, after a step as well where the
        motion ends with it.
        """
        timeline = executive.timeline
        running = timeline.certain(tick)
        if not self.running or running is None or running is not self.lookahead.open or zones is None:
            return []
        if self.end_tick is not None or (stepping and executive.at_motion_end):
            self.lookahead.close()
        if stepping:
            return []
        return self.lookahead.extend(timeline.reach(), timeline.at(tick)[0].path_state(tick).tau, zones, now)

    def follower(self, path: Planned) -> Planned | None:
        """The motion to begin when this one has ended."""
        if done := self.trail.after(path):
            return done[0]
        head = self.lookahead.head
        return self._beside or (head if isinstance(head, Planned) else None)

    def before(self, path: Planned) -> Planned | None:
        """The motion to go back on from the beginning of this one, once all is switched that came before it."""
        led = bool(self.correction) or self.correction_ends or self.starting
        return None if led or self.outputs.pending_beside(path) else self.trail.before(path)

    def motions(self, path: Planned) -> tuple[Planned, ...]:
        """All that is planned from the motion on which the robot is, this one first."""
        present = (path, *self.trail.after(path))
        return (*present[:-1], *self.lookahead.motions(present[-1]))

    def begins_tick(self, path: Planned) -> int:
        """What follows a motion does not begin before this tick."""
        return 0 if self._beside is not None or self.trail.behind(path) else self.resume_tick

    def stand_beside(self, executive: Executive, planner: Planner, tick: int) -> None:
        """Let the robot follow from where it stands, as long as what it follows has come and no next motion may begin.

        Once it follows, motions begin as after any other one.
        """
        waits = tick < self.resume_tick or not isinstance(self.lookahead.head, Planned)
        if not self.correction or self.correction_ends or self.starting or executive.corrected or not waits:
            self._beside = None
        elif self._beside is None and executive.at_motion_end and executive.at_rest(tick):
            newest = executive.timeline.newest
            self._beside = planner.standstill(newest.path.motion.q(np.array(newest.path_segment.stop_tau)), ())

    def settle(self, executive: Executive, feedback: DriveFeedback, cycle_s: float, *, backwards: bool) -> None:
        """Take the steps that move nothing, once the robot rests after its motion with all outputs switched.

        None is taken while it is to go `backwards`.
        """
        self.outputs.executed(feedback.event, feedback.tick)
        self.to_mount = self.at_meeting = self.at_wait = None
        if not executive.at_motion_end or self._stands_at is not self.lookahead.head:
            self._stands_at = None
        if self.running:
            self.variables = self.lookahead.variables
            playing = executive.timeline.at(feedback.tick)[0]
            if not self.trail.behind(playing.path):
                self.flags.follow(playing.path, playing.path_state(feedback.tick).tau)
        before: object = self
        while before is not self.lookahead.head and not backwards:
            before = self.lookahead.head
            self._settle_head(executive, feedback.tick, cycle_s)

    def _settle_head(self, executive: Executive, tick: int, cycle_s: float) -> None:
        path_rest_tick = executive.timeline.path_rest_tick
        arrived = executive.at_motion_end and tick >= path_rest_tick
        arrived = arrived and not self.trail.behind(executive.timeline.newest.path)
        if not self.running or self._held_since is not None or not arrived or self.outputs.pending:
            return
        rest_tick = max(path_rest_tick, self.resume_tick, self.outputs.done_tick, self._goes_since)
        self.correction_ends = False
        if not self.starting and tick >= rest_tick:
            self.end_tick = None
        head = self.lookahead.head
        if isinstance(head, Pause):
            self.resume_tick = rest_tick + round(head.duration_s / cycle_s)
            self._pause = (head.line, rest_tick, "WAIT")
            self.lookahead.advance()
        elif isinstance(head, SwitchNow):
            self._do_at_rest(head.switches, rest_tick)
        elif isinstance(head, Planned) and head.motion.duration_s == 0.0:
            self._do_at_rest(itertools.chain(*head.switches), rest_tick)
        elif tick >= rest_tick:
            match head:
                case TrackingOn(name=name):
                    self.correction = name
                    self.trail.forget()
                    self.lookahead.advance()
                case TrackingOff():
                    self.correction_ends = True
                case Mount() if executive.at_rest(tick):
                    self.to_mount = head
                case Meet() if executive.at_rest(tick):
                    self.at_meeting = self._stands_at = head
                case AwaitInput() | AwaitAnswer() | Decide():
                    self.at_wait = self._stands_at = head
                case Finished(line):
                    self.state, self.line, self.correction = ProgramState.DONE, line, ""
                    self.lookahead.stop()
                case ProgramFault(line, text) | PlanFailed(line=line, text=text):
                    self.line = line
                    self.fail(text)
                case _:
                    pass

    def _do_at_rest(self, marks: Iterable[Mark], rest_tick: int) -> None:
        """The head has only marks, at one place."""
        marks = tuple(marks)
        self.outputs.due(marks, rest_tick)
        self.flags.count(marks)
        self.lookahead.advance()

    def leave_wait(self, tick: int, holds: bool) -> None:
        """What the program waits for is so by `tick`, or where the step forks it is not."""
        step = self.at_wait
        if step is None:
            return
        self.resume_tick, self._pause = tick, (step.line, tick, "WAIT")
        self.at_wait, self.held_up = None, ""
        if forks(step):
            self.lookahead.decide(holds)
        else:
            self.lookahead.advance()

    def carries(self) -> None:
        """The T, ATTACH or DETACH to which the program has come is done."""
        self.to_mount, self.held_up = None, ""
        self.trail.forget()
        self.lookahead.advance()

    def leave_meeting(self, tick: int, at_tick: int) -> None:
        """All have come to the MEET to which the program has come, as is known at `tick`; it goes on at `at_tick`."""
        if self.at_meeting is not None:
            self.resume_tick, self._pause = at_tick, (self.at_meeting.line, tick, "MEET")
            self._leaves_at = at_tick
            self.at_meeting, self.held_up = None, ""
            self.lookahead.advance()

    def leaves_correction(self, executive: Executive) -> bool:
        """Whether a correction is to end where the robot comes to rest: TRACK OFF, or the end of the program."""
        return self.correction_ends or (executive.corrected and not self.correction)

    def wait_for(self, zone: str, now: float) -> None:
        """Book the time since the last call, when the robot waits for a zone; empty for none."""
        if zone:
            self.waited_s[zone] = self.waited_s.get(zone, 0.0) + now - self._booked_at
        self._booked_at = now

    def corrected_to(self, q: NDArray[np.float64]) -> None:
        """A correction has ended, with the robot at rest at `q` `(n,)`: the program goes on from there."""
        self.correction = ""
        self.trail.forget()
        if self.correction_ends:
            self.correction_ends = False
            self.lookahead.advance_from(q)

    def follow(self, playing: SentBlock, tick: int) -> None:
        """Note the line of the motion or the pause that is played at a tick."""
        if not self.running:
            return
        line, begin, _ = self._pause
        held = self._held_for(tick)
        moving = playing.path.line_at(playing.path_state(tick).tau)
        if self._stands_at is not None and self._stands_at is self.lookahead.head:
            self.line = self._stands_at.line
        elif line > 0 and max(begin, playing.first_tick) <= tick and playing.first_tick < self.resume_tick + held:
            self.line = line
        elif moving > 0:
            self.line = moving

    def spaces_off(self, timeline: Timeline, tick: int) -> frozenset[str]:
        """The spaces that the program has switched off, on the motion played at a tick and on the newest one.

        On what comes before its first motion and after its end all are on.
        """
        if not (self.running or self.interrupted):
            return frozenset()
        return timeline.at(tick)[0].path.spaces_off & timeline.newest.path.spaces_off

    def why_idle(self, path: Planned, tick: int, cycle_s: float) -> str:
        """Why a robot at rest on a motion does not move although its program runs; empty when it is not that."""
        if self.trail.behind(path):
            return ""
        if self.starting and tick <= self.resume_tick:
            return f"the common start, in {(self.resume_tick - tick) * cycle_s:.1f} s"
        if self._pause[1] <= tick < self.resume_tick:
            return f"{self._pause[2]}, {(self.resume_tick - tick) * cycle_s:.1f} s left"
        if (self.to_mount or self.at_meeting or self.at_wait) is not None and self.held_up:
            return self.held_up
        if isinstance(self.lookahead.head, Waiting):
            return f"line {self.lookahead.head.line} is being planned"
        return ""

    @property
    def status(self) -> ProgramStatus:
        file, line = self._program.place_of(self.line)
        planned_in, planned_to = self.planned_to
        return ProgramStatus(
            file,
            self.state,
            line,
            self._program.text_of(self.line),
            self.error,
            planned_to,
            variables=self.variables,
            raised={str(flag): count for flag, count in sorted(self.flags.raised.items())},
            planned_in=planned_in,
        )

    @property
    def planned_to(self) -> tuple[str, int]:
        """File and line of the newest move that is planned or being planned; nothing and 0 for none."""
        line = self.lookahead.planned_to
        return self._program.place_of(line) if line else ("", 0)
