"""One virtual run: an agent's core of its own, what it may hear of the cell, and what of its effects counts."""

from collections import OrderedDict
from collections.abc import Callable, Iterable
from dataclasses import replace
from typing import Protocol

from cell.core import Answer, Arrived, Ask, AskDone, Effect, Frozen, Publish, Request
from cell.messages import (
    Arrival,
    Call,
    CellVariables,
    Claim,
    ConveyorCount,
    Correction,
    Event,
    FramePose,
    GatewayState,
    Heard,
    ManagerState,
    MeetingStatus,
    Mode,
    Presence,
    ProgramState,
    Reply,
    RobotState,
    Run,
    SetpointBlock,
    Severity,
    VirtualStatus,
)
from cell.net.plain import PlainText
from robot_agent.agent.planning.plans import Plan, PlanFailed, Planned, Unplan
from robot_agent.agent.program.pace import Pace
from robot_agent.agent.program.program_run import ProgramRun
from robot_agent.agent.virtual.looped_gateway import LoopedGateway

_PLANS = 2**40
"""Ids of plans by run: so far apart that a late result is never taken for one of another run, or of the robot's."""
_REMEMBERED = 200
"""Presences: more than come in the two seconds that an echo counts."""
_MEETS_AFTER_S = 0.3
"""Nobody is waited for at a MEET; the run leaves it so long after it has come there."""
_LIVE = FramePose | GatewayState | Correction | ConveyorCount | CellVariables | PlainText | Frozen
_UNDER_WAY = (Mode.RUNNING, Mode.HALTED)

Note = Callable[[Severity, str, str, str], None]
"""Takes severity, code, text and remedy of what has happened."""


class VirtualCore(Protocol):
    """What is run here of an `AgentCore`."""

    mode: Mode
    run: ProgramRun
    pace: Pace

    def receive(self, message: object, now: float) -> None: ...

    def step(self, now: float) -> list[Effect]: ...


