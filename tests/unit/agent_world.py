"""The smallest world an agent lives in: a gateway that plays blocks exactly, a manager that says what it is told."""

import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cell.config.points_edit import write_point
from cell.config.points_file import Signal
from cell.config.problem import ConfigError
from cell.config.settings import (
    CellSettings,
    CorrectionSettings,
    FrameSettings,
    GatewayEndpoint,
    MountedAtStart,
    OnManagerReturn,
    PoseSettings,
    RobotSettings,
    SeparationSettings,
    SpaceSettings,
    ThingSettings,
    Times,
)
from cell.config.yaml_edit import NotWritten
from cell.core import Answer, Arrived, Ask, AskDone, Effect, Ended, Publish, Request
from cell.messages import (
    AxisStatus,
    BusCounters,
    Call,
    Claim,
    ClaimGrant,
    Clearance,
    Command,
    DisableDrives,
    DriveFeedback,
    EnableDrives,
    Event,
    FramePose,
    GatewayState,
    Heard,
    ManagerState,
    MeetingStatus,
    OutputEvent,
    PlayoutState,
    Presence,
    Refusal,
    Release,
    Reply,
    ResetDrives,
    RobotState,
    RobotVariables,
    SetpointBlock,
    SetupStatus,
    Token,
    ZoneGeometry,
    ZoneState,
    ZoneStatus,
)
from robot_agent.agent.core import AgentCore
from robot_agent.agent.operator.loading import (
    ProgramNotRead,
    ProgramRead,
    ReadProgram,
    mistakes_text,
    read_program,
)
from robot_agent.agent.operator.teaching import PointNotWritten, PointWritten, WritePoint
from robot_agent.agent.planning.planner import Planner
from robot_agent.agent.planning.plans import Plan, PlanFailed, Planned, Unplan
from robot_agent.agent.program.mounted_now import NoteDoubt
from robot_agent.agent.program.plain_keys import HearKeys
from robot_agent.kinematics import Model
from robot_agent.language import Names, Points, parse_program
from robot_agent.workspace import PlacedRobot, Spaces, Things
from tests.unit.six_axis_arm import arm as model

CYCLE_S = 0.004
STEP_S = 0.02
ZONE = ZoneGeometry("handover", 1, (0.6, 2.0, 3.0), (2.8, 0.0, 1.0), (0.0, 0.0, 0.0, 1.0), ("left", "right"))


def settings(
    on_manager_return: OnManagerReturn,
    times: Times,
    corrections: dict[str, CorrectionSettings],
    spaces: tuple[SpaceSettings, ...] = (),
    things: tuple[ThingSettings, ...] = (),
) -> CellSettings:
    here = PoseSettings((0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0))
    robot = RobotSettings("left", Path("model.yaml"), "left_bus", here, Path("left.prog"), corrections)
    robot = replace(robot, spaces=spaces, things=things)
    gateway = GatewayEndpoint("left_bus", "tcp/127.0.0.1:1", Path("drives.yaml"))
    return CellSettings(
        "test", Path("cell.yaml"), "tcp/127.0.0.1:2", {"left": robot}, {"left_bus": gateway}, {}, times,
        on_manager_return, "digest",
    )  # fmt: skip


