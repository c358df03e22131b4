"""How a node becomes operational: reset, boot-up, identity, configuration read back, start confirmed by heartbeat.

Everything has a deadline; a node that fails is tried again slowly, so a drive that is switched on later joins.
"""

from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from enum import Enum

from cell.core import Effect
from drive_gateway.canopen.axis_objects import first_axis_index, index_of
from drive_gateway.canopen.io_map import DEVICE_PROFILE
from drive_gateway.canopen.nmt import NmtCommand, NmtState, nmt_frame
from drive_gateway.canopen.optional_objects import IO_OPTIONAL_OBJECTS, OPTIONAL_OBJECTS
from drive_gateway.canopen.pdo_map import SdoWrite, unused
from drive_gateway.canopen.sdo import SdoChannel, SdoDone, abort_text
from drive_gateway.cia401.preparation import error_behaviour, io_outputs
from drive_gateway.cia402.preparation import Preparation, digital_outputs, preparations, supervision
from drive_gateway.config.image import image_of, io_image_of
from drive_gateway.config.settings import AxisSettings, GatewaySettings, IdentitySettings, IoSettings, OwnObject
from drive_gateway.gateway.effects import Frame
from drive_gateway.gateway.playout.outputs import Outputs
from drive_gateway.gateway.reference.reference import Reference

RETRY_S = 2.0
"""Pause before a node that failed is tried again."""

IDENTITY = 0x1018
MOTOR_RATED_TORQUE = 0x6076
_ABSENT = (0x06020000, 0x06090011)
"""Abort codes: no such object, no such sub-index."""
_FIXED = (0x06010000, 0x06010002)
"""Abort codes: this access is not supported, the object is read-only."""


_IO_BYTE_S = 0.2
"""Time more for each byte of an I/O node: its mapping, its error behaviour and its outputs."""
_OWN_OBJECT_S = 0.1
"""Time more for each object of the drive's own, written and read back."""


class Phase(Enum):
    WAITING = "waiting for the next attempt"
    RESETTING = "waiting for boot-up"
    CONFIGURING = "being configured"
    STARTING = "being started"
    OPERATIONAL = "operational"


@dataclass(frozen=True, slots=True)
class _Step:
    """One SDO request; `shown` is what a read must return, `None` for anything."""

    what: str
    index: int
    sub: int
    data: bytes | None
    shown: bytes | None = None
    constant: bool = False
    """A node that shows something else is the wrong one."""
    optional: bool = False
    """A node that has no such object needs no such value."""
    waived: bool = False
    """A node without the object is brought up nevertheless, and what that costs is told."""
    fixed: bool = False
    """A node that does not let it be written is taken as it is, if the read that follows shows what is needed."""
    low_half: bool = False
    """Only the first two bytes of what is read count."""
    take: Callable[[bytes], None] | None = None
    """Who wants to know what was read."""


