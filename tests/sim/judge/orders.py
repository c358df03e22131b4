"""Operators' calls, emergency stops, claims: each is done in time, once, and only where it was asked for."""

from math import inf

from cell.core import Request
from cell.messages import (
    AcceptPosition,
    AdoptZone,
    Call,
    Claim,
    ClearSetup,
    ClearZone,
    Command,
    ConfineRobot,
    Continue,
    DriveFeedback,
    Enable,
    Estop,
    Event,
    FaultDrive,
    ForceOutput,
    Go,
    Halt,
    Home,
    Jog,
    ManagerState,
    Mode,
    MoveAxes,
    PlaceFrame,
    PressAxis,
    Release,
    Reply,
    ResetEstop,
    Return,
    RobotStands,
    RobotState,
    Run,
    SetEstop,
    SetpointBlock,
    SetZone,
    SimulateInput,
    Step,
    Stop,
    SwitchOutput,
    TeachFrame,
    Who,
    WriteObject,
)
from cell.net.estops import MOST_LISTED
from robot_agent.agent.planning.plans import Plan
from tests.sim.judge.facts import BY_FEEDBACK, Facts
from tests.sim.judge.invariant import Handlers, Invariant

_ANY_TIME = (Who, Halt, Stop)
"""Of what a robot is ordered: what is carried out however old it is; nothing else is."""
_DATED = (
    ResetEstop, ClearZone, AdoptZone, ClearSetup, ConfineRobot, RobotStands, SetZone, PlaceFrame, TeachFrame,
    Home, MoveAxes, PressAxis, SwitchOutput, ForceOutput, AcceptPosition, WriteObject, FaultDrive, SimulateInput,
    *BY_FEEDBACK,
)  # fmt: skip
"""Of what a manager and a gateway are ordered: what moves, releases or switches something."""
_MOVES = (Enable, Run, Continue, Return, Step, Jog, Go)
_STOPPED = (Mode.ESTOP, Mode.FAULT)
_LATER_S = 0.02
_BETWEEN_STATES_S = 0.2
"""A gateway's states are so far apart: what an operator has seen of it may be older by that."""


class OrdersInTime(Invariant):
    """An order is carried out within its deadline, by what its caller had seen, or never; and once. A robot moves for
    nobody who had seen it no later than under an emergency stop or in a fault."""

    name = "orders are carried out in time and once"

    def __init__(self, facts: Facts) -> None:
        super().__init__(facts)
        self._asked: dict[tuple[str, str], tuple[Call, float]] = {}
        self._stopped_in: dict[str, int] = {}
        """By boot of an agent: the newest state in which its robot was stopped."""
        self._done: set[tuple[str, str]] = set()

    @property
    def delivered(self) -> Handlers:
        return {Request: self._call}

    @property
    def published(self) -> Handlers:
        return {Reply: self._reply, RobotState: self._state}

    def _state(self, _: str, state: RobotState) -> None:
        if state.mode in _STOPPED:
            self._stopped_in[state.boot] = state.sequence

    def _call(self, name: str, request: Request) -> None:
        call = request.call
        if isinstance(call, Call) and _dated(name, call.command):
            age_s = inf if self._saw_it_stopped(call) else self.facts.call_age(call, name)
            # Of a call that comes twice the first one counts.
            self._asked.setdefault((self.facts.told[name].boot, call.id), (call, age_s))

    def _saw_it_stopped(self, call: Call) -> bool:
        """Or no later; what is carried out nevertheless is as bad as if nothing had been seen."""
        if call.heard is None or not isinstance(call.command, _MOVES):
            return False
        return call.heard.sequence <= self._stopped_in.get(call.heard.boot, 0)

    def _reply(self, name: str, reply: Reply) -> None:
        key = self.facts.told[name].boot, reply.id
        if not reply.ok or key not in self._asked:
            return
        call, age_s = self._asked[key]
        by_state = name.startswith("gateway/") and not isinstance(call.command, BY_FEEDBACK)
        apart_s = _BETWEEN_STATES_S if by_state else 0.0
        if age_s > self.facts.cell.times.command_s + apart_s + _LATER_S:
            unseen = "nothing that it has sent since it was stopped, if anything"
            seen = unseen if age_s == inf else f"what was {age_s:.2f} s old"
            self.broken(name, f"it has carried out `{call.command.verb}` of a caller who had seen {seen}")
        if key in self._done:
            self.broken(name, f"it has carried out `{call.command.verb}`, call {call.id}, twice")
        self._done.add(key)


def _dated(name: str, command: Command) -> bool:
    """Whether what a process is ordered is carried out soon after, or never."""
    return not isinstance(command, _ANY_TIME) if name.startswith("robot/") else isinstance(command, _DATED)


