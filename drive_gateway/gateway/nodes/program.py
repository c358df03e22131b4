"""What a node is asked and told when it is brought up, request by request.

A refused write is no reason by itself: an object that can only be read, or that takes no value but its own, may hold
what is wanted. So each value is read back, and only what the node shows counts.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

from drive_gateway.canopen.axis_objects import index_of
from drive_gateway.canopen.cob_id import SYNC
from drive_gateway.canopen.drive_objects import MOTOR_RATED_TORQUE
from drive_gateway.canopen.io_map import DEVICE_PROFILE
from drive_gateway.canopen.optional_objects import IO_OPTIONAL_OBJECTS, OPTIONAL_OBJECTS
from drive_gateway.canopen.pdo_map import DISABLED, NO_REMOTE, Pdo, unused
from drive_gateway.canopen.sdo import SdoRead, SdoRequest, SdoWrite
from drive_gateway.cia401.preparation import error_behaviour, io_outputs
from drive_gateway.cia402.preparation import Preparation, digital_outputs, preparations, supervision
from drive_gateway.config.gateway_objects import CYCLE_PERIOD
from drive_gateway.config.image import image_of, io_image_of
from drive_gateway.config.settings import AxisSettings, GatewaySettings, IdentitySettings, IoSettings, OwnObject
from drive_gateway.gateway.playout.outputs import Outputs
from drive_gateway.gateway.reference.reference import Reference

DEVICE_TYPE, SYNC_IDENTIFIER, IDENTITY, SYNC_COUNTER = 0x1000, 0x1005, 0x1018, 0x1019
_HEX = (range(0x1005, 0x1006), range(0x1014, 0x1017), range(0x1018, 0x1019), range(0x1400, 0x1C00))
"""Identifiers, identities and mapping entries, which people write in hex everywhere."""
_PARTS = {1: "identifier", 2: "transmission type", 3: "inhibit time", 5: "event timer"}
"""Of the communication parameters of a PDO, by sub-index."""
_SHORT = 0xFF
"""Counts, transmission types and the like are not."""
_UNUSED_BIT = 1 << 31
"""Of 1005h: it has no meaning (CiA 301)."""
_ADDITIONAL_INFORMATION = 0xFFFF0000
"""Of 1000h: the other half is the device profile."""


@dataclass(frozen=True, slots=True)
class Step:
    """One SDO request; `shown` is what a read must return, `None` for anything."""

    what: str
    index: int
    sub: int
    data: bytes | None
    shown: bytes | None = None
    set_by: tuple[int, int] | None = None
    """Of a read: the object whose write it judges, where that is another one."""
    ignored: int = 0
    """Bits of what is shown that are the node's own."""
    also: range = range(0)
    """Other values that do as well."""
    constant: bool = False
    """A node that shows something else is the wrong one."""
    optional: bool = False
    """A node that has no such object needs no such value."""
    waived: bool = False
    """A node without the object is brought up nevertheless, and what that costs is told."""
    asked: bool = False
    """Only to know what is there: the node may refuse it."""
    take: Callable[[bytes], None] | None = None
    """Who wants to know what was read."""
    present: "Present | None" = None
    """What was read of this object before, on which the write depends."""
    leave: Pdo | None = None
    """A PDO that is not used: where it cannot be taken off the bus it may stay, with its own identifier."""

    @property
    def address(self) -> tuple[int, int]:
        return self.index, self.sub

    @property
    def judges(self) -> tuple[int, int]:
        """The object whose write this read judges."""
        return self.set_by or self.address

    @property
    def needless(self) -> bool:
        """What the node has says that this write changes nothing."""
        return self.present is not None and self.data is not None and self.present.needless

    @property
    def request(self) -> SdoRequest:
        """What goes over the bus."""
        if self.data is None:
            return SdoRead(*self.address)
        return SdoWrite(*self.address, self.data if self.present is None else self.present.completed(self.data))

    def agrees(self, found: bytes) -> bool:
        """Equal as numbers, or as good: a node may show a value in another length than it was written in."""
        if self.shown is None:
            return True
        shown = number(found)
        return len(found) > 0 and (shown in self.also or not (shown ^ number(self.shown)) & ~self.ignored)

    def words(self, data: bytes) -> str:
        """A value of this object for people, without what is the node's own."""
        hexadecimal = any(self.index in some for some in _HEX) and (number(data) > _SHORT or self.index == IDENTITY)
        value = number(data) & ~self.ignored
        return f"{value:X}h" if hexadecimal else f"{value}"

    def where(self) -> str:
        kind = "read of" if self.data is None else "write of"
        expected = "" if self.shown is None else f", expected {self.words(self.shown)}"
        return f"{kind} {self.index:04X}h:{self.sub:02X} ({self.what}{expected})"


class Present:
    """What an object of a node held before it was written."""

    unless = ""
    """What makes the write needless, for people."""

    def __init__(self) -> None:
        self.value: int | None = None

    def heard(self, data: bytes) -> None:
        """Without data: the node refused to say it."""
        self.value = number(data) if data else None

    @property
    def needless(self) -> bool:
        """Nothing need be written."""
        return False

    def completed(self, data: bytes) -> bytes:
        """`data` as this node takes it."""
        return data