class NodeBoot(ABC):
    """The way of one node to Operational. The node's supervisor feeds it boot-ups, heartbeats and SDO outcomes.

    Args:
        label: of the node, for people.
        node_id: of the node.
        sdo: the node's requests.
        program: what is written and read, but for its outputs.
        timeout_s: for its boot-up and its start.
        configuring_s: for all of `program`.
    """

    kind = "drive"
    """What stands there, for people."""
    optional = OPTIONAL_OBJECTS
    """What it may lack: name and cost by index."""

    def __init__(
        self,
        label: str,
        node_id: int,
        sdo: SdoChannel,
        program: Sequence[_Step],
        timeout_s: float,
        configuring_s: float,
    ) -> None:
        self._label = label
        self._node_id = node_id
        self._sdo = sdo
        self._timeout_s = timeout_s
        self._configuring_s = configuring_s
        self._program = program
        self._steps: deque[_Step] = deque()
        self._deadline = 0.0
        self._now = 0.0
        self._booted = False
        self._found = b""
        self.lacking: list[str] = []
        """What the node was found to lack since this was last emptied, each with what that costs."""
        self.phase = Phase.WAITING
        self.problem = ""
        """Why the newest attempt failed; empty while none has."""

    @property
    def kept(self) -> frozenset[tuple[int, int]]:
        """Index and sub-index of all objects that are written when the node is brought up."""
        steps = [*self._program, *self._output_steps()]
        return frozenset((step.index, step.sub) for step in steps if step.data is not None)

    def restart(self, now: float) -> None:
        """Begin again, at once."""
        self._sdo.forget()
        self.phase = Phase.WAITING
        self._deadline = now

    def booted(self) -> None:
        """The node sent its boot-up; a second one while it is configured: the first was that of its power-on."""
        self._booted = True
        if self.phase is Phase.CONFIGURING:
            self._sdo.forget()
            self._configure()

    def step(self, now: float, nmt: NmtState | None, measured: bool) -> list[Effect]:
        """Do what is due; `nmt` and `measured` are the node's newest heartbeat and whether its TPDO has come."""
        self._now = now
        match self.phase:
            case Phase.WAITING if now >= self._deadline:
                self._booted = False
                self._enter(Phase.RESETTING)
                return [Frame(nmt_frame(NmtCommand.RESET_COMMUNICATION, self._node_id))]
            case Phase.RESETTING if self._booted:
                self._enter(Phase.CONFIGURING)
                self._configure()
            case Phase.CONFIGURING if not self._steps:
                self._enter(Phase.STARTING)
                return [Frame(nmt_frame(NmtCommand.START, self._node_id))]
            case Phase.STARTING if nmt is NmtState.OPERATIONAL and measured:
                self.phase = Phase.OPERATIONAL
                self.problem = ""
            case Phase.RESETTING | Phase.CONFIGURING | Phase.STARTING if now > self._deadline:
                self._fail(self._late(nmt))
        return []

    def _enter(self, phase: Phase) -> None:
        self.phase = phase
        self._deadline = self._now + (self._configuring_s if phase is Phase.CONFIGURING else self._timeout_s)

    def _late(self, nmt: NmtState | None) -> str:
        if self.phase is Phase.RESETTING:
            return (
                f"{self._label} did not answer within {self._timeout_s} s after NMT reset: "
                "check power, wiring, bit rate and Node-ID"
            )
        if self.phase is Phase.CONFIGURING:
            step = self._steps[0]
            found = f", found {_number(self._found)}" if step.shown is not None and self._found else ""
            return f"{self._label} was not configured within {self._configuring_s} s, last at {_where(step)}{found}"
        heard = "no heartbeat" if nmt is None else f"heartbeat says {nmt.words}"
        return f"{self._label} did not start within {self._timeout_s} s: {heard}; check heartbeat (1017h) and TPDO1"

    def _fail(self, problem: str) -> None:
        self._sdo.forget()
        self.phase = Phase.WAITING
        self.problem = problem
        self._deadline = self._now + RETRY_S

    def _configure(self) -> None:
        self._steps = deque([*self._program, *self._output_steps()])
        self._ask()

    @abstractmethod
    def _output_steps(self) -> list[_Step]:
        """An output that keeps its state at a stop keeps it when its node comes back, too."""

    def _ask(self) -> None:
        step = self._steps[0]
        self._found = b""
        self._sdo.submit(step.index, step.sub, step.data, self._answered)

    def _answered(self, outcome: SdoDone) -> None:
        step = self._steps[0]
        if step.waived and outcome.abort_code in _ABSENT:
            self._go_without(step)
            return
        if step.fixed and outcome.abort_code in _FIXED:
            self._keep_as_it_is()
            return
        if outcome.problem and not (step.optional and outcome.abort_code in _ABSENT):
            reason = outcome.problem if outcome.abort_code is None else abort_text(outcome.abort_code)
            self._fail(f"{self._label} refused {_where(step)}: {reason}")
            return
        if step.low_half:
            outcome = replace(outcome, data=outcome.data[:2])
        if step.constant and step.shown is not None and not _equal(outcome.data, step.shown):
            self._fail(
                f"{self._label} is another {self.kind}: {step.what} ({step.index:04X}h:{step.sub:02X}) is "
                f"{_constant(step, outcome.data)}, the drives file says {_constant(step, step.shown)}; "
                "connect the right one, or correct the file"
            )
            return
        if step.shown is not None and not _equal(outcome.data, step.shown):
            # A drive may need a moment until it shows what was set; the deadline of the phase bounds the repeats.
            self._ask()
            self._found = outcome.data
            return
        if step.take is not None:
            step.take(outcome.data)
        self._steps.popleft()
        self._go_on()

    def _go_on(self) -> None:
        if self._steps:
            self._ask()

    def _keep_as_it_is(self) -> None:
        """The node does not let it be written; the read that follows judges what it has."""
        self._steps.popleft()
        self._go_on()

    def _go_without(self, step: _Step) -> None:
        """Neither this object nor its other parts are asked for again."""
        while self._steps and self._steps[0].index == step.index:
            self._steps.popleft()
        name, cost = self.optional[first_axis_index(step.index)]
        self.lacking.append(f"{self._label} has no {step.index:04X}h ({name}), which the drives file waives: {cost}")
        self._go_on()