class StopsAreKept(Invariant):
    """An emergency stop that reached the manager is in force until an operator ends it by its name, over restarts of
    the manager too; a stop ends for nobody else's sake. Of more than the manager lists, later ones stand for others."""

    name = "emergency stops are kept"

    def __init__(self, facts: Facts) -> None:
        super().__init__(facts)
        self._named: set[str] = set()
        """Stops that an operator's reset, which reached a manager, has named."""
        self._in_force: set[str] = set()

    @property
    def delivered(self) -> Handlers:
        return {Request: self._call, Estop: self._heard}

    @property
    def published(self) -> Handlers:
        return {ManagerState: self._state, Estop: self._told}

    def _call(self, name: str, request: Request) -> None:
        command = request.call.command if isinstance(request.call, Call) else None
        if name == "manager" and isinstance(command, ResetEstop):
            self._named |= set(command.ids)
        if name == "manager" and isinstance(command, SetEstop):
            self._in_force.add(command.id)

    def _heard(self, name: str, estop: Estop) -> None:
        if name == "manager" and estop.active:
            self._in_force.add(estop.id)

    def _told(self, name: str, estop: Estop) -> None:
        if not estop.active and estop.id not in self._named:
            self.broken(name, f"it ends emergency stop {estop.id}, which no operator has reset")

    def _state(self, name: str, state: ManagerState) -> None:
        told = {estop.id for estop in state.estops}
        if len(told) >= MOST_LISTED:
            self._named |= self._in_force - told
        if self.facts.journal_spoilt:
            self._in_force &= told
        missing = self._in_force - told - self._named
        if missing:
            self.broken(name, f"emergency stop {min(missing)} is not in force any more, and no operator has reset it")
        self._in_force = (self._in_force | told) - self._named


class OneOwner(Invariant):
    """A robot's drives have one owner at a time; numbers of claims grow, and change hands at rest, when the owner has
    released the robot or was silent for long."""

    name = "one owner"
    _SILENT = 0.8
    """Share of the time of silence after which a claim ends."""

    def __init__(self, facts: Facts) -> None:
        super().__init__(facts)
        self._claims: dict[tuple[str, str], Claim] = {}
        self._boots: dict[tuple[str, int], str] = {}
        self._largest: dict[str, int] = {}
        self._heard: dict[str, tuple[int, float]] = {}
        """Whose block a robot's gateway was told last, and when; not once that owner has released the robot."""
        self._owners: dict[str, tuple[str, int]] = {}
        """By the newest feedback, with the gateway's boot."""

    @property
    def delivered(self) -> Handlers:
        return {Request: self._call, SetpointBlock: self._block}

    @property
    def published(self) -> Handlers:
        return {Reply: self._reply, DriveFeedback: self._feedback}

    def lived(self, name: str, what: str) -> None:
        if what in ("started", "frozen"):
            for robot in self.facts.robots:
                if self.facts.gateway_of(robot) == name:
                    self._heard.pop(robot, None)

    def _block(self, _: str, block: SetpointBlock) -> None:
        self._heard[block.robot] = block.owner, self.facts.now

    def _call(self, name: str, request: Request) -> None:
        command = request.call.command if isinstance(request.call, Call) else None
        if isinstance(command, Claim):
            self._claims[name, request.call.id] = command
        if isinstance(command, Release):
            self._heard.pop(command.robot, None)

    def _reply(self, name: str, reply: Reply) -> None:
        claim = self._claims.get((name, reply.id))
        if claim is None or reply.claim is None or not reply.ok:
            return
        owner, robot = reply.claim.owner, claim.robot
        boot = self._boots.setdefault((robot, owner), claim.boot)
        if boot != claim.boot:
            self.broken(name, f"{robot}: owner {owner} is {claim.boot}, and was {boot}")
        if owner < self._largest.get(robot, 0):
            self.broken(name, f"{robot}: owner {owner} after {self._largest[robot]}")
        if owner > self._largest.get(robot, 0) and self.facts.moving(robot) and not self.facts.hindered(robot):
            self.broken(name, f"{robot} changes hands while it moves")
        heard, at = self._heard.get(robot, (0, -inf))
        silent_s, owned = self.facts.now - at, self._owners.get(robot) == (self.facts.told[name].boot, heard)
        long_s = self._SILENT * self.facts.cell.times.owner_silent_s
        if owned and 0 < heard < owner and silent_s < long_s:
            self.broken(name, f"{robot} changes hands, and its owner was heard {silent_s:.3f} s ago")
        self._largest[robot] = max(owner, self._largest.get(robot, 0))

    def _feedback(self, name: str, feedback: DriveFeedback) -> None:
        if feedback.owner and feedback.owner < self._largest.get(feedback.robot, 0):
            self.broken(name, f"{feedback.robot} is owned by {feedback.owner}, after {self._largest[feedback.robot]}")
        boot, before = self._owners.get(feedback.robot, (feedback.boot, 0))
        self._owners[feedback.robot] = feedback.boot, feedback.owner
        goes = boot == feedback.boot and before not in (0, feedback.owner) and self.facts.moving(feedback.robot)
        if goes and not self.facts.hindered(feedback.robot):
            self.broken(name, f"the claim of owner {before} ends, and {feedback.robot} moves")


