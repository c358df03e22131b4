"""The agent: one robot's program, motion, zones and presence, as a core (`cell.core`)."""

import functools
import itertools
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from cell.config.settings import CellSettings
from cell.core import Arrived, AskDone, Effect, Ended, Frozen, Publish, Request, Shutdown
from cell.messages import (
    AxisStatus,
    Body,
    CellVariables,
    ClaimGrant,
    Clearance,
    ConveyorCount,
    Correction,
    DisableDrives,
    DriveFeedback,
    Estop,
    FramePose,
    GatewayState,
    JogHeld,
    ManagerState,
    Mode,
    PlayoutState,
    ProgramState,
    Sections,
    SetpointBlock,
    Severity,
    ZoneGeometry,
)
from cell.net.estops import ObeyedEstops
from cell.net.plain import PlainText
from robot_agent.agent.blocks.corrections import Corrections
from robot_agent.agent.blocks.executive import Executive
from robot_agent.agent.cell_clock import CellClock
from robot_agent.agent.drives.axes import feedback_in_joints, samples_in_axes
from robot_agent.agent.drives.gateway_link import GatewayLink, IdleClock
from robot_agent.agent.drives.measured_rest import MeasuredRest
from robot_agent.agent.mode import ModeEvent, after, has_torque, moves, stopped
from robot_agent.agent.operator.decisions import Decisions, Situation
from robot_agent.agent.operator.jogging import Jogging
from robot_agent.agent.operator.loading import Loading, ProgramNotRead, ProgramRead
from robot_agent.agent.operator.operator import OperatorCalls
from robot_agent.agent.operator.teaching import PointNotWritten, PointWritten, Teaching
from robot_agent.agent.parameters import Parameters
from robot_agent.agent.planning.heard_frames import HeardFrames
from robot_agent.agent.planning.passed import Passed
from robot_agent.agent.planning.planner import Planner
from robot_agent.agent.planning.plans import Plan, PlanFailed, Planned
from robot_agent.agent.program.forced_inputs import ForcedInputs
from robot_agent.agent.program.interruption import Interruption
from robot_agent.agent.program.meetings import Meetings
from robot_agent.agent.program.mounted_now import MountedNow
from robot_agent.agent.program.pace import Pace
from robot_agent.agent.program.plain_keys import PlainKeys
from robot_agent.agent.program.program_run import ProgramRun
from robot_agent.agent.program.shared_variables import SharedVariables
from robot_agent.agent.program.waits import Waits
from robot_agent.agent.space.shared_space import SharedSpace, Use
from robot_agent.agent.step.doing import doing
from robot_agent.agent.step.progress import Progress
from robot_agent.agent.step.report import Reporter
from robot_agent.agent.virtual.looped_gateway import LoopedGateway
from robot_agent.agent.virtual.virtual_run import VirtualRun
from robot_agent.agent.zones.announcer import Announcer
from robot_agent.agent.zones.zone_claims import ZoneClaims
from robot_agent.dynamics import AxisTorques, axis_torques
from robot_agent.kinematics import OpenMechanism
from robot_agent.language import Program
from robot_agent.workspace import ROOM_M, standing

_STALE_CYCLES = 5
_SIGN_AHEAD_TICKS = 5
_SIGN_SAMPLES = 3
"""A sign of life begins so far ahead, and has so many samples."""