class BringUp(NodeBoot):
    """That of a node with one to three drives."""

    def __init__(
        self,
        label: str,
        axes: Sequence[AxisSettings],
        settings: GatewaySettings,
        sdo: SdoChannel,
        references: Sequence[Reference],
        outputs: Outputs,
    ) -> None:
        own = sum(len(axis.objects) for axis in axes)
        configuring_s = settings.boot_timeout_s * len(axes) + _OWN_OBJECT_S * own
        program = _program(axes, settings, references)
        super().__init__(label, axes[0].node_id, sdo, program, settings.boot_timeout_s, configuring_s)
        self._axes = tuple(axes)
        self._outputs = outputs

    def _output_steps(self) -> list[_Step]:
        return [step for axis in self._axes for step in _written(digital_outputs(axis, self._outputs.word(axis.name)))]


class IoBringUp(NodeBoot):
    """That of an I/O node; `word` answers what its outputs are to be."""

    kind = "device"
    optional = IO_OPTIONAL_OBJECTS

    def __init__(
        self, label: str, io: IoSettings, settings: GatewaySettings, sdo: SdoChannel, word: Callable[[], int]
    ) -> None:
        program = _io_program(io, settings)
        configuring_s = settings.boot_timeout_s + _IO_BYTE_S * (io.input_bytes + io.output_bytes)
        super().__init__(label, io.node_id, sdo, program, settings.boot_timeout_s, configuring_s)
        self._io = io
        self._word = word

    def _output_steps(self) -> list[_Step]:
        return _written(io_outputs(self._io, self._word()))


def _where(step: _Step) -> str:
    kind = "read of" if step.data is None else "write of"
    expected = "" if step.shown is None else f", expected {_number(step.shown)}"
    return f"{kind} {step.index:04X}h:{step.sub:02X} ({step.what}{expected})"


def _constant(step: _Step, data: bytes) -> str:
    """Identities are written in hex everywhere, quantities are not."""
    return f"{_number(data):X}h" if step.index == IDENTITY else f"{_number(data)}"


def _equal(found: bytes, expected: bytes) -> bool:
    """Equal as numbers: a node may show a value in another length than it was written in."""
    return len(found) > 0 and _number(found) == _number(expected)


def _number(data: bytes) -> int:
    return int.from_bytes(data, "little")


def _program(axes: Sequence[AxisSettings], settings: GatewaySettings, references: Sequence[Reference]) -> list[_Step]:
    """First what belongs to the node and what only the drive knows of, units for example, then each axis."""
    steps = [*_identity(axes[0].identity), *_written(supervision(axes[0], settings))]
    steps += [step for axis in axes for item in axis.objects for step in _own(item)]
    for axis, reference in zip(axes, references, strict=True):
        steps += _axis_program(axis, settings, reference)
    return steps


