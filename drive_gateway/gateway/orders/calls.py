"""The calls of a gateway: which robot, node or bus each one is for, and how its answer gets back."""

from collections.abc import Mapping
from math import inf

from cell.core import Effect, Request
from cell.messages import (
    AcceptPosition,
    Call,
    Claim,
    ClaimGrant,
    DisableDrives,
    EnableDrives,
    ForceOutput,
    HoldSetup,
    Home,
    MoveAxes,
    PressAxis,
    ReadObject,
    RecordBus,
    Release,
    ResetDrives,
    ScanBus,
    SimulateInput,
    SwitchOutput,
    Who,
    WriteObject,
)
from cell.messages.drive_fault import FaultDrive
from cell.net.freshness import Sent
from drive_gateway.gateway.effects import Record, RecordSaid
from drive_gateway.gateway.event_log import EventLog
from drive_gateway.gateway.io.io_node import IoNode
from drive_gateway.gateway.nodes.scan import Scan
from drive_gateway.gateway.orders.fault_orders import FaultOrders
from drive_gateway.gateway.orders.input_orders import InputOrders
from drive_gateway.gateway.orders.objects import ObjectAccess
from drive_gateway.gateway.orders.replies import Replies
from drive_gateway.gateway.orders.setup_turn import SetupTurn
from drive_gateway.gateway.robots.robot import Robot

SEEN_STATE = (
    Home,
    MoveAxes,
    PressAxis,
    SwitchOutput,
    ForceOutput,
    AcceptPosition,
    WriteObject,
    FaultDrive,
    SimulateInput,
)
"""Orders that move, release or switch something: carried out within their time, in view of a `GatewayState`."""
SEEN_FEEDBACK = (EnableDrives, ResetDrives)
"""The same of a robot's owner, in view of its `DriveFeedback`. What is in neither changes nothing, stops, or switches
off; `HoldSetup` counts as of the moment that it echoes."""

RobotCommand = (
    Claim
    | Release
    | EnableDrives
    | DisableDrives
    | ResetDrives
    | Home
    | MoveAxes
    | PressAxis
    | HoldSetup
    | SwitchOutput
    | ForceOutput
    | AcceptPosition
)


