"""One drive node as the gateway watches it: what it last said, whether it says it in time, and how it is commanded."""

from cell.core import Effect
from cell.messages.drives import AxisStatus
from cell.messages.gateway_state import NodeStatus
from drive_gateway.canopen.cob_id import RPDO1
from drive_gateway.canopen.emcy import NO_ERROR, Emergency, decode_emergency
from drive_gateway.canopen.frame import CanFrame
from drive_gateway.canopen.nmt import NmtState, decode_heartbeat
from drive_gateway.canopen.pdo_map import RPDO1_LAYOUT, TPDO1_LAYOUT
from drive_gateway.canopen.sdo import SdoChannel
from drive_gateway.cia402.state_machine import decode
from drive_gateway.config.settings import AxisSettings, GatewaySettings
from drive_gateway.gateway.bring_up import BringUp, Phase
from drive_gateway.gateway.effects import Frame
from drive_gateway.gateway.guarding import Guarding
from drive_gateway.gateway.trouble import Trouble

_WITHOUT_TORQUE = {
    AxisStatus.NOT_READY_TO_SWITCH_ON,
    AxisStatus.SWITCH_ON_DISABLED,
    AxisStatus.READY_TO_SWITCH_ON,
    AxisStatus.FAULT,
}


class Node:
    """Bring-up and supervision of one node. Troubles are kept until the robot takes them with `check`."""

    def __init__(self, robot: str, axis: AxisSettings, settings: GatewaySettings) -> None:
        self.axis = axis
        self.label = f"node {axis.node_id} ({robot} {axis.name})"
        self.sdo = SdoChannel(axis.node_id)
        self.counts: int | None = None
        self.counts_per_cycle = 0.0
        self.statusword = 0
        self.referenced = not axis.incremental
        """The drive knows where its axis is; an incremental encoder forgets it with every start of its node."""
        self.emergency: Emergency | None = None
        self.missing_tpdos = 0
        self.told_problem = ""
        self._robot = robot
        self._settings = settings
        self._bring_up = BringUp(self.label, axis, settings, self.sdo)
        self._guarding = Guarding(axis.node_id, settings.heartbeat_producer_s) if axis.guarded else None
        self._nmt: NmtState | None = None
        self._status = AxisStatus.SILENT
        self._tpdo_tick = -1
        self._tpdo_at = 0.0
        self._heartbeat_at = 0.0
        self._lost = False
        self._troubles: list[Trouble] = []

    @property
    def kept(self) -> frozenset[tuple[int, int]]:
        """Objects whose values are the drives file's: index and sub-index."""
        return self._bring_up.kept

    @property
    def operational(self) -> bool:
        return self._bring_up.phase is Phase.OPERATIONAL and not self._lost

    @property
    def lost(self) -> bool:
        """It was operational and is not any more; the robot decides when it may be brought up again."""
        return self._lost

    @property
    def problem(self) -> str:
        """Why it is not operational, for people; empty when it is or when its first attempt goes on."""
        return f"{self.label} was lost" if self._lost else self._bring_up.problem

    @property
    def status(self) -> AxisStatus:
        return self._status if self.operational else AxisStatus.SILENT

    @property
    def without_torque(self) -> bool:
        """The drive itself says that its power stage is off."""
        return self.status in _WITHOUT_TORQUE

    def describe(self) -> NodeStatus:
        nmt = "unknown" if self._nmt is None else self._nmt.name.lower()
        code = None if self.emergency is None else self.emergency.code
        text = "" if self.emergency is None else self.emergency.meaning
        return NodeStatus(self.axis.node_id, self._robot, self.axis.name, nmt, self.status, code, text, self.referenced)

    def said(self) -> str:
        """Its state in a few words, for the answer to a call."""
        if not self.operational:
            return f"{self.label}: {self.problem or self._bring_up.phase.value}"
        emergency = "" if self.emergency is None else f", {self.emergency.code:04X}h {self.emergency.meaning}"
        return f"{self.label}: {self.status.name}{emergency}"

    # What the node sends

    def on_tpdo(self, data: bytes, tick: int, now: float) -> None:
        """Statusword and position, measured at the SYNC numbered `tick`."""
        if len(data) != TPDO1_LAYOUT.size:
            return
        statusword, counts = TPDO1_LAYOUT.unpack(data)
        status = decode(statusword)
        if status is None:
            return
        if self.counts is not None and tick > self._tpdo_tick:
            self.counts_per_cycle = (counts - self.counts) / (tick - self._tpdo_tick)
        self._status = status
        self.statusword = statusword
        self.counts = counts
        self._tpdo_tick = tick
        self._tpdo_at = now

    def on_error_control(self, data: bytes, now: float) -> None:
        """Boot-up or heartbeat."""
        state = decode_heartbeat(data)
        if state is None:
            return
        self._nmt = state
        if state is NmtState.BOOT_UP:
            self._bring_up.booted()
        elif self._guarding is not None and not self._guarding.answered(data[0]):
            # A wrong toggle bit: an answer was lost, or it is an old one; it does not count as a sign of life.
            return
        self._heartbeat_at = now
        if not self.operational or state is NmtState.OPERATIONAL:
            return
        if state is NmtState.BOOT_UP:
            self._lose("unexpected_boot", "restarted by itself and lost its configuration", "check its supply")
        else:
            text = f"left Operational, its heartbeat says {state.name}"
            self._lose("left_operational", text, "look for a second master on the bus")

    def on_emergency(self, data: bytes) -> None:
        emergency = decode_emergency(data)
        if emergency is None:
            return
        if emergency.code == NO_ERROR:
            self.emergency = None
            return
        self.emergency = emergency
        if self.operational:
            text = f"{self.label} reports {emergency.code:04X}h: {emergency.meaning}"
            self._troubles.append(Trouble("emergency", text, emergency.remedy, self.axis.node_id, emergency.code))

    # What the gateway does

    def step(self, now: float, tick: int) -> list[Effect]:
        """Bring-up, supervision and the next SDO; `tick` is the SYNC whose answers should have come."""
        effects: list[Effect] = []
        if self.operational:
            self._watch(now, tick)
        elif not self._lost:
            before = self._bring_up.phase
            effects = self._bring_up.step(now, self._nmt, self._tpdo_tick >= 0)
            if self._bring_up.phase is Phase.OPERATIONAL:
                self._heartbeat_at = self._tpdo_at = now
            elif self._bring_up.phase is Phase.RESETTING and before is Phase.WAITING:
                self._forget()
        guard = self._guarding.poll(now) if self._guarding is not None and self._watched else None
        if guard is not None:
            effects = [*effects, Frame(guard)]
        request = self.sdo.poll()
        return effects if request is None else [*effects, request]

    def check(self) -> list[Trouble]:
        """The troubles since the last check, oldest first."""
        troubles, self._troubles = self._troubles, []
        return troubles

    def bring_up_again(self, now: float) -> None:
        """Start over after a loss."""
        self._lost = False
        self._bring_up.restart(now)

    def rpdo(self, controlword: int, counts: int) -> CanFrame:
        return CanFrame(RPDO1 + self.axis.node_id, RPDO1_LAYOUT.pack(controlword, counts))

    @property
    def _watched(self) -> bool:
        """Its guarding is configured."""
        return self._bring_up.phase in (Phase.STARTING, Phase.OPERATIONAL)

    def _forget(self) -> None:
        """What was known before a reset says nothing about the node after it."""
        if self._guarding is not None:
            self._guarding.restart()
        self._nmt = None
        self._tpdo_tick = -1
        self.counts_per_cycle = 0.0
        self.statusword = 0
        self.referenced = not self.axis.incremental
        self.emergency = None

    def _watch(self, now: float, tick: int) -> None:
        if self._tpdo_tick < tick:
            self.missing_tpdos += 1
        silent_s = now - self._tpdo_at
        if silent_s > self._settings.tpdo_timeout_s:
            self._lose("tpdo_silent", f"sent no TPDO for {silent_s:.3f} s", "check power and wiring")
            return
        silent_s = now - self._heartbeat_at
        if silent_s > self._settings.heartbeat_timeout_s:
            silence = "sent no heartbeat" if self._guarding is None else "did not answer its guarding"
            self._lose("heartbeat_lost", f"{silence} for {silent_s:.3f} s", "check power and wiring")

    def _lose(self, code: str, what: str, remedy: str) -> None:
        self._lost = True
        self.sdo.forget()
        self._troubles.append(Trouble(code, f"{self.label} {what}", remedy, self.axis.node_id))
