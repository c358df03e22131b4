"""What goes on by itself from step to step: program, correction, jog and the way back, and the mode that follows."""

from cell.config.settings import OnManagerReturn
from cell.messages import DriveFeedback, Mode, Severity
from robot_agent.agent.blocks.corrections import Corrections
from robot_agent.agent.blocks.executive import Executive
from robot_agent.agent.mode import Event, after
from robot_agent.agent.operator.jogging import Jogging
from robot_agent.agent.operator.operator import Operator
from robot_agent.agent.planning.planner import Planner
from robot_agent.agent.program.interruption import Interruption
from robot_agent.agent.program.pace import Pace
from robot_agent.agent.program.program_run import ProgramRun
from robot_agent.agent.step.report import Reporter
from robot_agent.agent.step.stillness import Stillness
from robot_agent.agent.zones.zone_claims import ZoneClaims


class Progress:
    """Follows an enabled robot along the blocks that its gateway has accepted."""

    def __init__(
        self,
        robot: str,
        on_manager_return: OnManagerReturn,
        run: ProgramRun,
        zones: ZoneClaims,
        pace: Pace,
        jogging: Jogging,
        corrections: Corrections,
        interruption: Interruption,
        stillness: Stillness,
        operator: Operator,
        report: Reporter,
    ) -> None:
        self._robot = robot
        self._on_manager_return = on_manager_return
        self._run = run
        self._zones = zones
        self._pace = pace
        self._jogging = jogging
        self._corrections = corrections
        self._interruption = interruption
        self._stillness = stillness
        self._operator = operator
        self._report = report

    def advance(self, mode: Mode, executive: Executive, feedback: DriveFeedback, planner: Planner, now: float) -> Mode:
        """The mode after what has come to its end by `feedback`, which is heard `now` [s]."""
        mode = self._advance_program(mode, executive, feedback, now)
        mode = self._advance_correction(mode, executive, feedback, planner, now)
        mode = self._advance_jog(mode, executive, feedback, now)
        return self._advance_return(mode, executive, feedback, planner) if mode is Mode.RETURNING else mode

    def ended(self, mode: Mode, feedback: DriveFeedback, planner: Planner, leaving: bool, now: float) -> Mode:
        """Halt for a set-up, after a manager fell silent, if an operator is to decide then, and before leaving."""
        if mode not in (Mode.RUNNING, Mode.RETURNING):
            return mode
        if self._zones.kept_still:
            order = "continue" if mode is Mode.RUNNING else "return"
            remedy = f"when that is over: cell {order} {self._robot}"
            self._report.event(Severity.WARNING, "setup", f"halted: {self._zones.kept_still}", remedy)
        elif not self._zones.fresh(now) and self._on_manager_return is OnManagerReturn.OPERATOR:
            order = "continue" if mode is Mode.RUNNING else "return"
            remedy = f"when it is back: cell {order} {self._robot}"
            self._report.event(Severity.WARNING, "manager_silent", "halted: the manager is silent", remedy)
        elif leaving:
            self._run.fail("the agent was stopped")
        else:
            return mode
        event = Event.HALT if mode is Mode.RUNNING else self._interruption.leave_there(feedback, planner)
        return after(mode, event)

    def _advance_program(self, mode: Mode, executive: Executive, feedback: DriveFeedback, now: float) -> Mode:
        if mode is Mode.RUNNING:
            self._run.go_on(feedback.tick)
        elif self._run.running:
            self._run.hold(feedback.tick)
        self._run.advance(executive.timeline, feedback.tick)
        if self._run.start_missed(feedback.tick):
            why = self._stillness.reason(mode, executive, feedback.tick, now).text or "the robot was held up"
            self._run.fail(f"the common start was missed: {why}")
        self._run.settle(executive, feedback, executive.cycle_s)
        self._run.follow(executive.timeline.at(feedback.tick)[0], feedback.tick)
        if mode is not Mode.RUNNING:
            return mode
        if not self._run.running:
            if self._run.error:
                remedy = "correct the program, then run it again"
                self._report.event(Severity.ALARM, "program", self._run.error, remedy)
            return after(mode, Event.PROGRAM_ENDED)
        if executive.path_at_rest(feedback.tick) and self._pace.step_done(executive.timeline.newest):
            self._pace.no_step()
            return after(mode, Event.HALT)
        return mode

    def _advance_correction(
        self, mode: Mode, executive: Executive, feedback: DriveFeedback, planner: Planner, now: float
    ) -> Mode:
        if self._run.leaves_correction(executive) and executive.at_rest(feedback.tick):
            executive.stand(planner.standstill(feedback.commanded, ()), feedback.tick)
            self._run.corrected_to(feedback.commanded)
        self._corrections.follow(self._run.correction, now)
        if mode is not Mode.RUNNING:
            return mode
        self._corrections.take_up(now)
        self._run.stand_beside(executive, planner, feedback.tick)
        why = self._corrections.problem(now)
        if not why:
            return mode
        remedy = f"see to what is measured, then `cell continue {self._robot}`"
        self._report.event(Severity.WARNING, "correction", why, remedy)
        return after(mode, Event.HALT)

    def _advance_jog(self, mode: Mode, executive: Executive, feedback: DriveFeedback, now: float) -> Mode:
        self._jogging.follow(now, self._operator.age_of)
        if mode is not Mode.JOGGING:
            self._jogging.end("the robot was stopped")
        elif not self._zones.fresh(now):
            self._jogging.end("the manager is silent")
        elif self._zones.kept_still:
            self._jogging.end(self._zones.kept_still)
        if not self._jogging.held and executive.at_rest(feedback.tick):
            self._jogging.rested()
            return after(mode, Event.JOG_ENDED)
        return mode

    def _advance_return(self, mode: Mode, executive: Executive, feedback: DriveFeedback, planner: Planner) -> Mode:
        problem = self._interruption.take_problem()
        if problem:
            remedy = f"jog it nearer with `cell jog {self._robot}`, or start anew with `cell run {self._robot}`"
            self._report.event(Severity.ALARM, "return", problem, remedy)
            return after(mode, self._interruption.leave_there(feedback, planner))
        event = self._interruption.returned(executive, feedback.tick)
        return mode if event is None else after(mode, event)
