"""The gateway's core: one CAN bus, its drives and I/O nodes, and the robots they belong to.

Order of a cycle: the TPDOs that answer the SYNC before, SYNC, then the RPDOs for the next one. A sample that is sent in
the cycle of SYNC `tick` acts at SYNC `tick + 1`. Blocks are taken last, right before the RPDOs are made: one that has
come by then may begin with tick `tick + 1`.
"""

from collections.abc import Iterator, Mapping

from cell.config.settings import Times
from cell.core import Arrived, Effect, Ended, Frozen, Publish, Request, Shutdown
from cell.messages.estop import Estop
from cell.messages.gateway_state import BusCounters, GatewayState
from cell.messages.manager_state import ManagerState
from cell.messages.setpoints import SetpointBlock
from cell.net.estops import ObeyedEstops
from cell.net.freshness import Sent
from drive_gateway.canopen import cob_id
from drive_gateway.canopen.frame import CanFrame
from drive_gateway.canopen.nmt import NmtCommand, NmtState, heartbeat_frame, nmt_frame, sync_frames
from drive_gateway.canopen.sdo import SdoDone
from drive_gateway.config.settings import GatewaySettings
from drive_gateway.gateway.bus.bus_news import BusBack, BusDisturbed, BusFailed, BusTraffic, SecondMaster
from drive_gateway.gateway.cycle.bus_watch import BusWatch
from drive_gateway.gateway.cycle.gauge_round import GaugeRound
from drive_gateway.gateway.cycle.io_watch import IoWatch
from drive_gateway.gateway.cycle.lateness import Lateness
from drive_gateway.gateway.cycle.phase_lock import PhaseLock
from drive_gateway.gateway.drives.drive import Drive
from drive_gateway.gateway.effects import DrivesSlow, Frame, RecordEnded, RecordSaid, TakeBlocks
from drive_gateway.gateway.event_log import EventLog
from drive_gateway.gateway.io.io_node import IoNode
from drive_gateway.gateway.nodes.scan import Scan
from drive_gateway.gateway.orders.calls import GatewayCalls
from drive_gateway.gateway.orders.setup_turn import SetupTurn
from drive_gateway.gateway.reference.encoder_record import EncoderRecord
from drive_gateway.gateway.robots.permits import StopOrder
from drive_gateway.gateway.robots.robot import Robot
from drive_gateway.gateway.trouble import Trouble
from drive_gateway.gateway.watch.estop_button import EstopButtons

STATE_PERIOD_S = 0.2
SETUP_PERIOD_S = 0.02
"""While a robot is set up, or is to be: the manager and the operator who holds it rely on the newest state."""
PART_S = 1.0
"""So long a gateway that ends waits until its nodes have stopped watching it."""
_TAKE_BLOCKS = TakeBlocks()


