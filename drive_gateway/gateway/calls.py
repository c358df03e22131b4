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
    HoldSetup,
    Home,
    MoveAxes,
    PressAxis,
    ReadObject,
    RecordBus,
    Release,
    ResetDrives,
    ScanBus,
    SwitchOutput,
    Who,
    WriteObject,
)
from cell.messages.drive_fault import FaultDrive
from cell.net.freshness import Sent
from drive_gateway.gateway.effects import Record, RecordSaid
from drive_gateway.gateway.fault_orders import FaultOrders
from drive_gateway.gateway.objects import ObjectAccess
from drive_gateway.gateway.replies import Replies
from drive_gateway.gateway.robot import Robot
from drive_gateway.gateway.scan import Scan

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
    | AcceptPosition
)


class Calls:
    """Takes requests, does what they ask for or says why not, and collects the answers.

    Args:
        gateway: its name.
        boot: this process' boot.
        digest: of the configuration; a claim with another one is refused.
        process: what `who` tells besides role, name and boot.
        robots: on this bus, by name.
        scan: of the bus.
        seen_s: an operator who switches an output has seen a state of the gateway that is no older than this [s].
    """

    def __init__(
        self,
        gateway: str,
        boot: str,
        digest: str,
        process: str,
        robots: Mapping[str, Robot],
        scan: Scan,
        seen_s: float,
    ) -> None:
        self._gateway = gateway
        self._boot = boot
        self._digest = digest
        self._process = process
        self._robots = robots
        self._drives = [drive for robot in robots.values() for drive in robot.group.nodes]
        self._access = ObjectAccess(
            {drive.node.id: robot.group for robot in robots.values() for drive in robot.group.nodes}
        )
        self._scan = scan
        self._seen_s = seen_s
        self._states = Sent(boot)
        nodes = {(drive.axis.node_id, drive.axis.number): drive.node for drive in self._drives}
        self._faults = FaultOrders(gateway, nodes)
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
            self._do(call)

    def sent_state(self, sequence: int, now: float) -> None:
        """A state of the gateway with `sequence` is sent at `now`: orders that echo it are as young as that."""
        self._states.record(sequence, now)

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
                others = [other.name for other in self._robots.values() if other.group.setup.motion is not None]
                if others:
                    then(False, f"{others[0]} is being set up; one robot at a time")
                else:
                    robot.set_up(command, self._now, then)
            case AcceptPosition(_, axes):
                then(*robot.accept(axes))
            case HoldSetup():
                text, data = robot.hold(self._now)
                self._replies.give(call.id, True, text, data=data)
            case SwitchOutput() as order:
                problem = self._too_old(call)
                if problem:
                    then(False, problem)
                else:
                    robot.hand.order(order, then)
            case _:
                robot.obey(command, self._now, then)

    def _too_old(self, call: Call) -> str:
        """Why a call is not carried out any more: what its operator looked at is long over; empty when it is young."""
        age_s = self._states.age(call.heard, self._now)
        if age_s <= self._seen_s:
            return ""
        found = "no longer known" if age_s == inf else f"{age_s:.2f} s old"
        return (
            f"the call is too old to be carried out: it answers a state of gateway {self._gateway} that is {found}, "
            f"{self._seen_s:g} s are allowed; look at the robot, then call again"
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
        lines |= {
            number: f"node {number}: not in the drives file, device type {device_type:08X}h"
            for number, device_type in strange.items()
        }
        return "\n".join(lines[number] for number in sorted(lines))
