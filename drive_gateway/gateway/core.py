"""The gateway's core: one CAN bus, its drives and the robots they belong to.

Order of a cycle: SYNC first, then the RPDOs for the next SYNC; the nodes' TPDOs arrive in between. A sample that is
sent in the cycle of SYNC `tick` acts at SYNC `tick + 1`, so a block may still change tick `tick + 2` and later.
"""

from cell.config.settings import Times
from cell.core import Effect, Ended, Publish, Request, Shutdown
from cell.messages.commands import (
    Call,
    Claim,
    ClaimGrant,
    DisableDrives,
    EnableDrives,
    HoldSetup,
    Home,
    MoveAxes,
    ReadObject,
    RecordBus,
    Release,
    ResetDrives,
    ScanBus,
    Who,
    WriteObject,
)
from cell.messages.estop import Estop
from cell.messages.gateway_state import BusCounters, GatewayState
from cell.messages.setpoints import SetpointBlock
from drive_gateway.canopen import cob_id
from drive_gateway.canopen.bus_load import cyclic_load
from drive_gateway.canopen.frame import CanFrame
from drive_gateway.canopen.nmt import SYNC_FRAME, NmtCommand, NmtState, heartbeat_frame, nmt_frame
from drive_gateway.canopen.sdo import SdoDone
from drive_gateway.config.settings import GatewaySettings
from drive_gateway.gateway.effects import Frame, Record, RecordEnded, RecordSaid
from drive_gateway.gateway.estop import EstopLatch
from drive_gateway.gateway.event_log import EventLog
from drive_gateway.gateway.group import StopOrder, Then
from drive_gateway.gateway.lateness import Lateness
from drive_gateway.gateway.node import Node
from drive_gateway.gateway.objects import ObjectAccess
from drive_gateway.gateway.replies import Replies
from drive_gateway.gateway.robot import Robot
from drive_gateway.gateway.scan import Scan
from drive_gateway.gateway.trouble import Trouble

STATE_PERIOD_S = 0.2
RobotCommand = Claim | Release | EnableDrives | DisableDrives | ResetDrives | Home | MoveAxes | HoldSetup
CALLS = tuple(
    command.verb
    for command in (
        Who,
        Claim,
        Release,
        EnableDrives,
        DisableDrives,
        ResetDrives,
        ReadObject,
        WriteObject,
        ScanBus,
        RecordBus,
        Home,
        MoveAxes,
        HoldSetup,
    )
)