class AgentWorld:
    """One agent, stepped with its gateway and manager on virtual time."""

    def __init__(
        self,
        program: str,
        on_manager_return: OnManagerReturn = OnManagerReturn.CONTINUE,
        arm: Model | None = None,
        times: Times | None = None,
        corrections: dict[str, CorrectionSettings] | None = None,
        spaces: tuple[SpaceSettings, ...] = (),
        things: tuple[ThingSettings, ...] = (),
        separation: SeparationSettings | None = None,
        points: Points | None = None,
        points_file: Path = Path("no_such_folder") / "points.yaml",
        signals: dict[str, Signal] | None = None,
        variables: dict[str, str] | None = None,
        mounted_at_start: MountedAtStart = MountedAtStart.ASK,
        mount_in_doubt: bool = False,
    ) -> None:
        arm = arm or model()
        names = arm.joint_names
        self._placed = PlacedRobot.at(
            arm,
            things=Things(arm, things, "left"),
            spaces=Spaces(arm, spaces),
            kept_apart=separation is not None,
        )
        self.planner = Planner(self._placed, CYCLE_S)
        self.brakes: tuple[float, ...] = ()
        """The quick stop that the next claim tells."""
        known = Names(
            names,
            tools=tuple(arm.description.tools) or None,
            points=points,
            signals=signals or {},
            robot="left",
            variables=variables or {},
        )
        parsed = parse_program(program, "left.prog", known, points_file.parent)
        cell = settings(on_manager_return, times or Times(), corrections or {}, spaces, things)
        folder = points_file.parent
        left = replace(cell.robots["left"], points=points_file, program=folder / "left.prog")
        left = replace(left, mounted_at_start=mounted_at_start)
        table = FrameSettings("table", None, PoseSettings((0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0)))
        self.agent = AgentCore(
            replace(
                cell,
                file=folder / "cell.yaml",
                separation=separation,
                robots={"left": left},
                frames=dict.fromkeys({"table", *parsed.frames}, table),
                variables=variables or {},
            ),
            "left",
            self._planner_for,
            parsed,
            "boot",
            mount_in_doubt=mount_in_doubt,
        )
        self.mount_in_doubt = mount_in_doubt
        """What the next agent would find noted."""
        self.clears: int | None = None
        """So many sections the manager clears of each presence that asks; None: all."""
        self._clearances = 0
        self.variables: list[RobotVariables] = []
        self.heard_keys: tuple[str, ...] = ()
        """Of the application, to which the agent listens."""
        self.events: list[Event] = []
        self.geometry = ZONE
        self.other_zones: tuple[ZoneGeometry, ...] = ()
        """Beside the one that may be another's: the robot has these as long as it wants or holds them."""
        self.torques = False
        """A drive takes torque as feed-forward."""
        self.outputs: tuple[str, ...] = ()
        self.switched: list[tuple[int, OutputEvent]] = []
        """What was executed, and at which tick."""
        self._output_events: list[OutputEvent] = []
        self.signs_of_life: list[SetpointBlock] = []
        self.now = 100.0
        self.tick = 1
        self.enabled = False
        self.queue: list[NDArray[np.float64]] = []
        self.commanded = np.array(arm.home)
        self.played: list[NDArray[np.float64]] = []
        self.block: SetpointBlock | None = None
        self.lose_blocks = False
        self.feedback_lost = False
        self.drives_silent = False
        self.referenced = True
        self.measured: NDArray[np.float64] | None = None
        """What the drives measure; None: what they are commanded."""
        self.faulty = False
        """The drives have stopped by themselves and must be reset."""
        self.velocity = np.zeros_like(self.commanded)
        self.braking: NDArray[np.float64] | None = None
        """Each joint's deceleration while the drives brake by themselves."""
        self._still = 0
        self.manager_silent = False
        self.setup: SetupStatus | None = None
        self.zone_change: str | None = None
        """Whom the manager has in set-up."""
        self.meetings: dict[str, MeetingStatus] = {}
        """What the manager says of meetings."""
        self.geometry_lost = False
        self.frames: tuple[FramePose, ...] = ()
        """What the manager tells of frames."""
        self.frames_lost = False
        self.inputs: dict[str, bool | None] | None = None
        """What the gateway tells in each step; None: it is not heard."""
        self.keeps_enabled = False
        """The gateway refuses to switch off."""
        self.zone = ZoneStatus(ZoneState.FREE, None, None, (), 1, 0.0)
        self.granting = False
        self._tokens = 0
        self._granted_at = 0
        self.replies: dict[str, Reply] = {}
        self.states: list[RobotState] = []
        self.presences: list[Presence] = []
        self.blocks: list[SetpointBlock] = []
        self.planned: list[Planned] = []
        self.ended = False
        self.settling = False
        """The gateway still measures a motion, and does not take the robot back."""
        self.asked_last: type | None = None
        self.plans_held = False
        self.unplanned: list[int] = []
        """Ids of the plans that the agent does not want any more."""
        self.planning_s: float | None = 0.0
        """What each plan takes; None: as long as it takes the processor."""
        self._plans: list[tuple[float, Planned | PlanFailed]] = []
        self.answers_held = False
        self.files_held = False
        self._read: ProgramRead | ProgramNotRead | None = None
        self._answers: list[AskDone] = []
        self._calls = 0
        self._sequence = 0

    @property
    def state(self) -> RobotState:
        return self.states[-1]

    def call(self, command: Command, heard: Heard | None = None) -> str:
        self._calls += 1
        id = f"call{self._calls}"
        if heard is None and self.states:
            heard = Heard(self.state.boot, self.state.sequence)
        self.agent.receive(Request(id, Call(id, command, heard)), self.now)
        return id

    def run(self, seconds: float) -> None:
        for _ in range(round(seconds / STEP_S)):
            self.step()

    def step(self) -> None:
        """One agent step and the gateway cycles after it."""
        if not self.feedback_lost:
            self.agent.receive(Arrived(self._feedback(), self.now), self.now)
        if not self.manager_silent:
            self._manager()
        if self.inputs is not None and not self.manager_silent:
            self.agent.receive(self._gateway_state(self.inputs), self.now)
        if not self.plans_held:
            self.release_plans()
        for effect in self.agent.step(self.now):
            self._perform(effect)
        for _ in range(round(STEP_S / CYCLE_S)):
            self._play()
        self.now += STEP_S

    def _planner_for(self, *told: Any) -> Planner:
        if told != (self.planner.cycle_s, self.planner.quick_stop):
            self.planner = Planner(self._placed, *told)
        return self.planner

    def quick_stop(self, beside: NDArray[np.float64] | float = 0.0) -> None:
        """The drives stop at once, `beside` `(n,)` where they are commanded to be, and have no torque any more."""
        self.faulty, self.enabled = True, False
        self.push(beside)

    def brake(self, deceleration: NDArray[np.float64]) -> None:
        """The drives' own quick stop: each joint brakes with its `deceleration` `(n,)`, until it stands."""
        self.enabled, self.queue, self.braking, self._still = False, [], deceleration, 0

    def push(self, beside: NDArray[np.float64] | float) -> None:
        """Somebody moves a robot without torque."""
        assert not self.enabled
        self.queue, self.commanded = [], self.commanded + beside

    def grant(self) -> None:
        """From now on the manager gives the zone to whoever wants it, and frees it when it is given up."""
        self.granting = True
        self.zone = ZoneStatus(ZoneState.FREE, None, None, (), 1, 0.0)

    def release_answers(self) -> None:
        """Let the gateway's answers to the agent's calls arrive."""
        while self._answers:
            self.agent.receive(self._answers.pop(0), self.now)

    def release_files(self) -> None:
        """Let the agent have what was read for it."""
        self.agent.receive(self._read, self.now)

    def release_plans(self) -> None:
        """Let the agent have what is planned for it by now."""
        while self._plans and self._plans[0][0] <= self.now:
            self.agent.receive(self._plans.pop(0)[1], self.now)

    def _play(self) -> None:
        self.tick += 1
        before = self.commanded
        if self.braking is not None:
            self._brake(self.braking)
        elif self.queue:
            self.commanded = self.queue.pop(0)
            self.velocity = (self.commanded - before) / CYCLE_S
        else:
            self.velocity = np.zeros_like(before)
        self.played.append(self.commanded)
        while self._output_events and self._output_events[0].tick <= self.tick:
            event = self._output_events.pop(0)
            if not self.switched or event.number > self.switched[-1][1].number:
                self.switched.append((self.tick, event))

    def _brake(self, deceleration: NDArray[np.float64]) -> None:
        """One cycle; the gateway measures for 0.1 s before it says that the robot stands."""
        braking_s = np.minimum(CYCLE_S, np.abs(self.velocity) / deceleration)
        lost = np.sign(self.velocity) * deceleration * braking_s
        self.commanded = self.commanded + (self.velocity - lost / 2.0) * braking_s
        left = self.velocity - lost
        self.velocity = np.where(np.abs(left) < 1e-12, 0.0, left)
        self._still = 0 if self.velocity.any() else self._still + 1
        if self._still * CYCLE_S >= 0.1:
            self.braking, self.faulty = None, True

    def _feedback(self) -> DriveFeedback:
        self._sequence += 1
        off = AxisStatus.SILENT if self.drives_silent else AxisStatus.SWITCH_ON_DISABLED
        axes = (AxisStatus.OPERATION_ENABLED if self.enabled else off,) * len(self.commanded)
        position = self.commanded if self.measured is None else self.measured
        state = PlayoutState.PLAYING if self.enabled else PlayoutState.FOLLOWING
        state = PlayoutState.FAULT if self.faulty else state
        state = PlayoutState.STOPPING if self.braking is not None else state
        sequence = self.block.sequence if self.block is not None else 0
        return DriveFeedback(
            "left", "gateway", self._sequence, self.tick, 7, sequence, state, len(self.queue), 0, self.referenced,
            self.enabled, position, self.velocity, self.commanded, axes,
            event=self.switched[-1][1].number if self.switched else 0, outputs=self._switched_on(),
        )  # fmt: skip

    def _switched_on(self) -> int:
        on = {event.output: event.value for _, event in self.switched}
        return sum(1 << output for output, value in on.items() if value)

    def _grant_or_free(self, presence: Presence) -> None:
        """The manager's rule in short: grant what is wanted, free what a presence that knows of it does not hold."""
        knows = presence.heard is not None and presence.heard.sequence > self._granted_at
        if self.zone.holder is None and "handover" in presence.wants:
            self._tokens += 1
            self.zone = ZoneStatus(ZoneState.GRANTED, "left", Token(5, self._tokens), (), 1, 0.0)
            self._granted_at = self._sequence
        elif self.zone.holder == "left" and knows and not presence.holds:
            self.zone = ZoneStatus(ZoneState.FREE, None, None, (), 1, 0.0)

    def _granted_if_wanted(self, zone: str) -> ZoneStatus:
        said = self.presences[-1] if self.presences else None
        if said is None or zone not in {*said.wants, *said.holds}:
            return ZoneStatus(ZoneState.FREE, None, None, (), 1, 0.0)
        return ZoneStatus(ZoneState.GRANTED, "left", said.holds.get(zone, Token(5, 1000 + self._sequence)), (), 1, 0.0)

    def _manager(self) -> None:
        if self.granting and self.presences:
            self._grant_or_free(self.presences[-1])
        heard = {"left": Heard("boot", self.presences[-1].sequence)} if self.presences else {}
        if not self.geometry_lost:
            self.agent.receive(self.geometry, self.now)
            for zone in self.other_zones:
                self.agent.receive(zone, self.now)
        for frame in () if self.frames_lost else self.frames:
            self.agent.receive(frame, self.now)
        zones = {"handover": self.zone} | {zone.zone: self._granted_if_wanted(zone.zone) for zone in self.other_zones}
        state = ManagerState("test", "m", 5, self._sequence, self.now, "digest", heard, zones)
        state = replace(state, setup=self.setup, frames={frame.frame: frame.version for frame in self.frames})
        state = replace(state, meetings=self.meetings, zone_change=self.zone_change)
        self.agent.receive(Arrived(state, self.now), self.now)

    def _clear(self, presence: Presence) -> None:
        """Answers a presence that asks for room at the next step."""
        way = presence.way
        asked = len(way.sections) - way.owned
        if asked == 0 or self.manager_silent:
            return
        self._clearances += 1
        cleared = asked if self.clears is None else min(self.clears, asked)
        refused = None if cleared == asked else Refusal("right", "right is in the way")
        self.agent.receive(
            Clearance("left", "m", 5, presence.owner, presence.sequence, self._clearances, cleared, refused), self.now
        )

    def _gateway_state(self, inputs: dict[str, bool | None]) -> GatewayState:
        counters = BusCounters(0, 0, 0.0, 0, 0, 0, 0.0)
        heard = Heard("m", self._sequence)
        return GatewayState(
            "left_bus", "gateway", self._sequence, CYCLE_S, "virtual", True, "", {"left": "boot"}, None, (), counters,
            heard=heard, inputs={"left": inputs},
        )  # fmt: skip

    def _perform(self, effect: Effect) -> None:
        match effect:
            case Publish(SetpointBlock() as block):
                self._offer(block)
            case Publish(Event() as event):
                self.events.append(event)
            case Publish(Presence() as presence):
                self.presences.append(presence)
                self._clear(presence)
            case Publish(RobotVariables() as told):
                self.variables.append(told)
            case Publish(RobotState() as state):
                self.states.append(state)
            case Ask(ask_id, _, Call(id=id, command=command)):
                self.asked_last = type(command)
                self._answers.append(AskDone(ask_id, self._gateway_says(id, command)))
                if not self.answers_held:
                    self.release_answers()
            case Ended():
                self.ended = True
            case Answer(request_id, Reply() as reply):
                self.replies[request_id] = reply
            case Plan(request):
                begun = time.process_time()
                result: Planned | PlanFailed = self.planner.plan(request)
                took_s = time.process_time() - begun if self.planning_s is None else self.planning_s
                if isinstance(result, Planned):
                    self.planned.append(result)
                self._plans.append((self.now + took_s, result))
                if not self.plans_held:
                    self.release_plans()
            case WritePoint(id, file, name, point, owner):
                try:
                    taught = write_point(file, name, point, owner)
                    self.agent.receive(PointWritten(id, taught), self.now)
                except NotWritten as error:
                    self.agent.receive(PointNotWritten(id, str(error)), self.now)
            case ReadProgram(id, cell, robot, model, file):
                try:
                    self._read = ProgramRead(id, read_program(cell, robot, model, file))
                except ConfigError as error:
                    self._read = ProgramNotRead(id, mistakes_text(error.problems))
                if not self.files_held:
                    self.release_files()
            case HearKeys(keys):
                self.heard_keys += keys
            case NoteDoubt(doubtful):
                self.mount_in_doubt = doubtful
            case Unplan(ids):
                self.unplanned.extend(ids)

    def _gateway_says(self, id: str, command: Command) -> Reply:
        match command:
            case Claim():
                axes = self.planner.model.joint_names
                grant = ClaimGrant(7, CYCLE_S, self.tick, axes, "gateway", self.torques, self.outputs, 0, self.brakes)
                return Reply(id, True, "yours", grant)
            case EnableDrives():
                self.enabled = True
            case DisableDrives() if self.keeps_enabled:
                return Reply(id, False, "left moves; halt it first")
            case DisableDrives():
                self.enabled = False
            case ResetDrives():
                self.faulty = False
            case Release() if self.settling:
                return Reply(id, False, "left moves; release it at rest")
        return Reply(id, True, "done")

    def _offer(self, block: SetpointBlock) -> None:
        """The gateway's rule in short: still to come, and continuous with what is queued."""
        if not self.enabled:
            self.signs_of_life.append(block)
        if self.lose_blocks or not self.enabled:
            return
        self.blocks.append(block)
        offset = block.first_tick - self.tick - 1
        if offset < 0:
            return
        queued = [*self.queue, *[self.queue[-1] if self.queue else self.commanded] * (offset + 1 - len(self.queue))]
        assert np.abs(queued[offset] - block.position[0]).max() < 1e-9, "a block must continue what is queued"
        assert all(block.first_tick <= each.tick < block.first_tick + block.nominal for each in block.events)
        assert block.nominal <= len(block.position)
        self._output_events = [e for e in self._output_events if e.tick < block.first_tick] + list(block.events)
        self.queue = [*queued[:offset], *block.position]
        self.block = replace(block)
