"""What goes on by itself from step to step: program, correction, jog and the way back, and the mode that follows."""

from collections.abc import Callable
from dataclasses import dataclass

from cell.config.settings import OnManagerReturn
from cell.messages import DriveFeedback, Mode, Severity
from robot_agent.agent.blocks.corrections import Corrections
from robot_agent.agent.blocks.executive import Executive
from robot_agent.agent.mode import ModeEvent, after
from robot_agent.agent.operator.jogging import Jogging
from robot_agent.agent.operator.operator import OperatorCalls
from robot_agent.agent.planning.planner import Planner
from robot_agent.agent.program.interruption import Interruption
from robot_agent.agent.program.meetings import Meetings
from robot_agent.agent.program.pace import Pace
from robot_agent.agent.program.program_run import ProgramRun
from robot_agent.agent.program.waits import Waits
from robot_agent.agent.step.doing import Standing
from robot_agent.agent.step.report import Reporter
from robot_agent.agent.zones.zone_claims import ZoneClaims

_START_AGAIN = (
    "; order it again, and where it is missed again begin the programs one after the other, this one by "
    "`cell run {0}`: a first move that waits for a zone, or for room that another robot has, does not begin at a "
    "common moment"
)


@dataclass(frozen=True, slots=True)
class Progress:
    """Follows an enabled robot along the blocks that its gateway has accepted."""

    robot: str
    on_manager_return: OnManagerReturn
    run: ProgramRun
    zones: ZoneClaims
    pace: Pace
    jogging: Jogging
    corrections: Corrections
    interruption: Interruption
    meetings: Meetings
    waits: Waits
    doing: Callable[[Mode], Standing]
    operator: OperatorCalls
    report: Reporter

    def advance(self, mode: Mode, executive: Executive, feedback: DriveFeedback, planner: Planner, now: float) -> Mode:
        """The mode after what has come to its end by `feedback`, which is heard `now` [s]."""
        mode = self._advance_program(mode, executive, feedback, now)
        mode = self._advance_correction(mode, executive, feedback, planner, now)
        mode = self._advance_jog(mode, executive, feedback, now)
        return self._advance_return(mode, executive, feedback, planner) if mode is Mode.RETURNING else mode

    def ended(self, mode: Mode, feedback: DriveFeedback, planner: Planner, leaving: bool, now: float) -> Mode:
        """Halt for a set-up or a changed zone, before leaving, and after a silent manager if an operator decides."""
        if mode not in (Mode.RUNNING, Mode.RETURNING):
            return mode
        if self.zones.kept_still:
            order = "continue" if mode is Mode.RUNNING else "return"
            remedy = f"when that is over: cell {order} {self.robot}"
            code = "setup" if self.zones.state is None or self.zones.state.zone_change is None else "zone_change"
            self.report.event(Severity.WARNING, code, f"halted: {self.zones.kept_still}", remedy)
        elif not self.zones.fresh(now) and self.on_manager_return is OnManagerReturn.OPERATOR:
            order = "continue" if mode is Mode.RUNNING else "return"
            remedy = f"when it is back: cell {order} {self.robot}"
            self.report.event(Severity.WARNING, "manager_silent", "halted: the manager is silent", remedy)
        elif leaving:
            self.run.fail("the agent was stopped")
        else:
            return mode
        event = ModeEvent.HALT if mode is Mode.RUNNING else self.interruption.leave_there(feedback, planner)
        return after(mode, event)

    def _advance_program(self, mode: Mode, executive: Executive, feedback: DriveFeedback, now: float) -> Mode:
        if mode is Mode.RUNNING:
            self.run.go_on(feedback.tick)
        elif self.run.running:
            self.run.hold(feedback.tick)
        self.run.advance(executive.timeline, feedback.tick)
        if self.run.start_missed(feedback.tick):
            why = self.doing(mode).reason(executive, feedback.tick, now).text or "the robot was held up"
            self.run.fail(f"the common start was missed: {why}{_START_AGAIN.format(self.robot)}")
        self.run.settle(executive, feedback, executive.cycle_s, backwards=self.pace.backwards)
        if late := self.meetings.follow(feedback.tick, executive.cycle_s, now):
            self.report.event(Severity.WARNING, "late_for_meeting", late, "see what delays the manager's messages")
        self.waits.follow(feedback.tick)
        self.run.follow(executive.timeline.at(feedback.tick)[0], feedback.tick)
        if mode is not Mode.RUNNING:
            return mode
        if not self.run.running:
            if self.run.error:
                remedy = "correct the program, then run it again"
                self.report.event(Severity.ALARM, "program", self.run.error, remedy)
            return after(mode, ModeEvent.PROGRAM_ENDED)
        if executive.path_at_rest(feedback.tick) and self.pace.step_done(executive.timeline.newest):
            self.pace.no_step()
            return after(mode, ModeEvent.HALT)
        return mode

    def _advance_correction(
        self, mode: Mode, executive: Executive, feedback: DriveFeedback, planner: Planner, now: float
    ) -> Mode:
        if self.run.leaves_correction(executive) and executive.at_rest(feedback.tick):
            executive.stand(planner.standstill(feedback.commanded, ()), feedback.tick)
            self.run.corrected_to(feedback.commanded)
        self.corrections.follow(self.run.correction, now)
        if mode is not Mode.RUNNING:
            return mode
        if self.pace.override > 0.0 and self.zones.fresh(now):
            self.corrections.take_up(now)
        self.run.stand_beside(executive, planner, feedback.tick)
        why = self.corrections.problem(now)
        if not why:
            return mode
        remedy = f"see to what is measured, then `cell continue {self.robot}`"
        self.report.event(Severity.WARNING, "correction", why, remedy)
        return after(mode, ModeEvent.HALT)

    def _advance_jog(self, mode: Mode, executive: Executive, feedback: DriveFeedback, now: float) -> Mode:
        self.jogging.follow(now, self.operator.age_of)
        if mode is not Mode.JOGGING:
            self.jogging.end("the robot was stopped")
        elif not self.zones.fresh(now):
            self.jogging.end("the manager is silent")
        elif self.zones.kept_still:
            self.jogging.end(self.zones.kept_still)
        if not self.jogging.held and executive.at_rest(feedback.tick):
            self.jogging.rested()
            return after(mode, ModeEvent.JOG_ENDED)
        return mode

    def _advance_return(self, mode: Mode, executive: Executive, feedback: DriveFeedback, planner: Planner) -> Mode:
        problem = self.interruption.take_problem()
        if problem:
            remedy = f"jog it nearer with `cell jog {self.robot}`, or start anew with `cell run {self.robot}`"
            self.report.event(Severity.ALARM, "return", problem, remedy)
            return after(mode, self.interruption.leave_there(feedback, planner))
        event = self.interruption.returned(executive, feedback.tick)
        return mode if event is None else after(mode, event)