class OutputsByOrder(Invariant):
    """An output is switched on only by an event of a block that is played, once, or by an operator; a stop switches off
    what is not to be kept."""

    name = "outputs are switched by order"
    _RECENT_S = 2.0
    _OFF_WITHIN_S = 0.3

    def __init__(self, facts: Facts) -> None:
        super().__init__(facts)
        self._outputs: dict[str, int] = {}
        self._played: dict[str, tuple[str, int, int]] = {}
        """Boot and owner of the newest feedback, and the event that it names."""
        self._by_hand: dict[str, float] = {}
        self._stopped_since: dict[str, float] = {}

    @property
    def delivered(self) -> Handlers:
        return {Request: self._call}

    @property
    def published(self) -> Handlers:
        return {DriveFeedback: self._feedback}

    def _call(self, _: str, request: Request) -> None:
        command = request.call.command if isinstance(request.call, Call) else None
        if isinstance(command, ForceOutput) or (isinstance(command, SwitchOutput) and command.on):
            self._by_hand[command.robot] = self.facts.now

    def _feedback(self, name: str, feedback: DriveFeedback) -> None:
        robot, now = feedback.robot, self.facts.now
        before = self._outputs.get(robot, 0)
        self._outputs[robot] = feedback.outputs
        by_hand = now - self._by_hand.get(robot, -inf)
        rising = feedback.outputs & ~before
        if rising and by_hand > self._RECENT_S and not self._ordered(feedback, rising):
            self.broken(name, f"an output of {robot} came on, and nobody has ordered it")
        played = feedback.boot, feedback.owner, feedback.event
        if rising and by_hand > self._RECENT_S and played == self._played.get(robot):
            self.broken(name, f"an output of {robot} came on by an event up to {feedback.event}, which was executed")
        self._played[robot] = played
        if feedback.enabled:
            self._stopped_since.pop(robot, None)
            return
        stopped_s = now - self._stopped_since.setdefault(robot, now)
        if feedback.outputs & ~self._kept(robot) and stopped_s > self._OFF_WITHIN_S and by_hand > stopped_s:
            what = "an output is on that is not to be kept"
            self.broken(name, f"{robot} has been stopped for {stopped_s:.2f} s, and {what}")

    def _ordered(self, feedback: DriveFeedback, rising: int) -> bool:
        """A fault may be found in the cycle in which an output is switched, and a claim may end in it."""
        if not feedback.enabled and feedback.robot in self._stopped_since:
            return False
        return any(
            event.value and rising >> event.output & 1
            for (owner, _), sent in self.facts.blocks[feedback.robot].items()
            if owner in (feedback.owner, self._owner_before(feedback)) and self.facts.now - sent.at < self._RECENT_S
            for event in sent.message.events
        )

    def _owner_before(self, feedback: DriveFeedback) -> int:
        boot, owner, _ = self._played.get(feedback.robot, ("", 0, 0))
        return owner if boot == feedback.boot and not feedback.owner else feedback.owner

    def _kept(self, robot: str) -> int:
        gateway = self.facts.gateway_of(robot).partition("/")[2]
        outputs = self.facts.world.bundle.gateways[gateway].robots[robot].outputs
        return sum(1 << place for place, output in enumerate(outputs) if output.keep)


class EffortIsBounded(Invariant):
    """Nothing is asked for again and again: plans, claims, events."""

    name = "effort is bounded"
    _PLANS, _CLAIMS, _EVENTS = 40, 12, 60
    _WITHIN_S = 2.0

    def __init__(self, facts: Facts) -> None:
        super().__init__(facts)
        self._times: dict[tuple[str, str], list[float]] = {}

    @property
    def published(self) -> Handlers:
        return {Call: self._call, Event: self._event}

    @property
    def effects(self) -> Handlers:
        return {Plan: self._plan}

    def _plan(self, name: str, _: Plan) -> None:
        self._count(name, "plans", self._PLANS)

    def _event(self, name: str, _: Event) -> None:
        self._count(name, "events", self._EVENTS)

    def _call(self, name: str, call: Call) -> None:
        if isinstance(call.command, Claim):
            self._count(name, "claims", self._CLAIMS)

    def _count(self, name: str, what: str, most: int) -> None:
        now = self.facts.now
        times = self._times.setdefault((name, what), [])
        times.append(now)
        while times[0] < now - self._WITHIN_S:
            times.pop(0)
        if len(times) > most:
            self.broken(name, f"{len(times)} {what} within {self._WITHIN_S:g} s")