class AgentCore:
    """One robot. The shell calls `step` every 20 ms; `boot` is new at each start."""

    def __init__(
        self,
        cell: CellSettings,
        robot: str,
        planner_for: Callable[[float, tuple[float, ...]], Planner],
        program: Program,
        boot: str,
        *,
        mount_in_doubt: bool = False,
        parameters: Parameters | None = None,
    ) -> None:
        """`planner_for` gives the robot's planner for the cycle [s] and the quick stop that a claim tells.

        `mount_in_doubt`: an agent before this one has noted it (`NoteDoubt`); `parameters` are another core's, where
        that one's count here too.
        """
        self._cell = cell
        self._robot = robot
        self._boot = boot
        self._planner_for = planner_for
        self._planner: Planner | None = None
        self._told: tuple[object, ...] | None = None
        """By the gateway, for the planner: cycle, quick stops, and whether it asks for torques."""
        self._grown_into: frozenset[str] = frozenset()
        """Zones that the tool or the part is in which the program is about to take."""
        self._torques: AxisTorques | None = None
        """None where the gateway does not ask for them, or the robot's file says too little."""
        self.link = GatewayLink(robot, boot, cell.digest, cell.robots[robot].gateway)
        inputs = {each.name: each.off_while for each in cell.robots[robot].spaces if each.off_while is not None}
        self.zones = ZoneClaims(robot, boot, cell.times.fresh_s, inputs)
        self.space = SharedSpace(robot, boot, kept_apart=cell.separation is not None)
        self._frames = HeardFrames(cell.frames, cell.robots[robot].things, program.frames)
        self.clock = CellClock(robot, self.zones.sent, cell.times.clock_error_s)
        self.variables = SharedVariables(robot, boot, cell.variables, self.clock)
        self.run = ProgramRun(program, self.variables)
        self.report = Reporter(robot, boot)
        self.parameters = parameters or Parameters(robot, cell.robots[robot].path_window, self.report.event)
        self.run.lookahead.tuning = lambda: self.parameters.now.of_plans()
        self.pace = Pace(self.parameters)
        self.jogging = Jogging(robot, self.zones, self.space)
        self.corrections = Corrections(robot, cell.robots[robot].corrections, self.clock, self.zones, self.space)
        self.interruption = Interruption(robot, self.parameters, self.run, self.pace, self.zones)
        self.meetings = Meetings(robot, boot, self.run, self.zones, self.clock)
        self.mounted = MountedNow(cell.robots[robot].mounted_at_start, doubtful=mount_in_doubt)
        self.teaching = Teaching(robot, cell, program, self._frames)
        self.forced = ForcedInputs(robot, inputs, self.report.event)
        self.keys = PlainKeys()
        self.waits = Waits(robot, self.run, self.pace, self.zones.signals, self.forced, self.keys, self.variables)
        doers = self.run, self.pace, self.jogging, self.corrections, self.interruption, self.mounted
        self.loading = Loading(robot, cell, self.report.event)
        decisions = Decisions(robot, *doers, self.teaching, self.loading, self.waits, self.parameters)
        self.operator = OperatorCalls(
            robot, boot, cell.times.command_s, self.link, decisions, self.teaching, self.loading
        )
        self.mode = Mode.STARTING
        self._owner = 0
        """Of the claim that this core works under; 0: none."""
        self.executive: Executive | None = None
        self._estops = ObeyedEstops(boot)
        self._rest = MeasuredRest()
        self._numbers = itertools.count(1)
        self._announcer = Announcer(robot, boot, cell.digest, self.zones, self.space)
        self._stopped_by = ""
        """Why the mode is FAULT or ESTOP."""
        parts = self.run, self.zones, self.pace, self.jogging, self.corrections, self.interruption
        self._doing = functools.partial(doing, (*parts, self.space))
        self._progress = Progress(
            robot, cell.on_manager_return, *parts, self.meetings, self.waits, self._doing, self.operator, self.report
        )
        self._idle = IdleClock(cell.times.idle_off_s)
        self._leaving = False
        self._virtual: VirtualRun | None = None
        self._virtual_runs = 0
        """So many there were."""

    def receive(self, message: object, now: float) -> None:
        """Take one message; see `cell.core`."""
        if self._virtual is not None and self._virtual.hear(message, now):
            return
        match message:
            case Arrived(inner, at):
                self.receive(inner, now)
                if not isinstance(inner, DriveFeedback) or inner is self.link.feedback:
                    self.clock.arrived(inner, at)
            case DriveFeedback():
                self.link.heard(message, now)
            case ManagerState():
                self.zones.heard_state(message, now)
                self.space.heard_manager(message)
                self._estops.answered(message, message.heard.get(self._robot))
                for estop in message.estops:
                    self._hear_estop(estop)
            case Clearance():
                self.space.heard(message)
            case ZoneGeometry():
                self.zones.heard_geometry(message)
            case FramePose():
                if self._frames.heard(message):
                    self.run.trail.outdate()
                    if self._planner is not None:
                        self._planner.place(self._frames.present)
            case GatewayState():
                self.zones.signals.heard_gateway(message)
            case Estop():
                self._hear_estop(message)
            case Correction() | ConveyorCount():
                self.corrections.heard(message, now)
            case CellVariables():
                self.variables.heard(message)
            case PlainText():
                self.keys.heard(message)
            case JogHeld():
                self.jogging.heard(message)
            case Request():
                self.operator.asked(message)
            case AskDone():
                self.operator.switched(self.link.done(message))
            case Planned() | PlanFailed() if not self.interruption.planned(message):
                self.run.planned(message, self.executive, self.pace.status.stepping, now)
            case PointWritten() | PointNotWritten():
                self.teaching.written(message, *self.run.planned_to if self.run.running else ("", 0))
            case ProgramRead() | ProgramNotRead():
                self.loading.heard(message)
            case Frozen():
                self.zones.forget_echoes()
                self.operator.forget_echoes()
                self.keys.forget()
            case Shutdown():
                self._leaving = True
                self.forced.end()

    def step(self, now: float) -> list[Effect]:
        """Everything due at `now`; see `cell.core`."""
        feedback = self.link.owned
        ended = self._end_virtual(feedback is None, now)
        if self._leaving and self._may_leave(feedback, now):
            effects = [*ended, *self.operator.refuse_all("the agent is being stopped"), *self.link.release(now)]
            effects += self.report.take_events()
            return [*effects, Ended()] if self.link.released else effects
        effects = [*ended, *self.teaching.answers(), *self.link.claim_if_due(now)]
        if hear := self.keys.need(self.run.keys):
            effects.append(hear)
        if feedback is None or self.link.grant is None:
            self._without_claim()
            return (
                effects
                + self.run.lookahead.drop()
                + self.operator.refuse_all("the robot's gateway has not accepted this agent yet")
            )
        if self._owner != self.link.grant.owner:
            self._owner = self.link.grant.owner
            self.space.claimed(self._owner, self.link.grant.epoch)
            self.run.outputs.claimed(self.link.grant.outputs)
        planner, grant = self._planner, self.link.grant
        if planner is None or (grant.cycle_s, grant.quick_stop, grant.torques) != self._told:
            self._told = grant.cycle_s, grant.quick_stop, grant.torques
            planner = self._planner_for(grant.cycle_s, grant.quick_stop)
            self.parameters.declare(planner.limits)
            self.mounted.declare(planner.model.description, changes_tools=self.run.changes_tools)
            planner = self._plan_with(planner.mounting(self.mounted.present))
            self.clock.ticks_last(planner.cycle_s)
            self.corrections.place(planner.pose_world_base)
        axes = feedback
        feedback = feedback_in_joints(planner.model.coupling, feedback)
        self.waits.look(feedback, planner.cycle_s, now)
        self.variables.look(now)
        self._follow_drives(feedback, planner, now)
        self.mode, answers = self.operator.answer(self.mode, self._situation(feedback, planner), now)
        effects += answers
        planner = self._take_word(feedback, planner)
        if self._idle.due(self.mode, now):
            text = f"no program for {self._cell.times.idle_off_s:g} s: the drives are switched off"
            self.report.event(Severity.INFO, "idle_off", text, f"switch them on again with: cell enable {self._robot}")
            effects.append(self.link.switch(DisableDrives(self._robot, feedback.owner)))
        if self.run.state is ProgramState.DONE:
            self.mounted.end()
        if note := self.mounted.note():
            effects.append(note)
        effects += self._move(feedback, planner, now)
        effects += self._plan_ahead(feedback, now)
        effects += self._step_virtual(grant, axes, now)
        effects.append(self._state(feedback, planner.mounting(self.mounted.present), now))
        if variables := self.variables.news(self._owner):
            effects.append(Publish(variables))
        return effects + self.report.take_events()

    def _may_leave(self, feedback: DriveFeedback | None, now: float) -> bool:
        """At rest; or cut off from the drives for longer than all that was sent lasts: nobody here can do more."""
        if feedback is None or self.executive is None:
            return True
        if self.link.age(now) > self._cell.times.feedback_lost_s:
            tick = feedback.tick + int(self.link.age(now) / self.executive.cycle_s)
            return tick > self.executive.timeline.played_out_tick
        return self.executive.at_rest(feedback.tick)

    def _situation(self, feedback: DriveFeedback, planner: Planner) -> Situation:
        state = self.zones.state
        refusal = state.refused.get(self._robot, "") if state is not None else ""
        kept_still = self.zones.kept_still or self._frames.why_still(state)
        standing = self._rest.standing
        return Situation(
            self.executive, planner, self._estops.first, feedback, refusal, self.clock, standing, kept_still,
            self.zones.signals.input_names, self._virtual is not None,
        )  # fmt: skip

    # What the drives, the e-stop and the manager impose on the mode

    def _without_claim(self) -> None:
        """Begin anew; but what an operator must acknowledge stays."""
        if self._owner:
            self.interruption.forget("the claim on the gateway was lost")
        self._owner = 0
        self._happens(ModeEvent.CLAIM_LOST)
        self._leave_path()
        self._rest.begin()
        self._numbers = itertools.count(1)

    def _hear_estop(self, estop: Estop) -> None:
        if self._estops.hear(estop) and estop.active:
            text = f"emergency stop by {estop.by}: {estop.reason}"
            self.report.event(Severity.ALARM, "estop", text, "find the cause, then `cell reset`")

    def _follow_drives(self, feedback: DriveFeedback, planner: Planner, now: float) -> None:
        self._rest.take(feedback, planner.cycle_s)
        self._observe(feedback)
        faulty = feedback.state in (PlayoutState.FAULT, PlayoutState.STOPPING)
        estop = self._estops.first
        if estop is not None:
            self._stop(ModeEvent.ESTOP, f"emergency stop by {estop.by}: {estop.reason}")
        elif faulty:
            self._stop(ModeEvent.FAULT, "the gateway reports a fault of the robot's drives")
        elif self.link.age(now) > self._cell.times.feedback_lost_s:
            self._stop(ModeEvent.FAULT, f"no drive feedback for {self.link.age(now):.2f} s")
        else:
            self._happens(ModeEvent.CLEARED)
            if AxisStatus.SILENT not in feedback.axes:
                self._happens(ModeEvent.HEARD)
        if not feedback.enabled:
            self._leave_path()
            if self.link.switching_off or self.operator.switched_off:
                self._happens(ModeEvent.DISABLED)
            elif has_torque(self.mode):
                self._stop(ModeEvent.FAULT, "the gateway has switched the drives off")
            return
        if self.executive is None:
            try:
                standing = planner.standstill(feedback.commanded, self.zones.geometry or ())
            except OpenMechanism as error:
                self._stop(ModeEvent.FAULT, f"the axes cannot be where the drives say: {error}")
                return
            self.executive = Executive(planner, standing, feedback, self._cell.times, self._numbers, self._torques)
        switched_off = self.link.switching_off or self.operator.switched_off
        strays = self.mode is Mode.HALTED and self.interruption.strays(feedback, planner)
        if self.mode in (Mode.DISABLED, Mode.ENABLING) or (self.mode is Mode.READY and not switched_off) or strays:
            event = self.interruption.leave_there(feedback, planner)
            self._happens(event)
            if event is ModeEvent.BESIDE_PATH:
                self.report.event(Severity.WARNING, "off_path", self.run.error)

    def _observe(self, feedback: DriveFeedback) -> None:
        """What became of the blocks that were sent, and where on its path the robot is by that."""
        if self.executive is not None and self.executive.timeline.observe(feedback):
            self.run.accepted(self.executive.timeline.newest)
        if self.interruption.watch(self.executive, feedback):
            self._happens(ModeEvent.FORGOTTEN)

    def _leave_path(self) -> None:
        """Blocks lead the robot no more."""
        if self.executive is not None:
            self._rest.left_path(self._announcer.body)
        self.executive = None

    def _happens(self, event: ModeEvent) -> None:
        self.mode = after(self.mode, event)

    def _stop(self, event: ModeEvent, why: str) -> None:
        """An emergency stop or a fault."""
        if self.mode is after(self.mode, event):
            return
        self._happens(event)
        self._stopped_by = why
        self.interruption.interrupt(why)
        if event is ModeEvent.FAULT:
            self.report.event(Severity.ALARM, "fault", why, f"find the cause, then `cell reset {self._robot}`")

    # Motion

    def _move(self, feedback: DriveFeedback, planner: Planner, now: float) -> list[Effect]:
        """The next presence and, after it, the next block."""
        executive = self.executive
        if executive is None and self._announcer.body is None and AxisStatus.SILENT in feedback.axes:
            # The drives have not been heard yet. To the manager a robot that never reported is as good as anywhere.
            return [self._sign_of_life(feedback, planner)]
        if executive is None:
            body = self._rest.body(planner, feedback)
            kept = set() if self._rest.standing else set(self.zones.holds)
            self.zones.update_holds(now, self.zones.touched(body), kept)
            stop_time_s = self._rest.stop_time_s(planner, feedback, 0.0)
            self.space.outlook.look(feedback.owner, (), more=False)
            use, stands = self._used_beside_blocks(body, feedback, planner), self._stands(feedback)
            presence = self._announcer.presence(
                feedback.owner, self.mode, self.meetings.told(self.mode), body, use, {}, stop_time_s, self._estops,
                now, standing=stands,
            )  # fmt: skip
            return [presence, self._sign_of_life(feedback, planner)]
        age_s = self.link.age(now)
        if self._leaving:
            self.jogging.end("the robot was stopped")
        self.mode = self._progress.advance(self.mode, executive, feedback, planner, now)
        self.zones.spaces.by_program = self.run.spaces_off(executive.timeline, feedback.tick)
        executive, planner = self._mount(executive, feedback, planner, now)
        wants = self._doing(self.mode).wants(executive, feedback.tick) | dict.fromkeys(self._grown_into, 0.0)
        block = None
        if age_s <= max(_STALE_CYCLES * planner.cycle_s, self._cell.times.lead_s):
            self.mode = self._progress.ended(self.mode, feedback, planner, self._leaving, now)
            block = executive.next_block(feedback, age_s, self._doing(self.mode).wishes(executive, now))
        passed = executive.passed(feedback, block)
        used = self.space.used(passed)
        if block is not None and not self._may_send(executive, passed, used, feedback, now):
            block, passed = None, executive.passed(feedback, None)
            used = self.space.used(passed)
        body = passed.body
        stop_time_s = self._rest.stop_time_s(planner, feedback, executive.rest_s(feedback.tick, block))
        # A robot that brakes keeps its zones to the end: each time its body is worked out a little larger or smaller.
        kept = set(self.zones.holds) if stop_time_s > 0.0 and not moves(self.mode) else set(wants)
        self.zones.update_holds(now, self.zones.touched(body), kept)
        newest = executive.timeline.newest if block is None else block
        ahead = self._doing(self.mode).ahead(newest, planner, feedback.tick, now) if self.space.kept_apart else None
        use, meets = Use(used, planner.model, ahead, passed.widen_m), self.meetings.told(self.mode)
        told = self._outlook(executive, feedback.owner, now)
        presence = self._announcer.presence(
            feedback.owner, self.mode, meets, body, use, wants, stop_time_s, self._estops, now
        )
        told.append(presence)
        executive.leave(passed)
        if block is None:
            return told
        runs = self.mode is Mode.RUNNING
        events = self.run.events(block, executive, halted=not runs)
        return [*told, Publish(executive.sent(block, events, runs, self.space.epoch))]

    def _outlook(self, executive: Executive, owner: int, now: float) -> list[Effect]:
        """What the program has planned, where robots are kept apart, for the manager."""
        if not self.space.kept_apart:
            return []
        lookahead = self.run.lookahead
        motions: tuple[Planned, ...] = ()
        if self.run.running and not self.run.correction and not self.pace.backwards:
            lookahead.looks_further = self.space.look_further or bool(self.space.outlook.ends_in)
            motions = self.run.motions(executive.timeline.newest.path)
        self.space.outlook.look(owner, motions, more=lookahead.goes_on)
        news = self.space.outlook.news(now)
        return [] if news is None else [Publish(news)]

    def _may_send(
        self, executive: Executive, passed: Passed, used: Sections, feedback: DriveFeedback, now: float
    ) -> bool:
        """Whether what a block passes is in no zone without a grant, and in no space that is not cleared."""
        if not all(self.zones.permitted(zone, now) for zone in self._announcer.entered(passed.body)):
            return False
        return self.space.owns(used) or self.space.contains(executive.passed(feedback, None), used)

    def _used_beside_blocks(self, body: Body, feedback: DriveFeedback, planner: Planner) -> Use:
        """What a robot uses of the cell's space that no blocks lead."""
        if not (self.space.kept_apart and body.known):
            return Use(model=planner.model)
        stands = Sections()
        if self._rest.standing:
            stands = standing(planner.model, planner.pose_world_base, feedback.position, ROOM_M)
        return Use(self.space.beside_blocks(body, stands), planner.model, widen_m=np.inf)

    # What the robot carries

    def _plan_with(self, planner: Planner) -> Planner:
        """From here on plans, bodies and torques are those of the robot with what it carries in this planner."""
        planner.place(self._frames.present)
        self._planner = planner
        grant = self.link.grant
        asked = grant is not None and grant.torques
        self._torques = axis_torques(planner.model, planner.pose_world_base) if asked else None
        return planner

    def _standing(self, executive: Executive, planner: Planner, feedback: DriveFeedback) -> Executive:
        """What supplies the robot, which rests, with the planner of what it carries from here on."""
        standing = planner.standstill(executive.timeline.newest.segment.q[-1], self.zones.geometry or ())
        return Executive(planner, standing, feedback, self._cell.times, self._numbers, self._torques)

    def _take_word(self, feedback: DriveFeedback, planner: Planner) -> Planner:
        """Carry what an operator has just said."""
        if self.mounted.present == planner.mounted:
            return planner
        carrying = self._plan_with(planner.mounting(self.mounted.present))
        if self.executive is not None:
            self.executive = self._standing(self.executive, carrying, feedback)
        return carrying

    def _mount(
        self, executive: Executive, feedback: DriveFeedback, planner: Planner, now: float
    ) -> tuple[Executive, Planner]:
        """Do the T, ATTACH or DETACH to which the program has come, once it may be in the zones that it is in then.

        The part belongs to the body before its gripper has closed, and until after that has opened.
        """
        self._grown_into = frozenset()
        if self.run.to_mount is None:
            return executive, planner
        carrying = planner.mounting(self.run.to_mount.mounted)
        grown = self._standing(executive, carrying, feedback)
        entered = sorted(self._announcer.entered(grown.passed(feedback, None).body))
        closed = [zone for zone in entered if not self.zones.permitted(zone, now)]
        room = standing(carrying.model, carrying.pose_world_base, feedback.commanded, ROOM_M)
        if not closed and not self.space.room_for(room):
            self.run.held_up = self.space.why
            return executive, planner
        if closed:
            self._grown_into = frozenset(closed)
            self.run.held_up = self.zones.why_not(closed[0])
            return executive, planner
        self.mounted.take(self.run.to_mount.mounted)
        self.run.carries()
        self._plan_with(carrying)
        self.executive = self._standing(executive, carrying, feedback)  # with its torques
        return self.executive, carrying

    def _stands(self, feedback: DriveFeedback) -> bool:
        """Without torque, and nothing is under way that would give it some."""
        resting = feedback.state in (PlayoutState.FOLLOWING, PlayoutState.FAULT) and self.mode is not Mode.ENABLING
        return resting and not self.link.switching_on and not any(status.has_torque for status in feedback.axes)

    def _plan_ahead(self, feedback: DriveFeedback, now: float) -> list[Effect]:
        effects: list[Effect] = []
        zones = None if self._frames.why_still(self.zones.state) else self.zones.geometry
        if self.executive is not None:
            effects = self.run.extend(self.executive, feedback.tick, self.pace.status.stepping, zones, now)
        effects += self.run.lookahead.fill(zones, now)
        effects += self.interruption.plan(feedback, zones)
        return [*self.run.lookahead.drop(), *map(self._with_frames, effects)]

    def _with_frames(self, effect: Effect) -> Effect:
        """A motion is planned with the frames as they are known when the plan is asked for."""
        return Plan(replace(effect.request, frames=self._frames.present)) if isinstance(effect, Plan) else effect

    # A virtual run

    def _step_virtual(self, grant: ClaimGrant, axes: DriveFeedback, now: float) -> list[Effect]:
        """Hand over what was asked for of a virtual run, the order to begin one among it, and step the run."""
        for request in self.operator.take_virtual():
            if self._virtual is None:
                self._virtual = self._virtual_run(request, grant, axes, now)
            else:
                self._virtual.order(request)
        if self._virtual is None:
            return []
        effects = self._virtual.step(self._announcer.newest, self.pace, now)
        if self._virtual.over:
            self._virtual = None
        return effects

    def _virtual_run(self, order: Request, grant: ClaimGrant, axes: DriveFeedback, now: float) -> VirtualRun:
        """Of the present program, from where the robot stands, with what it carries and what is forced."""
        times = replace(self._cell.times, idle_off_s=None)
        cell = replace(self._cell, zones={}, separation=None, times=times)
        core = AgentCore(cell, self._robot, self._planner_for, self.run.program, self._boot, parameters=self.parameters)
        core.mounted.follow(self.mounted)
        core.forced.on = self.forced.on  # what is forced later counts, too
        for frame in self._frames.present:
            core.receive(frame, now)
        self._virtual_runs += 1
        grant = replace(grant, gateway_boot="virtual", torques=False, epoch=0)
        begins = axes.commanded if axes.enabled else axes.position
        gateway = LoopedGateway(self._robot, grant, begins, axes.outputs, now)
        return VirtualRun(self._robot, core, gateway, order, self._virtual_runs, self.report.event)

    def _end_virtual(self, unclaimed: bool, now: float) -> list[Effect]:
        """A virtual run has to end when its agent does, or loses the robot."""
        if self._virtual is None or not (unclaimed or self._leaving):
            return []
        virtual, self._virtual = self._virtual, None
        return virtual.cut("the agent is being stopped" if self._leaving else "the claim on the gateway was lost", now)

    # Messages

    def _sign_of_life(self, feedback: DriveFeedback, planner: Planner) -> Publish:
        """A block that holds: without enabled drives the gateway plays none, but hears that its owner lives.

        It tells the torques that carry the robot, where the gateway asks for them and the robot knows where it is.
        """
        joints = np.repeat(feedback.commanded[None, :], _SIGN_SAMPLES, axis=0)
        position, velocity = samples_in_axes(planner.model.coupling, joints, np.zeros_like(joints))
        torques = self._torques
        torque = torques.standing(joints) if torques is not None and feedback.referenced else None
        return Publish(
            SetpointBlock(
                feedback.robot, feedback.owner, next(self._numbers), 0, feedback.tick + _SIGN_AHEAD_TICKS,
                planner.cycle_s, _SIGN_SAMPLES, position, velocity, torque, epoch=self.space.epoch,
            )
        )  # fmt: skip

    def _state(self, feedback: DriveFeedback, planner: Planner, now: float) -> Publish:
        reason = self._doing(self.mode).reason(self.executive, feedback.tick, now)
        self.run.wait_for(reason.zone, now)
        alarm = "" if self.run.interrupted else self.run.error
        alarm = self._stopped_by if stopped(self.mode) else alarm
        alarms = (alarm,) if alarm else ()
        zones = tuple(sorted(self.zones.holds))
        lost = self.link.age(now) > self._cell.times.feedback_lost_s
        heard = None if lost else feedback
        pace = self.pace.status
        waits = reason.text
        if moves(self.mode) and self.executive is not None and self.executive.at_rest(feedback.tick):
            waits = waits or self._frames.why_still(self.zones.state)
        state = self.report.state(
            self.mode, self.run, heard, self.executive, planner, pace, zones, waits, alarms
        )  # fmt: skip
        frames = {frame.frame: frame.version for frame in self._frames.present}
        program, clock = self.waits.told(state.program), self.clock.status(now)
        virtual = None if self._virtual is None else self._virtual.status
        state = replace(
            state, program=program, frames=frames, tool=self.mounted.tool, part=self.mounted.part, clock=clock,
            forced=dict(self.forced.on), virtual=virtual, parameters=self.parameters.status(now),
        )  # fmt: skip
        self.operator.sent_state(state, now)
        return Publish(state)
