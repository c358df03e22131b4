"""One axis and its drive as the gateway sees it: what it last said, and how it is commanded. Its node is a `Node`."""

from collections.abc import Sequence

from cell.messages.drives import AxisStatus
from cell.messages.gateway_state import NodeStatus
from drive_gateway.canopen.axis_objects import index_of
from drive_gateway.canopen.drive_objects import (
    CONTROLWORD,
    DIGITAL_OUTPUTS,
    ERROR_CODE,
    TARGET_POSITION,
    TARGET_VELOCITY,
)
from drive_gateway.canopen.emcy import Emergency
from drive_gateway.canopen.frame import CanFrame
from drive_gateway.canopen.pdo_map import INPUTS
from drive_gateway.canopen.profile_pdos import ProfileSender
from drive_gateway.canopen.sdo import Dialogue, SdoRead
from drive_gateway.cia402.state_machine import FAULT_RESET, QUICK_STOP, REMOTE, WARNING, controlword, decode
from drive_gateway.config.image import INPUTS_EVERY, image_of
from drive_gateway.config.settings import AxisSettings, GatewaySettings
from drive_gateway.gateway.drives.gauge import Gauge
from drive_gateway.gateway.drives.rest import AxisRest
from drive_gateway.gateway.drives.shown_units import ShownUnits
from drive_gateway.gateway.nodes.node import Node
from drive_gateway.gateway.nodes.program import drive_program
from drive_gateway.gateway.playout.outputs import Outputs
from drive_gateway.gateway.reference.reference import Reference

_WITHOUT_TORQUE = {
    AxisStatus.NOT_READY_TO_SWITCH_ON,
    AxisStatus.SWITCH_ON_DISABLED,
    AxisStatus.READY_TO_SWITCH_ON,
    AxisStatus.FAULT,
}
_REACTING = (AxisStatus.FAULT_REACTION_ACTIVE, AxisStatus.FAULT)
MASKED_FAULT_S = 1.0
"""A drive that shows the reaction to a fault and stands for this long is in the fault: transition 14 goes by itself."""


