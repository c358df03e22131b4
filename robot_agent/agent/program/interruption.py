"""A program that a stop has interrupted: where the robot left its path, how far it is from there, and the way back.

A fault, an emergency stop, drives that are switched off and a jog take a robot off its path, and nothing brings it
back but an operator. As long as its drives are supplied it is noted where on its path the robot is. Once it is enabled
again, or the jog is over, it is HALTED when no joint is farther from there than its window, else OFF_PATH. The way back
is a slow joint move; from rest at its end the program goes on along the old motion.
"""

import itertools

import numpy as np

from cell.core import Effect
from cell.messages import DriveFeedback, PlayoutState, ZoneGeometry
from robot_agent.agent.blocks.executive import Executive
from robot_agent.agent.mode import ModeEvent
from robot_agent.agent.parameters import Parameters
from robot_agent.agent.planning.planner import Planner
from robot_agent.agent.planning.plans import Plan, PlanFailed, Planned, PlanRequest
from robot_agent.agent.program.pace import Pace
from robot_agent.agent.program.path_gap import Gap, Stretch
from robot_agent.agent.program.program_run import ProgramRun
from robot_agent.agent.zones.zone_claims import ZoneClaims
from robot_agent.language import JointStep


class Interruption:
    """Remembers at most one interrupted program, that of `run`, which says whether there is one."""

    def __init__(self, robot: str, parameters: Parameters, run: ProgramRun, pace: Pace, zones: ZoneClaims) -> None:
        self._robot = robot
        self._parameters = parameters
        self._run = run
        self._pace = pace
        self._zones = zones
        self._stretch: Stretch | None = None
        self._supplied = False
        """The robot still gets blocks of the path that it was stopped on."""
        self._tick = 0
        """The newest one."""
        self._played_tick = 0
        """The newest tick at which blocks were played."""
        self._cause = ""
        self._ids = itertools.count(-1, -1)
        """Of plans; those of the program count upwards."""
        self._wanted: tuple[float, PlanRequest | None] | None = None
        """The tau to return to, and the plan that was asked for."""
        self._way: Planned | None = None
        self._problem = ""
        self._goes_on = False
        """Once it is back."""

    # Where the robot left its path

    def watch(self, executive: Executive | None, feedback: DriveFeedback) -> bool:
        """Note where on its path the robot is; whether an interruption was forgotten, because nothing can go on."""
        self._tick = feedback.tick
        if feedback.state not in (PlayoutState.STOPPING, PlayoutState.FAULT):
            self._played_tick = feedback.tick
        if executive is None:
            self._supplied = False
        elif self._run.running or (self._run.interrupted and self._supplied):
            self._supplied = True
            self._stretch = Stretch.of(executive, self._played_tick)
        why = self._lost(feedback) if self._run.interrupted else ""
        if why:
            self._run.fail(f"{self._cause}; it cannot go on, {why}")
        return why != ""

    @property
    def outdated(self) -> bool:
        """The motion that the robot is on was planned by zones that have changed since."""
        return self._stretch is not None and self._zones.changed_since(self._stretch.planned)

    def _lost(self, feedback: DriveFeedback) -> str:
        """Why the place is not known any more, for people; empty when it is."""
        if not feedback.referenced:
            return "because axes have lost their reference"
        if self._stretch is None or self.outdated:
            return "because the zones have changed since its motion was planned"
        return ""

    def interrupt(self, why: str) -> None:
        """The robot is about to leave its path: a program that can go on later is kept, any other one has failed.

        What is followed (`TRACK`) and a common start belong to their moment.
        """
        self._drop_way()
        self._pace.no_step()
        if not self._run.interrupted and not self._can_be_kept():
            self._run.fail(why)
            return
        if not self._run.interrupted:
            self._cause = why
            self._run.hold(self._tick)
        then = "once it stands with its drives on, the status says how far from its path it is"
        self._run.interrupt(f"{self._cause}; {then}")

    def leave(self, why: str) -> None:
        """Somebody leads the robot, which rests, off its path: it was left where it stands now."""
        self.interrupt(why)
        self._supplied = False

    def _can_be_kept(self) -> bool:
        led = bool(self._run.correction) or self._run.correction_ends
        return self._run.running and self._stretch is not None and not led and not self._run.starting

    def stop(self) -> None:
        """An operator has ended the program."""
        self._drop_way()
        self._run.stop()

    def forget(self, why: str) -> None:
        """The program has ended, or it is not known any more where it was."""
        self._drop_way()
        self._run.fail(why)

    # How far it is from there

    def leave_there(self, feedback: DriveFeedback, planner: Planner) -> ModeEvent:
        """Nobody moves the robot, and its drives are on: no way back is gone any more. How far it is."""
        self._supplied = False
        self._drop_way()
        gap = self.gap(feedback, planner)
        if gap is None:
            return ModeEvent.FREE
        way = "continue {0}` goes on" if gap.on_path else "return {0}` brings it back slowly"
        there = f"{self._cause}; {gap.text}: `cell {way.format(self._robot)}"
        self._run.error = f"{there}, `cell run {self._robot}` starts anew"
        return ModeEvent.ON_PATH if gap.on_path else ModeEvent.BESIDE_PATH

    def strays(self, feedback: DriveFeedback, planner: Planner) -> bool:
        """Whether a robot that was on its path when it was left is beside it by now.

        Its axes have settled, it was pushed, or its window was made smaller.
        """
        gap = self.gap(feedback, planner)
        return gap is not None and not gap.on_path

    def gap(self, feedback: DriveFeedback, planner: Planner) -> Gap | None:
        """How far the robot is from its path, as it is measured; None without an interrupted program."""
        if not self._run.interrupted or self._stretch is None:
            return None
        return Gap.between(self._stretch, feedback.position, planner.model, self._parameters.window)

    # The way back

    def go_back(self, executive: Executive, planner: Planner, feedback: DriveFeedback, gap: Gap, goes_on: bool) -> None:
        """Return from rest to the point of a gap; from there the program goes on, or it is halted there."""
        self._drop_way()
        executive.stand(planner.standstill(feedback.commanded, ()), feedback.tick)
        self._wanted, self._goes_on = (gap.tau, None), goes_on

    def plan(self, feedback: DriveFeedback, zones: tuple[ZoneGeometry, ...] | None) -> list[Effect]:
        """Ask for the way back when one is wanted and was not asked for."""
        if self._wanted is None or self._wanted[1] is not None or self._stretch is None or zones is None:
            return []
        tau = self._wanted[0]
        target = self._stretch.planned.motion.q(np.array(tau))
        left = self._stretch.planned
        speed = self._parameters.return_speed
        step = JointStep(
            self._run.line, tuple(target.tolist()), speed, spaces_off=left.spaces_off, mounted=left.mounted
        )
        tuning = self._parameters.now.of_plans()
        request = PlanRequest(next(self._ids), (step,), feedback.commanded, zones, tuning=tuning)
        self._wanted = tau, request
        return [Plan(request)]

    def planned(self, result: Planned | PlanFailed) -> bool:
        """Take the worker's result; false for one of the program."""
        asked = None if self._wanted is None else self._wanted[1]
        if asked is not None and asked.id == result.id:
            if isinstance(result, Planned):
                self._way = result
            else:
                self._problem = f"there is no way back to the path: {result.text}"
        return result.id < 0

    @property
    def follower(self) -> Planned | None:
        """The way back, once it is planned."""
        return self._way

    @property
    def waiting(self) -> str:
        """Why the way back is not begun, for people; empty when that is not for want of a plan."""
        return "the way back to the path is being planned" if self._way is None else ""

    def take_problem(self) -> str:
        """Why there is no way back, for people, once; empty for none."""
        problem, self._problem = self._problem, ""
        return problem

    def returned(self, executive: Executive, tick: int) -> ModeEvent | None:
        """Once the robot rests where it left its path, let the program go on from there; None until then."""
        way, stretch = self._way, self._stretch
        if way is None or stretch is None or self._wanted is None or not executive.at_rest(tick):
            return None
        on_way = executive.timeline.certain(tick) is way
        if way.motion.duration_s > 0.0 and not (on_way and executive.at_motion_end):
            return None
        executive.stand(stretch.planned, tick, self._wanted[0])
        self._run.resume()
        if self._goes_on:
            self._run.go_on(tick)
        self._drop_way()
        return ModeEvent.RETURNED_TO_GO_ON if self._goes_on else ModeEvent.RETURNED

    def _drop_way(self) -> None:
        self._wanted, self._way, self._problem = None, None, ""