class _Identifier(Present):
    """COB-ID of a PDO: its bit 30 stays, and a PDO is taken off the bus with the identifier that it has."""

    def completed(self, data: bytes) -> bytes:
        if self.value is None:
            return data
        wanted = number(data)
        whole = self.value | DISABLED if wanted & DISABLED else wanted | self.value & NO_REMOTE
        return whole.to_bytes(4, "little")


class _Off(_Identifier):
    """COB-ID of a PDO that is not used."""

    unless = "it is off already"

    @property
    def needless(self) -> bool:
        return self.value is not None and bool(self.value & DISABLED)


class _Counter(Present):
    """SYNC counter (1019h): it is left alone where the node has none, or has it right."""

    unless = "the node has no such counter, or has it right"

    def __init__(self, wanted: int) -> None:
        super().__init__()
        self._wanted = wanted

    @property
    def needless(self) -> bool:
        return self.value in (None, self._wanted)


def number(data: bytes) -> int:
    """Little-endian, as CANopen has all numbers."""
    return int.from_bytes(data, "little")


@dataclass(frozen=True, slots=True)
class BootProgram:
    """All that one node is asked and told."""

    steps: Sequence[Step]
    """All but the outputs."""
    outputs: Callable[[], list[Step]]
    """The outputs as they are to be when the node starts."""
    kind: str = "drive"
    """What stands there, for people."""
    optional: Mapping[int, tuple[str, str]] = field(default_factory=lambda: OPTIONAL_OBJECTS)
    """What it may lack: name and cost by index."""


def drive_program(
    axes: Sequence[AxisSettings], settings: GatewaySettings, references: Sequence[Reference], outputs: Outputs
) -> BootProgram:
    """That of a node with one to three drives. An output that keeps its state at a stop keeps it at its return, too."""
    words = [(axis, outputs) for axis in axes]
    return BootProgram(
        program(axes, settings, references),
        lambda: [step for axis, on in words for step in _written(digital_outputs(axis, on.word(axis.name)))],
    )


def io_node_program(io: IoSettings, settings: GatewaySettings, word: Callable[[], int]) -> BootProgram:
    """That of an I/O node; `word` answers what its outputs are to be."""
    return BootProgram(
        io_program(io, settings), lambda: _written(io_outputs(io, word())), "device", IO_OPTIONAL_OBJECTS
    )


def program(axes: Sequence[AxisSettings], settings: GatewaySettings, references: Sequence[Reference]) -> list[Step]:
    """First what belongs to the node and what only the drive knows of, units for example, then each axis."""
    own = [item for axis in axes for item in axis.objects]
    steps = [*_identity(axes[0].identity), *_sync(settings, own), *_written(supervision(axes[0], settings))]
    steps += [step for item in own for step in _own(item)]
    for axis, reference in zip(axes, references, strict=True):
        steps += _axis_program(axis, settings, reference)
    return steps


def boot_plan(axes: Sequence[AxisSettings], settings: GatewaySettings) -> list[Step]:
    """All requests to a node with these axes between its boot-up and its start, as if every one were answered well.

    Its outputs are off, as they are when the gateway starts. Raises `ValueError` as `preparations` does.
    """
    steps = program(axes, settings, [Reference(axis, None) for axis in axes])
    return steps + [step for axis in axes for step in _written(digital_outputs(axis, 0))]


def io_program(io: IoSettings, settings: GatewaySettings) -> list[Step]:
    """Its profile, who watches whom, what its outputs do without a master, and its PDOs, which may be fixed."""
    profile = DEVICE_PROFILE.to_bytes(4, "little")
    kind = Step("device profile", DEVICE_TYPE, 0, None, profile, ignored=_ADDITIONAL_INFORMATION, constant=True)
    steps = [*_identity(io.identity), kind, *_sync(settings, ())]
    steps += _written([*supervision(io, settings), *error_behaviour(io)])
    return steps + _pdos(io.node_id, io_image_of(io).pdos)


def io_boot_plan(io: IoSettings, settings: GatewaySettings) -> list[Step]:
    """All requests to an I/O node, as `boot_plan` has them."""
    return io_program(io, settings) + _written(io_outputs(io, 0))