class Drive:
    """One axis of `node`; what befalls the node befalls all its drives."""

    def __init__(
        self,
        robot: str,
        axis: AxisSettings,
        settings: GatewaySettings,
        node: Node,
        reference: Reference,
        outputs: Outputs,
    ) -> None:
        self.axis = axis
        self.node = node
        place = f"node {axis.node_id}" if axis.number == 1 else f"node {axis.node_id} axis {axis.number}"
        self.label = f"{place} ({robot} {axis.name})"
        self.operational = False
        """Its node is."""
        self.status = AxisStatus.SILENT
        """As its statusword tells while its node is operational."""
        self.image = image_of(axis)
        self._layout = self.image.status_layout
        self.counts: int | None = None
        """Of an endless axis: turns are counted on from where it was first seen."""
        self.counts_per_cycle = 0.0
        self.statusword = 0
        self.per_mille: int | None = None
        """Of its motor's rated torque: what it gives. `None`: it does not tell."""
        self.reference = reference
        self.rest = AxisRest(axis, settings)
        self.shown_units = ShownUnits(self.label, axis.units)
        self.gauge = Gauge(axis)
        self.missing_tpdos = 0
        self.tried = False
        """Since its start it has been seen to move as fast as it was told, and that way round."""
        self.found_with_torque = False
        """Its first statusword said so: an earlier gateway ended without switching it off. Nobody has been told yet."""
        self.largest_error: float | None = None
        """[rad or m] following error since it was enabled, where it has been."""
        self.strange = ""
        """What was wrong with its newest TPDO, for people; empty when nothing was."""
        self.robot = robot
        self._told = QUICK_STOP
        """Its newest controlword."""
        self._settings = settings
        self._outputs = outputs
        self._endless = axis.modulus > 0
        self._profile = ProfileSender(self.image.profile) if self.image.profile else None
        self._heard = AxisStatus.SILENT
        self._heard_since = 0.0
        self._tpdo_tick = -1
        self._tpdo_at = 0.0
        self._inputs: int | None = None
        self._inputs_at = 0.0
        self._asked = False
        """Which error it has is being read."""
        node.attach(self)

    @property
    def emergency(self) -> Emergency | None:
        """The newest one that is its own."""
        return self.node.emergency_of(self.label)

    @property
    def addressed(self) -> bool:
        """It gets process data: it is operational, or was and may still hear them."""
        return self.operational or self.node.lost

    @property
    def velocity(self) -> float:
        """[rad/s or m/s] between its newest two positions."""
        return self.counts_per_cycle / self._settings.cycle_s / self.axis.counts_per_unit

    @property
    def warns(self) -> bool:
        """It says that something is near a limit of its own, or that it can only go one way."""
        return self.operational and bool(self.statusword & WARNING)

    @property
    def torque(self) -> float | None:
        """[Nm or N] what its motor gives behind its gear; `None`: it does not tell."""
        scale = self.axis.torque
        return None if scale is None or self.per_mille is None else self.per_mille / scale.per_mille

    @property
    def without_torque(self) -> bool:
        """The drive itself says that its power stage is off."""
        return self.status in _WITHOUT_TORQUE

    def describe(self, now: float) -> NodeStatus:
        nmt = "unknown" if self.node.nmt is None else self.node.nmt.words
        code = None if self.emergency is None else self.emergency.code
        text = "" if self.emergency is None else self.emergency.meaning
        missing = self.reference.missing
        return NodeStatus(
            self.axis.node_id, self.robot, self.axis.name, nmt, self.status, code, text, not missing, missing,
            self.warns, self.largest_error, self._outputs.shown(self.axis.name), self.gauge.current(now),
            self.gauge.temperature(now),
        )  # fmt: skip

    def said(self) -> str:
        """Its state in a few words, for the answer to a call."""
        if not self.operational:
            return f"{self.label}: {self.node.problem or self.node.phase.value}"
        emergency = "" if self.emergency is None else f", {self.emergency.code:04X}h {self.emergency.meaning}"
        warning = ", warning" if self.warns else ""
        local = "" if self.statusword & REMOTE else ", under local control (statusword bit 9 is 0)"
        return f"{self.label}: {self.status.words}{warning}{local}{emergency}"

    # What the drive sends

    def on_tpdo(self, data: bytes, tick: int, now: float) -> None:
        """Statusword, position and torque, measured at the SYNC numbered `tick`.

        A frame may be longer than what is mapped, and then its first bytes count (CiA 301, PDO mapping).
        """
        if len(data) < self._layout.size:
            self.strange = f"the newest had {len(data)} bytes instead of {self._layout.size}"
            return
        statusword, counts, *torque = self._layout.unpack_from(data)
        status = decode(statusword)
        if status is None:
            self.strange = f"the newest shows statusword {statusword:04X}h, which is no state of CiA 402"
            return
        self.strange = ""
        if self._endless and self.counts is not None:
            counts = self.axis.nearest(counts, self.counts)
        if self.counts is not None and tick > self._tpdo_tick:
            self.counts_per_cycle = (counts - self.counts) / (tick - self._tpdo_tick)
        if status is not self._heard:
            self._changed(status, now)
        self.statusword = statusword
        self.rest.take(counts, now)
        self.per_mille = torque[0] if torque else None
        self.counts = counts
        self._tpdo_tick = tick
        self._tpdo_at = now

    def _changed(self, status: AxisStatus, now: float) -> None:
        if self._heard is AxisStatus.SILENT:
            self.found_with_torque = status not in _WITHOUT_TORQUE
        self._heard, self._heard_since = status, now
        if self.operational:
            self.status = status

    def on_inputs(self, data: bytes, now: float) -> None:
        """The drive's digital inputs."""
        if len(data) >= INPUTS.size:
            self._inputs, self._inputs_at = INPUTS.unpack_from(data)[0], now

    def digital_inputs(self, now: float) -> int | None:
        """The newest digital inputs; `None` when they are too old to be believed."""
        patience_s = self._settings.tpdo_timeout_s + INPUTS_EVERY * self._settings.cycle_s
        return self._inputs if now - self._inputs_at <= patience_s else None

    def output_object(self, bit: int) -> tuple[int, int, int]:
        """Index and sub-index of the object that shows a digital output, and its bit there."""
        return index_of(DIGITAL_OUTPUTS, self.axis.number), 1, bit

    # What its node tells

    @property
    def measured(self) -> bool:
        """Statusword and position have come since the node's start."""
        return self._tpdo_tick >= 0

    def started(self, now: float) -> None:
        self._tpdo_at = now
        self.operational, self.status = True, self._heard
        self.gauge.restart()
        self.rest.heard()
        self.follow(self.shown_units.dialogue())

    def judge_reaction(self, now: float) -> None:
        """Some drives show one pattern in the reaction and in the fault, and keep bit 4 (see `decode`): time tells."""
        if self.rest.standing and now - self._heard_since >= MASKED_FAULT_S:
            self.status = AxisStatus.FAULT

    def silent_s(self, now: float, tick: int) -> float:
        if self._tpdo_tick < tick:
            self.missing_tpdos += 1
        return now - self._tpdo_at

    def ask_error(self) -> None:
        if not self._asked:
            self._asked = True
            self.follow(self._read_error())

    def _read_error(self) -> Dialogue:
        done = yield SdoRead(ERROR_CODE, 0)
        self._asked = False
        if len(done.data) == 2:
            self.node.axis_error(self.label, int.from_bytes(done.data, "little"))

    def lost(self) -> None:
        self._asked = False
        self.operational, self.status = False, AxisStatus.SILENT
        self.gauge.restart()
        if self.counts is not None:
            self.reference.lost(self.counts, self._way_to_rest(), torque=self._heard not in _WITHOUT_TORQUE)

    def forget(self) -> None:
        self._asked = False
        self.strange = ""
        self._inputs = None
        self._tpdo_tick = -1
        self.counts_per_cycle = 0.0
        self.statusword = 0
        self.tried = False
        self.reference.restarted()

    # What the gateway does

    def stop_by_network(self, now: float) -> None:
        """It does not obey: NMT stop of its node, and no trust in it before it is measured at rest."""
        self.rest.distrust()
        self.node.stop(now, self.rest.silent_stop_s)

    def follow(self, dialogue: Dialogue) -> None:
        """Carry out requests for objects of the profile, their indices as axis 1 has them."""
        self.node.sdo.follow(dialogue, self.axis.number)

    def leading_to(self, target: AxisStatus) -> int:
        """The controlword that takes it one transition nearer to `target`.

        While it brakes in its reaction to a fault it hears the last one again: CiA 402 has no command in that state,
        and a drive that obeys `disable voltage` there would run out. One that never sets bit 4 shows its reaction as
        the fault itself, so an axis in a fault must stand, too.
        """
        if self.status in _REACTING and not self.rest.standing:
            return self._told & ~FAULT_RESET
        return controlword(self.status, target)

    def command(self, controlword: int, counts: int, speed: int = 0, per_mille: int = 0) -> list[CanFrame]:
        """The command of one cycle: target [counts], and what is fed forward of velocity [the drive's unit] and of
        torque [per mille of the rated one]."""
        if self._endless:
            counts = self.axis.wrapped(counts)
        self._told = controlword
        return self.image.frames(controlword, counts, speed, per_mille)

    def press(self, controlword: int, per_mille: int) -> list[CanFrame]:
        """The command of one cycle in mode cyclic torque."""
        self._told = controlword
        return self.image.frames(controlword, self.axis.wrapped(self.counts or 0), target_torque=per_mille)

    def command_own(self, controlword: int, target: int, velocity: int, now: float) -> list[CanFrame]:
        """What commands a motion of the drive's own in this cycle: target [counts] and velocity [the drive's unit]."""
        if self._profile is None:
            return self.command(controlword, target)
        self._told = controlword
        values = {CONTROLWORD: controlword, TARGET_POSITION: self.axis.wrapped(target), TARGET_VELOCITY: velocity}
        return self._profile.frames(values, now)

    @property
    def velocity_by_pdo(self) -> bool:
        """Its target velocity goes by PDO, so nobody writes it by SDO."""
        return self._profile is not None

    def _way_to_rest(self) -> float:
        """[counts] that a silent drive may still go: until it misses its gateway, and then its quick stop."""
        speed = abs(self.counts_per_cycle) / self._settings.cycle_s
        unheard_s = self._settings.heartbeat_timeout_s + self._settings.tpdo_timeout_s
        return speed * unheard_s + speed**2 / (2.0 * self.axis.quick_stop * abs(self.axis.counts_per_unit))


def drives_of(
    robot: str,
    axes: Sequence[AxisSettings],
    settings: GatewaySettings,
    references: Sequence[Reference],
    outputs: Outputs,
) -> list[Drive]:
    """The drives of one robot in the order of `axes`, those with one Node-ID on one node."""
    both = list(zip(axes, references, strict=True))
    nodes: dict[int, Node] = {}
    for number in {axis.node_id for axis in axes}:
        mine = sorted((pair for pair in both if pair[0].node_id == number), key=lambda pair: pair[0].number)
        mine_axes, mine_references = zip(*mine, strict=True)
        label = f"node {number} ({robot} {', '.join(axis.name for axis in mine_axes)})"
        boot = drive_program(mine_axes, settings, mine_references, outputs)
        # Error control and emergencies are the node's and the same in all its axes.
        nodes[number] = Node(number, label, mine_axes[0], settings, boot)
    return [Drive(robot, axis, settings, nodes[axis.node_id], reference, outputs) for axis, reference in both]