class GatewayCalls:
    """Takes requests, does what they ask for or says why not, and collects the answers.

    Args:
        gateway: its name.
        boot: this process' boot.
        digest: of the configuration; a claim with another one is refused.
        process: what `who` tells besides role, name and boot.
        robots: on this bus, by name.
        io_nodes: on this bus, by name.
        scan: of the bus.
        turn: the orders for motions of the drives' own.
        states: when the gateway's states were sent.
        command_s: an order that moves, releases or switches something is carried out no later than this after it was
            made [s].
        state_s: the gateway's states are so far apart, so what an operator has seen may be older by that [s].
        log: where a call is told that failed.
    """

    def __init__(
        self,
        gateway: str,
        boot: str,
        digest: str,
        process: str,
        robots: Mapping[str, Robot],
        io_nodes: Mapping[str, IoNode],
        scan: Scan,
        turn: SetupTurn,
        states: Sent,
        command_s: float,
        state_s: float,
        log: EventLog,
    ) -> None:
        self._gateway = gateway
        self._boot = boot
        self._digest = digest
        self._process = process
        self._robots = robots
        self._drives = [drive for robot in robots.values() for drive in robot.group.nodes]
        self._io_nodes = io_nodes
        groups = [robot.group for robot in robots.values()]
        of_robots = {drive.node.id: (drive.node, [group]) for group in groups for drive in group.nodes}
        of_io = {io.node.id: (io.node, [each for each in groups if io in each.io_nodes]) for io in io_nodes.values()}
        self._access = ObjectAccess(of_robots | of_io)
        self._scan = scan
        self._turn = turn
        self._states = states
        self._command_s = command_s
        self._state_s = state_s
        self._log = log
        nodes = {(drive.axis.node_id, drive.axis.number): drive.node for drive in self._drives}
        nodes |= {(io.node.id, 1): io.node for io in io_nodes.values()}
        self._faults = FaultOrders(gateway, nodes)
        self._inputs = InputOrders(robots)
        self._replies = Replies()
        self._orders: list[Effect] = []
        self._now = 0.0
        self._tick = 0
        self.closing = False
        """The gateway is being stopped: no robot may be claimed any more."""

    def request(self, request: Request, now: float, tick: int) -> None:
        """One request; a repeated call is answered again and not done again."""
        self._now, self._tick = now, tick
        call = request.call
        if isinstance(call, Call) and self._replies.opened(request.request_id, call):
            problem = self._too_old(call)
            if problem:
                self._replies.give(call.id, False, problem)
            else:
                self._guarded(call)

    def _guarded(self, call: Call) -> None:
        """A call that the gateway cannot carry out is answered, and the gateway goes on."""
        try:
            self._do(call)
        except Exception as error:
            found = f"{type(error).__name__}: {error}"
            self._log.warn(
                "call_failed",
                f"the call {call.command.verb} could not be carried out ({found}): {call.command}",
                "report this with the call; no other part of the gateway is affected",
            )
            self._replies.give(
                call.id, False, f"gateway {self._gateway} could not carry out {call.command.verb}: {found}"
            )

    def recorded(self, said: RecordSaid) -> None:
        """The shell answers a call for a recording."""
        self._replies.give(said.call_id, said.ok, said.text)

    def take(self, now: float) -> list[Effect]:
        """What the calls of this cycle lead to."""
        orders, self._orders = self._orders, []
        return [*orders, *self._replies.take(now)]

    def _do(self, call: Call) -> None:
        def then(ok: bool, text: str, data: str = "") -> None:
            self._replies.give(call.id, ok, text, data=data)

        match call.command:
            case Who():
                then(True, f"gateway {self._gateway}, boot {self._boot}, {self._process}")
            case ReadObject() | WriteObject() as command:
                self._access.obey(command, then)
            case ScanBus():
                self._scan.begin(lambda found: then(True, self._scanned(found)))
            case RecordBus(file, seconds):
                self._orders.append(Record(call.id, file, seconds))
            case FaultDrive() as order:
                self._faults.obey(order, then)
            case SimulateInput() as order:
                self._inputs.obey(order, then)
            case command if isinstance(command, RobotCommand):
                robot = self._robots.get(command.robot)
                if robot is None:
                    known = ", ".join(self._robots)
                    then(False, f"no robot {command.robot} on gateway {self._gateway}; it has {known}")
                else:
                    self._command(robot, command, call)
            case other:
                then(False, f"{other.verb} is no call of a gateway")

    def _command(self, robot: Robot, command: RobotCommand, call: Call) -> None:
        def then(ok: bool, text: str) -> None:
            self._replies.give(call.id, ok, text)

        match command:
            case Claim():
                self._replies.give(call.id, *self._claim(robot, command))
            case Home() | MoveAxes() | PressAxis():
                problem = self._turn.elsewhere(robot.name) or self._torque_elsewhere(robot)
                if problem:
                    then(False, problem)
                else:
                    self._turn.take(robot, command, call.id, self._now, then)
            case EnableDrives() if problem := self._turn.elsewhere(robot.name):
                then(False, f"{robot.name} stays off: {problem}")
            case EnableDrives() if self._turn.waiting(robot.name):
                then(False, f"{robot.name} is to be set up; enable it when that is done")
            case AcceptPosition(_, axes):
                then(*robot.accept(axes))
            case HoldSetup():
                text, data = robot.hold(command.order, self._now - self._states.age(call.heard, self._now))
                self._replies.give(call.id, True, text, data=data)
            case (SwitchOutput() | ForceOutput()) as order:
                robot.hand.order(order, then)
            case DisableDrives():
                self._turn.drop(robot.name, "it was disabled")
                robot.obey(command, self._now, then)
            case _:
                robot.obey(command, self._now, then)

    def _torque_elsewhere(self, robot: Robot) -> str:
        others = [other for other in self._robots.values() if other is not robot]
        names = [other.name for other in others if not other.group.standstill.switched_off]
        return f"set-up needs every other robot disabled, {names[0]} is not: cell disable {names[0]}" if names else ""

    def _too_old(self, call: Call) -> str:
        """Why a call is not carried out any more: what its caller looked at is long over; empty when it is young."""
        command = call.command
        if isinstance(command, SEEN_FEEDBACK):
            robot = self._robots.get(command.robot)
            states, allowed_s, what = (None if robot is None else robot.feedbacks), self._command_s, "drive feedback"
        elif isinstance(command, SEEN_STATE):
            states, allowed_s, what = self._states, self._command_s + self._state_s, "a state"
        else:
            return ""
        age_s = inf if states is None else states.age(call.heard, self._now)
        if age_s <= allowed_s:
            return ""
        found = "no longer known" if age_s == inf else f"{age_s:.2f} s old"
        return (
            f"the call is too old to be carried out: it answers {what} of gateway {self._gateway} that is {found}, "
            f"{allowed_s:g} s are allowed; look at the robot, then call again"
        )

    def _claim(self, robot: Robot, command: Claim) -> tuple[bool, str, ClaimGrant | None]:
        if command.digest != self._digest:
            text = (
                f"robot {robot.name}: the agent's configuration is {command.digest}, this gateway's is {self._digest}; "
                "start both with the same cell file"
            )
            return False, text, None
        if self.closing:
            return False, f"gateway {self._gateway} is being stopped", None
        return robot.claim(command, self._now, self._tick)

    def _scanned(self, strange: Mapping[int, int]) -> str:
        lines: dict[int, str] = {}
        for drive in self._drives:
            before = lines.get(drive.node.id)
            lines[drive.node.id] = drive.said() if before is None else f"{before}\n{drive.said()}"
        lines |= {io.node.id: io.said() for io in self._io_nodes.values()}
        lines |= {
            number: f"node {number}: not in the drives file, device type {device_type:08X}h"
            for number, device_type in strange.items()
        }
        return "\n".join(lines[number] for number in sorted(lines))