def _sync(settings: GatewaySettings, own: Sequence[OwnObject]) -> list[Step]:
    """The node takes SYNC from the gateway, knows its period, and whether it has a counter.

    CiA 301: a node with bit 30 of 1005h sends SYNC by itself; 1019h may only be changed while 1006h is 0.
    """
    identifier, period = SYNC.to_bytes(4, "little"), round(settings.cycle_s * 1e6).to_bytes(4, "little")
    wanted = settings.sync_counter.to_bytes(1, "little")
    what, how_long, counted = "identifier of SYNC", "communication cycle period in us", "SYNC counter"
    counter = _Counter(settings.sync_counter)
    said = any(item.index == CYCLE_PERIOD for item in own)
    return [
        Step(what, SYNC_IDENTIFIER, 0, identifier, optional=True),
        Step(what, SYNC_IDENTIFIER, 0, None, identifier, ignored=_UNUSED_BIT, optional=True),
        Step(counted, SYNC_COUNTER, 0, None, asked=True, take=counter.heard),
        Step(how_long, CYCLE_PERIOD, 0, bytes(4), optional=True, present=counter),
        Step(counted, SYNC_COUNTER, 0, wanted, optional=True, present=counter),
        # A node without the object has no counter, which is wanted unless the file says one.
        Step(counted, SYNC_COUNTER, 0, None, wanted, optional=not settings.sync_counter),
        *(
            []
            if said
            else [
                Step(how_long, CYCLE_PERIOD, 0, period, optional=True),
                Step(how_long, CYCLE_PERIOD, 0, None, period, optional=True),
            ]
        ),
    ]


def _written(items: Sequence[Preparation]) -> list[Step]:
    """Each value, and what shows it."""
    steps = []
    for item in items:
        write = item.write
        told = Step(item.what, write.index, write.sub, write.data, optional=item.optional, waived=item.waived)
        shown = replace(told, index=item.shown_index, sub=item.shown_sub, data=None, shown=write.data)
        steps += [told, replace(shown, set_by=told.address, also=item.also)]
    return steps


def _own(item: OwnObject) -> list[Step]:
    """An object that can only be written is not read back."""
    write = Step(item.name, item.index, item.sub, item.data)
    return [write, Step(item.name, item.index, item.sub, None, item.data)] if item.readable else [write]


def _axis_program(axis: AxisSettings, settings: GatewaySettings, reference: Reference) -> list[Step]:
    steps = _motor(axis) + _written(preparations(axis, settings))
    encoder = axis.absolute
    if encoder is not None and encoder.serial is not None:
        steps.append(Step("serial number of the encoder", *encoder.serial, None, take=reference.hear_serial))
    if encoder is not None and encoder.status is not None:
        steps.append(Step("status of the encoder", *encoder.status, None, take=reference.hear_status))
    return steps + _pdos(axis.node_id, image_of(axis).pdos, axis.number)


def _pdos(node_id: int, pdos: tuple[Pdo, ...], axis: int = 1) -> list[Step]:
    """Those that are not used are taken off the bus first."""
    used = {pdo.cob_id for pdo in pdos}
    steps = [step for pdo in unused(node_id, pdos, axis) for step in _taken_off(pdo, used)]
    linked = [_linked(pdo) for pdo in pdos]
    return steps + [step for writes, _ in linked for step in writes] + [step for _, reads in linked for step in reads]


def _taken_off(pdo: Pdo, used: set[int]) -> list[Step]:
    """It may stay where its identifier is not `used` by another PDO of its axis."""
    present, write = _Off(), pdo.unlinked()
    what = f"{pdo.name}, which is not used"
    leave = None if pdo.cob_id in used else pdo
    return [
        Step(what, write.index, write.sub, None, asked=True, take=present.heard),
        Step(what, write.index, write.sub, write.data, optional=True, present=present, leave=leave),
    ]


def _linked(pdo: Pdo) -> tuple[list[Step], list[Step]]:
    """The writes of one PDO, and the reads that judge them."""
    present, writes = _Identifier(), pdo.writes()
    same = writes[-1].index, writes[-1].sub

    def what(index: int, sub: int) -> str:
        return f"{_PARTS[sub] if index == same[0] else 'mapping'} of {pdo.name}"

    before = Step(what(*same), *same, None, asked=True, take=present.heard)
    told = [
        Step(
            what(write.index, write.sub), write.index, write.sub, write.data,
            present=present if (write.index, write.sub) == same else None,
        )
        for write in writes
    ]  # fmt: skip
    last = {(write.index, write.sub): write.data for write in writes}
    shown = [
        Step(what(*address), *address, None, data, ignored=NO_REMOTE if address == same else 0)
        for address, data in last.items()
    ]
    return [before, *told], shown


def _motor(axis: AxisSettings) -> list[Step]:
    """What torques are told in must be what the drive takes them in."""
    if axis.torque is None:
        return []
    rated = axis.torque.rated_mnm.to_bytes(4, "little")
    what = "rated torque of the motor in mNm"
    return [Step(what, index_of(MOTOR_RATED_TORQUE, axis.number), 0, None, rated, constant=True)]


def _identity(identity: IdentitySettings) -> list[Step]:
    """The vendor is always read: whoever has no identity object is no CANopen node."""
    wanted = (identity.vendor, identity.product, identity.revision, identity.serial)
    names = ("vendor-ID", "product code", "revision number", "serial number")
    shown = [None if value is None else value.to_bytes(4, "little") for value in wanted]
    return [
        Step(name, IDENTITY, sub, None, value, constant=True)
        for sub, (name, value) in enumerate(zip(names, shown, strict=True), start=1)
        if sub == 1 or value is not None
    ]