class GatewayCore:
    """See `cell.core.Core`; `step` is called once per bus cycle.

    Args:
        settings: the bus and its drives.
        times: the cell's deadlines.
        boot: this process' boot.
        digest: of the configuration; a claim with another one is refused.
        first_owner: number of the first claim, larger than any that was ever given on this bus (unix seconds).
        process: what `who` tells besides role, name and boot, for people.

    Raises:
        ValueError: the bus cycle is no interpolation period of a drive.
    """

    def __init__(
        self,
        settings: GatewaySettings,
        times: Times,
        *,
        boot: str,
        digest: str,
        first_owner: int = 1,
        process: str = "",
    ) -> None:
        self._settings = settings
        self._times = times
        self._boot = boot
        self._digest = digest
        self._process = process
        self._log = EventLog(settings.name)
        self._robots = {
            name: Robot(drives, settings, times, boot, first_owner, self._log)
            for name, drives in settings.robots.items()
        }
        self._nodes: dict[int, Node] = {
            node.axis.node_id: node for robot in self._robots.values() for node in robot.group.nodes
        }
        self._access = ObjectAccess(
            {node.axis.node_id: robot.group for robot in self._robots.values() for node in robot.group.nodes}
        )
        self._scan = Scan(self._nodes)
        self._records: list[Effect] = []
        self._estop = EstopLatch()
        self._replies = Replies()
        self._lateness = Lateness(settings.cycle_s)
        self._now = 0.0
        self._tick = 0
        self._sequence = 0
        self._state_due = 0.0
        self._heartbeat_due = 0.0
        self._confirmed: str | None = None
        self._closing_since: float | None = None
        self._bus_load = cyclic_load(
            len(self._nodes), settings.bus.bitrate, settings.cycle_s, settings.heartbeat_producer_s
        )

    def receive(self, message: object, now: float) -> None:
        self._now = now
        match message:
            case CanFrame():
                self._on_frame(message, now)
            case SetpointBlock():
                robot = self._robots.get(message.robot)
                if robot is not None:
                    robot.offer(message, now)
            case SdoDone():
                node = self._nodes.get(int(message.request_id.partition("/")[0]))
                if node is not None:
                    node.sdo.done(message)
            case Estop():
                self._on_estop(message, now)
            case Request():
                self._on_request(message)
            case RecordSaid(call_id, ok, text):
                self._replies.give(call_id, ok, text)
            case RecordEnded(text):
                self._log.info("recorded", text)
            case Shutdown():
                self._on_shutdown(now)

    def step(self, now: float) -> list[Effect]:
        self._now = now
        self._tick += 1
        effects: list[Effect] = [Frame(SYNC_FRAME)]
        lateness = self._lateness.cycle(now)
        if lateness > self._settings.overrun_limit_s:
            self._on_overrun(lateness, now)
        order = self._stop_order()
        for robot in self._robots.values():
            effects += robot.step(now, self._tick, order)
        if now >= self._heartbeat_due:
            # From the cycle and from nothing else: when the loop hangs, the drives must miss it.
            self._heartbeat_due = now + self._settings.heartbeat_producer_s
            effects.append(Frame(heartbeat_frame(NmtState.OPERATIONAL)))
        effects += self._scan.step(now)
        self._confirm()
        effects += self._records
        self._records = []
        effects += self._log.take()
        effects += self._replies.take(now)
        if now >= self._state_due:
            self._state_due = now + STATE_PERIOD_S
            effects.append(Publish(self._state()))
        if self._closing_since is not None and self._all_off():
            effects += [Frame(nmt_frame(NmtCommand.ENTER_PRE_OPERATIONAL, number)) for number in self._nodes]
            effects.append(Ended())
        return effects

    # Messages

    def _on_frame(self, frame: CanFrame, now: float) -> None:
        node = self._nodes.get(cob_id.node_id(frame.id))
        if node is None and cob_id.function_code(frame.id) == cob_id.SDO_FROM_NODE:
            self._scan.take(cob_id.node_id(frame.id), frame.data)
        if node is None or frame.remote:
            return
        match cob_id.function_code(frame.id):
            case cob_id.TPDO1:
                node.on_tpdo(frame.data, self._tick, now)
            case cob_id.ERROR_CONTROL:
                node.on_error_control(frame.data, now)
            case cob_id.EMCY:
                node.on_emergency(frame.data)

    def _on_estop(self, estop: Estop, now: float) -> None:
        if not self._estop.receive(estop, now):
            return
        if estop.active:
            self._log.warn("estop", f"emergency stop {estop.id} by {estop.by}: {estop.reason}", "reset at the manager")
        else:
            self._log.info("estop_cleared", f"emergency stop {estop.id} was cleared by {estop.by}")
        self._confirmed = None

    def _on_shutdown(self, now: float) -> None:
        if self._closing_since is None:
            self._closing_since = now
            self._log.info("closing", "the gateway comes to rest and switches its drives off")
            for robot in self._robots.values():
                robot.group.playout.closing = True

    def _on_overrun(self, lateness: float, now: float) -> None:
        limit = self._settings.overrun_limit_s
        text = f"bus cycle {lateness:.3f} s late, allowed {limit} s"
        for robot in self._robots.values():
            if robot.group.playout.live:
                robot.group.fault(Trouble("late_cycle", text, "take load off this host"), now)

    def _on_request(self, request: Request) -> None:
        call = request.call
        if isinstance(call, Call) and self._replies.opened(request.request_id, call):
            self._do(call)

    def _do(self, call: Call) -> None:
        def then(ok: bool, text: str) -> None:
            self._replies.give(call.id, ok, text)

        match call.command:
            case Who():
                then(True, f"gateway {self._settings.name}, boot {self._boot}, {self._process}")
            case (
                Claim()
                | Release()
                | EnableDrives()
                | DisableDrives()
                | ResetDrives()
                | Home()
                | MoveAxes()
                | HoldSetup() as command
            ):
                robot = self._robots.get(command.robot)
                if robot is None:
                    known = ", ".join(self._robots)
                    then(False, f"no robot {command.robot} on gateway {self._settings.name}; it has {known}")
                else:
                    self._command(robot, command, call.id, then)
            case ReadObject() | WriteObject() as command:
                self._access.obey(command, lambda ok, text, data: self._replies.give(call.id, ok, text, data=data))
            case ScanBus():
                self._scan.begin(lambda found: then(True, self._scanned(found)))
            case RecordBus(file, seconds):
                self._records.append(Record(call.id, file, seconds))
            case other:
                then(False, f"{other.verb} is no call of a gateway; it takes {', '.join(CALLS)}")

    def _command(self, robot: Robot, command: RobotCommand, call_id: str, then: Then) -> None:
        match command:
            case Claim():
                self._replies.give(call_id, *self._claim(robot, command))
            case Home() | MoveAxes():
                others = [other.name for other in self._robots.values() if other.group.setup.motion is not None]
                if others:
                    then(False, f"{others[0]} is being set up; one robot at a time")
                else:
                    robot.set_up(command, self._now, then)
            case HoldSetup():
                text, data = robot.hold(self._now)
                self._replies.give(call_id, True, text, data=data)
            case _:
                robot.obey(command, self._now, then)

    def _claim(self, robot: Robot, command: Claim) -> tuple[bool, str, ClaimGrant | None]:
        if command.digest != self._digest:
            text = (
                f"robot {robot.name}: the agent's configuration is {command.digest}, this gateway's is {self._digest}; "
                "start both with the same cell file"
            )
            return False, text, None
        if self._closing_since is not None:
            return False, f"gateway {self._settings.name} is being stopped", None
        return robot.claim(command, self._now, self._tick)

    def _scanned(self, strange: dict[int, int]) -> str:
        lines = {number: node.said() for number, node in self._nodes.items()}
        lines |= {
            number: f"node {number}: not in the drives file, device type {device_type:08X}h"
            for number, device_type in strange.items()
        }
        return "\n".join(lines[number] for number in sorted(lines))

    # State

    def _stop_order(self) -> StopOrder | None:
        delay_s = self._times.estop_delay_s
        estop = self._estop.active
        if estop is not None and self._estop.since is not None:
            reason = f"emergency stop {estop.id} by {estop.by} is active; reset it at the manager"
            return StopOrder(self._estop.since + delay_s, reason)
        if self._closing_since is not None:
            return StopOrder(self._closing_since + delay_s, f"gateway {self._settings.name} is being stopped")
        return None

    def _confirm(self) -> None:
        estop = self._estop.active
        if estop is None or not all(robot.group.secured for robot in self._robots.values()):
            self._confirmed = None
        elif self._confirmed != estop.id:
            self._confirmed = estop.id
            self._state_due = self._now
            self._log.info("estop_confirmed", f"emergency stop {estop.id}: all robots measured at rest and off")

    def _all_off(self) -> bool:
        return all(robot.group.idle for robot in self._robots.values())

    def _state(self) -> GatewayState:
        self._sequence += 1
        nodes = tuple(node.describe() for node in self._nodes.values())
        return GatewayState(
            gateway=self._settings.name,
            boot=self._boot,
            sequence=self._sequence,
            cycle_s=self._settings.cycle_s,
            interface=self._settings.bus.interface,
            ready=all(node.operational for node in self._nodes.values()),
            problem="; ".join(node.problem for node in self._nodes.values() if node.problem),
            owners={name: robot.claims.boot for name, robot in self._robots.items() if robot.claims.owner},
            estop_confirmed=self._confirmed,
            nodes=nodes,
            counters=self._counters(),
        )

    def _counters(self) -> BusCounters:
        playouts = [robot.group.playout for robot in self._robots.values()]
        return BusCounters(
            ticks=self._tick,
            late_cycles=self._lateness.late_cycles,
            worst_lateness_s=self._lateness.worst_s,
            missing_tpdos=sum(node.missing_tpdos for node in self._nodes.values()),
            blocks_accepted=sum(playout.accepted for playout in playouts),
            blocks_refused=sum(playout.refused for playout in playouts),
            bus_load=self._bus_load,
        )