class VirtualRun:
    """From the order to run until the program has ended; `over` then."""

    def __init__(
        self, robot: str, core: VirtualCore, gateway: LoopedGateway, order: Request, number: int, note: Note
    ) -> None:
        """`number` is above 0 and another one for each run of an agent."""
        self._robot = robot
        self._core = core
        self._gateway = gateway
        self._note = note
        self._first_plan = number * _PLANS
        self._orders = [order]
        """Not handed over yet; the first of them begins the program."""
        self._unanswered = {order.request_id: order}
        self._begun = False
        self.over = False
        self._picture: RobotState | None = None
        self._presence: Presence | None = None
        self._said: OrderedDict[Heard, Heard] = OrderedDict()
        """By a presence of the robot, the one that the run's core made in the same step."""

    # In

    def order(self, request: Request) -> None:
        """Take an operator's order to the run, which was young enough."""
        self._orders.append(request)
        self._unanswered[request.request_id] = request

    def hear(self, message: object, now: float) -> bool:
        """Take what the robot's agent hears; whether it was for nobody else."""
        match message:
            case Planned(id=id) | PlanFailed(id=id):
                if abs(id - self._first_plan) >= _PLANS // 2:
                    return False
                self._core.receive(replace(message, id=id - self._first_plan), now)
                return True
            case Arrived(ManagerState() as state, at):
                self._core.receive(Arrived(self._told(state), at), now)
            case _ if isinstance(message, _LIVE):
                self._core.receive(message, now)
        return False

    def _told(self, state: ManagerState) -> ManagerState:
        """A manager's state without zones, stops and other robots, as an answer to the run's own presence."""
        heard = state.heard.get(self._robot)
        mine = None if heard is None else self._said.get(heard)
        return replace(
            state, heard={} if mine is None else {self._robot: mine}, zones={}, refused={}, estops=(), setup=None,
            deadlocks=(), zone_change=None, meetings=self._meetings(state),
        )  # fmt: skip

    def _meetings(self, state: ManagerState) -> dict[str, MeetingStatus]:
        waits = None if self._presence is None else self._presence.meets.waits
        if waits is None or self._presence is None:
            return {}
        there = {self._robot: Arrival(self._presence.boot, waits.number)}
        return {waits.meeting: MeetingStatus(released=there, leave_at=state.cell_time + _MEETS_AFTER_S)}

    # Out

    def step(self, said: Heard, pace: Pace, now: float) -> list[Effect]:
        """One step of the run's core; `said` is the robot's newest presence, `pace` as the operator has set it."""
        self._core.pace.follow(pace)
        self._core.receive(Arrived(self._gateway.feedback(now), now), now)
        self._hand_over(now)
        effects = self._sink(self._core.step(now), now)
        if self._presence is not None:
            self._said[said] = Heard(self._presence.boot, self._presence.sequence)
            while len(self._said) > _REMEMBERED:
                self._said.popitem(last=False)
        return effects + self._ended(now)

    def _hand_over(self, now: float) -> None:
        """Hand waiting orders over, as calls in view of the picture, once the run's core can take them."""
        if self._picture is None or (not self._begun and self._core.mode is not Mode.READY):
            return
        seen = Heard(self._picture.boot, self._picture.sequence)
        for request in self._orders:
            if isinstance(call := request.call, Call):
                command = replace(call.command, virtual=False) if isinstance(call.command, Run) else call.command
                self._core.receive(Request(request.request_id, replace(call, command=command, heard=seen)), now)
        self._orders = []

    def _sink(self, effects: Iterable[Effect], now: float) -> list[Effect]:
        """What of the core's effects leaves the run: answers and orders for plans. Everything else stays here."""
        out: list[Effect] = []
        for effect in effects:
            match effect:
                case Answer(request_id, Reply() as reply):
                    self._unanswered.pop(request_id, None)
                    out.append(Answer(request_id, replace(reply, text=f"virtual run: {reply.text}")))
                case Plan(request):
                    out.append(Plan(replace(request, id=request.id + self._first_plan)))
                case Unplan(ids):
                    out.append(Unplan(tuple(id + self._first_plan for id in ids)))
                case Ask(ask_id, _, Call(command=Claim())):
                    self._core.receive(AskDone(ask_id, Reply(ask_id, True, "", self._gateway.grant)), now)
                case Publish(SetpointBlock() as block):
                    self._gateway.take(block)
                case Publish(Presence() as presence):
                    self._presence = presence
                case Publish(RobotState() as state):
                    self._picture = state
                case Publish(Event(severity=severity, code=code, text=text, remedy=remedy)):
                    self._note(severity, code, f"virtual run: {text}", remedy)
        return out

    def _ended(self, now: float) -> list[Effect]:
        """Close the run once the program that it was made for does not run any more, or could not begin."""
        mode, program = self._core.mode, self._core.run
        if mode in _UNDER_WAY:
            self._begun = True
            return []
        if self._begun:
            how = {ProgramState.DONE: "is done", ProgramState.LOADED: "was stopped"}.get(program.state)
            text = f"the virtual run of {program.status.name} {how or f'has ended early: {program.error}'}"
            text += "; nothing was moved, and nothing switched"
            self._note(Severity.INFO if how else Severity.WARNING, "virtual_ended", text, "")
            return self.end(text, now)
        if mode is Mode.FAULT:
            alarms = () if self._picture is None else self._picture.alarms
            return self.end(f"{self._robot} cannot run virtually: {'; '.join(alarms)}", now)
        return self.end("", now) if not self._unanswered else []

    def cut(self, why: str, now: float) -> list[Effect]:
        """End it from outside."""
        text = f"the virtual run has ended early: {why}"
        self._note(Severity.WARNING, "virtual_ended", text, "")
        return self.end(text, now)

    def end(self, why: str, now: float) -> list[Effect]:
        """The run is over: refuse what waits for an answer, and have nothing planned for it any more."""
        self.over = True
        calls = [(id, request.call) for id, request in self._unanswered.items()]
        refused = [Answer(id, Reply(call.id, False, why)) for id, call in calls if isinstance(call, Call)]
        self._core.run.lookahead.stop()
        return [*refused, *self._sink(self._core.run.lookahead.drop(), now)]

    # The picture

    @property
    def status(self) -> VirtualStatus | None:
        """For everyone; None before the run has begun."""
        seen = self._picture
        if seen is None or not self._begun or self.over:
            return None
        return VirtualStatus(
            seen.mode, seen.program, seen.joints, seen.tcp_position_m, seen.tcp_quaternion_xyzw, seen.tcp_speed_m_s,
            seen.governor, seen.move, seen.pace, seen.waiting_for, self._gateway.outputs, seen.tool, seen.part,
        )  # fmt: skip