class GatewayCore:
    """See `cell.core.Core`; `step` is called once per bus cycle.

    Args:
        settings: the bus and its drives.
        times: the cell's deadlines.
        boot: this process' boot.
        digest: of the configuration; a claim with another one is refused.
        first_owner: number of the first claim, larger than any that was ever given on this bus (unix milliseconds).
        process: what `who` tells besides role, name and boot, for people.
        stored: where axes with absolute encoders stood when they were last off, by robot.axis.

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
        stored: Mapping[str, EncoderRecord] | None = None,
    ) -> None:
        self._settings = settings
        self._times = times
        self._boot = boot
        self._first_owner = first_owner
        self._log = EventLog(settings.name, boot)
        self._io_nodes = {io.name: IoNode(io, settings) for io in settings.io_nodes}
        self._robots = {
            name: Robot(drives, settings, times, boot, first_owner, self._log, stored or {}, self._io_nodes)
            for name, drives in settings.robots.items()
        }
        self._drives = [drive for robot in self._robots.values() for drive in robot.group.nodes]
        self._nodes = {drive.node.id: drive.node for drive in self._drives}
        self._nodes |= {io.node.id: io.node for io in self._io_nodes.values()}
        self._by_status: dict[int, Drive] = {drive.image.status.cob_id: drive for drive in self._drives}
        told: list[Drive | IoNode] = [*self._drives, *self._io_nodes.values()]
        self._by_inputs = {each.image.inputs.cob_id: each for each in told if each.image.inputs is not None}
        self._io_watch = IoWatch(self._io_nodes.values(), self._robots.values(), self._log)
        self._only_told = frozenset(io.node.id for io in self._io_nodes.values() if not io.io.stops)
        """I/O nodes without which everything goes on."""
        self._scan = Scan(self._nodes)
        self._syncs = [Frame(frame) for frame in sync_frames(settings.sync_counter)]
        self._heartbeat = Frame(heartbeat_frame(NmtState.OPERATIONAL, settings.node_id))
        self._digest = digest
        self._states = Sent(boot)
        self._turn = SetupTurn(settings.name, digest, self._robots, times, self._states)
        seen = self._turn, self._states, times.command_s, STATE_PERIOD_S
        self._calls = GatewayCalls(
            settings.name, boot, digest, process, self._robots, self._io_nodes, self._scan, *seen, self._log
        )
        self._estops = ObeyedEstops(boot)
        self._estop_since: float | None = None
        """When the first of the stops in force was received; the gateway's own timer runs from here."""
        self._buttons = EstopButtons(settings.name, boot)
        self._lateness = Lateness(settings.cycle_s)
        self._phase = PhaseLock(settings.cycle_s)
        self.trim_s = 0.0
        """The next cycle is to begin so much later than a cycle after this one."""
        self._now = 0.0
        self._tick = 0
        self._sequence = 0
        self._state_due = 0.0
        self._heartbeat_due = 0.0
        self._named: tuple[str, ...] = ()
        self._inputs: dict[str, dict[str, bool | None]] = {}
        """As they were told."""
        self._quiet_until = 0.0
        """So long inputs that bounce lead to no other state."""
        self._confirmed: str | None = None
        self._closing_since: float | None = None
        self._parting_since: float | None = None
        self._gauges = GaugeRound((robot.group for robot in self._robots.values()), settings)
        self._bus = BusWatch(settings, self._robots.values(), self._nodes.values(), self._log)

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
                self._calls.request(message, now, self._tick)
            case BusTraffic() | BusFailed() | BusBack() | BusDisturbed() | SecondMaster():
                self._bus.take(message, now)
            case Arrived(ManagerState() as state, at):
                echo = state.heard_gateways.get(self._settings.name)
                self._phase.heard(state, at, self._states.age(echo, at))
                self._turn.heard(state, at)
                self._estops.answered(state, echo)
                for estop in state.estops:
                    self._on_estop(estop, now)
                if any(self._inputs.values()):  # programs rest until inputs are told anew
                    self._state_due = min(self._state_due, max(now, self._quiet_until))
            case Frozen():
                self._states.forget()
                for each in self._robots.values():
                    each.feedbacks.forget()
            case RecordSaid():
                self._calls.recorded(message)
            case RecordEnded(text):
                self._log.info("recorded", text)
            case DrivesSlow(text, remedy):
                self._log.warn("simulation_slow", text, remedy)
            case Shutdown():
                self._on_shutdown(now)

    def step(self, now: float) -> Iterator[Effect]:
        """One cycle. The effects come one by one: SYNC leaves before anything is computed."""
        self._now = now
        self._tick += 1
        yield self._syncs[(self._tick - 1) % len(self._syncs)]
        lateness = self._lateness.cycle(now)
        if lateness > self._settings.overrun_limit_s:
            self._on_overrun(lateness, now)
        self._turn.step(now)
        order = self._stop_order()
        after = self._io_watch.observe(now, self._tick)
        for robot in self._robots.values():
            after += robot.observe(now, self._tick, order)
        yield _TAKE_BLOCKS
        for robot in self._robots.values():
            yield from robot.command(now, self._tick)
        yield from self._io_watch.command(now)
        yield from self._gauges.step(now, after)
        yield from after
        if now >= self._heartbeat_due:
            # From the cycle and from nothing else: when the loop hangs, the drives must miss it.
            self._heartbeat_due = now + self._settings.heartbeat_producer_s
            yield self._heartbeat
        yield from self._scan.step(now)
        yield from self._press(now)
        self._confirm()
        yield from self._log.take(now)
        yield from self._calls.take(now)
        yield from self._tell(now)
        self.trim_s = self._phase.trim(now)
        if self._closing_since is not None and self._all_off() and self._parted(now):
            for number in self._nodes:
                yield Frame(nmt_frame(NmtCommand.ENTER_PRE_OPERATIONAL, number))
            yield Ended()

    @property
    def setting_up(self) -> bool:
        """The manager's word is needed as soon as it comes."""
        return bool(self._named)

    @property
    def stopped(self) -> bool:
        """An emergency stop is in force, and the manager's word would end it."""
        return bool(self._estops.in_force)

    # Messages

    def _on_frame(self, frame: CanFrame, now: float) -> None:
        if frame.remote:
            return
        drive = self._by_status.get(frame.id)
        if drive is not None:
            drive.on_tpdo(frame.data, self._tick, now)
            return
        inputs = self._by_inputs.get(frame.id)
        if inputs is not None:
            inputs.on_inputs(frame.data, now)
            return
        node = self._nodes.get(cob_id.node_id(frame.id))
        if node is None and cob_id.function_code(frame.id) == cob_id.SDO_FROM_NODE:
            self._scan.take(cob_id.node_id(frame.id), frame.data)
        if node is None:
            return
        match cob_id.function_code(frame.id):
            case cob_id.ERROR_CONTROL:
                node.on_error_control(frame.data, now)
            case cob_id.EMCY:
                node.on_emergency(frame.data)
            case cob_id.SDO_FROM_NODE:
                self._gauges.take(node.id, frame.data, now)

    def _on_estop(self, estop: Estop, now: float) -> None:
        if not self._estops.hear(estop):
            return
        if not self._estops.in_force:
            self._estop_since = None
        elif self._estop_since is None:
            self._estop_since = now
        self._state_due = now
        if estop.active:
            self._log.warn("estop", f"emergency stop {estop.id} by {estop.by}: {estop.reason}", "reset at the manager")
        else:
            self._buttons.cleared(estop.id)
            self._log.info("estop_cleared", f"emergency stop {estop.id} is over here")
        self._confirmed = None

    def _press(self, now: float) -> list[Effect]:
        """Buttons at the drives stop the whole cell, this gateway first."""
        pressed = [robot.group.permits.estop_pressed for robot in self._robots.values()]
        estop = self._buttons.step("; ".join(text for text in pressed if text), now)
        if estop is None:
            return []
        self._on_estop(estop, now)
        return [Publish(estop)]

    def _on_shutdown(self, now: float) -> None:
        if self._closing_since is None:
            self._closing_since = now
            self._calls.closing = True
            self._log.info("closing", "the gateway comes to rest and switches its drives off")
            for robot in self._robots.values():
                robot.group.playout.closing = True

    def _on_overrun(self, lateness: float, now: float) -> None:
        limit = self._settings.overrun_limit_s
        text = f"bus cycle {lateness:.3f} s late, allowed {limit} s"
        for robot in self._robots.values():
            if robot.group.playout.live or robot.group.setup.motion is not None:
                robot.group.fault(Trouble("late_cycle", text, "take load off this host"), now)

    # State

    def _stop_order(self) -> StopOrder | None:
        delay_s = self._times.estop_delay_s
        estop = self._estops.first
        if estop is not None and self._estop_since is not None:
            reason = f"emergency stop {estop.id} by {estop.by} is active; reset it at the manager"
            return StopOrder(self._estop_since + delay_s, reason)
        if self._closing_since is not None:
            return StopOrder(self._closing_since + delay_s, f"gateway {self._settings.name} is being stopped")
        return None

    def _confirm(self) -> None:
        estop = self._estops.first
        if estop is None or not all(robot.group.standstill.secured for robot in self._robots.values()):
            self._confirmed = None
        elif self._confirmed != estop.id:
            self._confirmed = estop.id
            self._state_due = self._now
            self._log.info("estop_confirmed", f"emergency stop {estop.id}: all robots measured at rest and off")

    def _all_off(self) -> bool:
        return all(robot.group.standstill.idle for robot in self._robots.values())

    def _parted(self, now: float) -> bool:
        """No node misses the gateway that ends; one that does not answer is not waited for."""
        if self._parting_since is None:
            self._parting_since = now
            for node in self._nodes.values():
                node.part()
        late = now - self._parting_since > PART_S
        return late or all(node.parted or not node.operational for node in self._nodes.values())

    def _tell(self, now: float) -> Iterator[Effect]:
        """The state, when it is due, another robot is to be set up, or a named input changes."""
        names = self._turn.names()
        inputs = {name: robot.group.inputs.values(now) for name, robot in self._robots.items()}
        changed = inputs != self._inputs and now >= self._quiet_until
        if now >= self._state_due or names != self._named or changed:
            self._named, self._inputs = names, inputs
            self._quiet_until = now + SETUP_PERIOD_S
            self._state_due = now + (SETUP_PERIOD_S if names else STATE_PERIOD_S)
            yield Publish(self._state())

    def _state(self) -> GatewayState:
        self._sequence += 1
        self._states.record(self._sequence, self._now)
        self._turn.named(self._sequence)
        estop = self._estops.first
        if estop is not None:
            self._estops.named(estop.id, self._sequence)
        nodes = tuple(drive.describe(self._now) for drive in self._drives)
        modes = [robot.group.setup.problem for robot in self._robots.values()]
        units = [robot.group.permits.wrong_units() for robot in self._robots.values()]
        needed = [node for number, node in self._nodes.items() if number not in self._only_told]
        found = (*(node.problem for node in needed), *modes, *units)
        problems = [problem for problem in found if problem]
        problem = self._bus.problem or "; ".join(problems)
        return GatewayState(
            gateway=self._settings.name,
            boot=self._boot,
            sequence=self._sequence,
            cycle_s=self._settings.cycle_s,
            interface=self._settings.bus.interface,
            ready=self._ready and not problem,
            problem=problem,
            owners={name: robot.claims.boot for name, robot in self._robots.items() if robot.claims.owner},
            estop_confirmed=self._confirmed,
            nodes=nodes,
            counters=self._counters(),
            setup=self._named,
            heard=self._turn.echo,
            digest=self._digest,
            era=self._first_owner,
            io_nodes=tuple(io.describe() for io in self._io_nodes.values()),
            inputs={robot: named for robot, named in self._inputs.items() if named},
            forced={
                name: {output: by for output, (_, by) in robot.group.outputs.forced.items()}
                for name, robot in self._robots.items()
                if robot.group.outputs.forced
            },
            estop=estop.id if estop is not None else None,
            clock=self._phase.clock.status(self._now),
        )

    @property
    def _ready(self) -> bool:
        drives = all(drive.operational and drive.reference.judged and drive.shown_units.read for drive in self._drives)
        return drives and all(io.operational or not io.io.stops for io in self._io_nodes.values())

    def _counters(self) -> BusCounters:
        playouts = [robot.group.playout for robot in self._robots.values()]
        return BusCounters(
            ticks=self._tick,
            late_cycles=self._lateness.late_cycles,
            worst_lateness_s=self._lateness.worst_s,
            missing_tpdos=sum(drive.missing_tpdos for drive in self._drives),
            blocks_accepted=sum(playout.accepted for playout in playouts),
            blocks_refused=sum(playout.refused for playout in playouts),
            bus_load=self._bus.planned,
            measured_load=self._bus.load.share,
            phase_error_s=self._phase.error_s,
        )