def _io_program(io: IoSettings, settings: GatewaySettings) -> list[_Step]:
    """Its profile, who watches whom, what its outputs do without a master, and its PDOs, which may be fixed."""
    kind = DEVICE_PROFILE.to_bytes(2, "little")
    pdos = io_image_of(io).pdos
    steps = [*_identity(io.identity), _Step("device profile", 0x1000, 0, None, kind, constant=True, low_half=True)]
    steps += _written([*supervision(io, settings), *error_behaviour(io)])
    steps += [
        _Step("PDO that is not used", *_parts(write), optional=True, fixed=True) for write in unused(io.node_id, pdos)
    ]
    writes = [write for pdo in pdos for write in pdo.writes()]
    steps += [_Step("PDO mapping", *_parts(write), fixed=True) for write in writes]
    linked = {(write.index, write.sub): write.data for write in writes}
    return steps + [_Step("PDO mapping", index, sub, None, data) for (index, sub), data in linked.items()]


def _written(items: Sequence[Preparation]) -> list[_Step]:
    """Each value, and what shows it."""
    steps = []
    for item in items:
        write, waived = item.write, item.waived
        steps.append(_Step(item.what, write.index, write.sub, write.data, waived=waived))
        steps.append(_Step(item.what, item.shown_index, item.shown_sub, None, write.data, waived=waived))
    return steps


def _own(item: OwnObject) -> list[_Step]:
    """An object that can only be written is not read back."""
    write = _Step(item.name, item.index, item.sub, item.data)
    return [write, _Step(item.name, item.index, item.sub, None, item.data)] if item.readable else [write]


def _axis_program(axis: AxisSettings, settings: GatewaySettings, reference: Reference) -> list[_Step]:
    steps = _motor(axis) + _written(preparations(axis, settings))
    encoder = axis.absolute
    if encoder is not None and encoder.serial is not None:
        steps.append(_Step("serial number of the encoder", *encoder.serial, None, take=reference.hear_serial))
    if encoder is not None and encoder.status is not None:
        steps.append(_Step("status of the encoder", *encoder.status, None, take=reference.hear_status))
    pdos = image_of(axis).pdos
    steps += [
        _Step("PDO that is not used", *_parts(write), optional=True)
        for write in unused(axis.node_id, pdos, axis.number)
    ]
    writes = [write for pdo in pdos for write in pdo.writes()]
    steps += [_Step("PDO mapping", *_parts(write)) for write in writes]
    linked = {(write.index, write.sub): write.data for write in writes}
    return steps + [_Step("PDO mapping", index, sub, None, data) for (index, sub), data in linked.items()]


def _motor(axis: AxisSettings) -> list[_Step]:
    """What torques are told in must be what the drive takes them in."""
    if axis.torque is None:
        return []
    rated = axis.torque.rated_mnm.to_bytes(4, "little")
    what = "rated torque of the motor in mNm"
    return [_Step(what, index_of(MOTOR_RATED_TORQUE, axis.number), 0, None, rated, constant=True)]


def _parts(write: SdoWrite) -> tuple[int, int, bytes]:
    return write.index, write.sub, write.data


def _identity(identity: IdentitySettings) -> list[_Step]:
    """The vendor is always read: whoever has no identity object is no CANopen node."""
    wanted = (identity.vendor, identity.product, identity.revision, identity.serial)
    names = ("vendor-ID", "product code", "revision number", "serial number")
    shown = [None if value is None else value.to_bytes(4, "little") for value in wanted]
    return [
        _Step(name, IDENTITY, sub, None, value, constant=True)
        for sub, (name, value) in enumerate(zip(names, shown, strict=True), start=1)
        if sub == 1 or value is not None
    ]
