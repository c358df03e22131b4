"""The process image on the bus, in one place: what the gateway and the drive of one axis exchange.

The command (controlword, target position, and target torque where torques are told) and the status (statusword, actual
position, and actual torque likewise) act on every SYNC. What an axis has beyond that (velocity and torque offset,
digital inputs and outputs) is in PDOs of its own. The image is written to a node by SDO; a node obeys what it is given
and need not know this file.

A drives file may give the first PDOs of its nodes to motions of their own (`profile_pdos`); command and status then are
the fourth.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from struct import Struct
from types import MappingProxyType

from drive_gateway.canopen.axis_objects import PDO_SPAN, first_axis_index, index_of
from drive_gateway.canopen.bus_load import frame_bits
from drive_gateway.canopen.cob_id import RPDO1, TPDO1
from drive_gateway.canopen.drive_objects import (
    CONTROLWORD,
    DIGITAL_INPUTS,
    DIGITAL_OUTPUTS,
    INTERPOLATION_DATA,
    POSITION_ACTUAL,
    STATUSWORD,
    TARGET_POSITION,
    TARGET_TORQUE,
    TORQUE_ACTUAL,
    TORQUE_OFFSET,
    VELOCITY_OFFSET,
)
from drive_gateway.canopen.frame import CanFrame
from drive_gateway.canopen.sdo import SdoWrite

EVERY_SYNC = 1
"""Transmission type: cyclic synchronous, each SYNC."""
ON_EVENT = 254
"""Transmission type: an RPDO acts on arrival, a TPDO comes by the drive's own timer."""
DISABLED = 1 << 31
"""Bit 31 of a PDO's COB-ID: the PDO does not exist."""
NO_REMOTE = 1 << 30
"""Bit 30 of a TPDO's COB-ID: no remote frame asks for it. A node may refuse to change it (CiA 301, 1800h); in an RPDO's
COB-ID it is reserved. So it stays as the node has it."""
PDOS = range(1, 5)
"""An axis has up to four PDOs in each direction."""

COMMAND = Struct("<Hi")
"""Controlword, target position [counts]."""
COMMAND_WITH_TORQUE = Struct("<Hih")
"""The same and target torque [per mille of the motor's rated torque]."""
OFFSET = Struct("<i")
"""Velocity offset [counts/s]."""
OFFSETS = Struct("<ih")
"""Velocity offset [counts/s], torque offset [per mille of the motor's rated torque]."""
INPUTS = Struct("<I")
"""Digital inputs."""


@dataclass(frozen=True, slots=True)
class OwnPdo:
    """What a drives file says of one PDO of an axis; what it leaves out is as usual."""

    number: int | None = None
    cob_id: int | None = None
    mapping: tuple[int, ...] = ()
    """Entries of axis 1; empty: what is needed and nothing else."""


@dataclass(frozen=True, slots=True)
class Pdo:
    """One PDO of a node. Entries are index << 16 | sub-index << 8 | bits; `every` is its transmission type."""

    number: int
    receive: bool
    """Received by the node."""
    node_id: int
    entries: tuple[int, ...]
    every: int = EVERY_SYNC
    period_s: float = 0.0
    """Of a PDO of type `ON_EVENT`."""
    axis: int = 1
    """Whose the PDO is; its `number` counts from the first one of this axis."""
    identifier: int | None = None
    """Of its own; `None`: that of the predefined connection set."""
    cob_id: int = field(init=False, compare=False)
    """Predefined connection set: axis 1 has the identifiers of its Node-ID, the next axis those of the next one."""
    data_bytes: int = field(init=False, compare=False)

    def __post_init__(self) -> None:
        # Each frame of each cycle asks for these two.
        first = RPDO1 if self.receive else TPDO1
        usual = first + 0x100 * (self.number - 1) + self.node_id + self.axis - 1
        object.__setattr__(self, "cob_id", usual if self.identifier is None else self.identifier)
        object.__setattr__(self, "data_bytes", sum(entry & 0xFF for entry in self.entries) // 8)

    def writes(self) -> list[SdoWrite]:
        """Disable, type, times, no entries, entries, count, enable: a node refuses any other order."""
        mapping = self._record(0x1600 if self.receive else 0x1A00)
        return [
            self.unlinked(),
            SdoWrite(self._communication, 2, _u8(self.every)),
            *self._timers(),
            SdoWrite(mapping, 0, _u8(0)),
            *(SdoWrite(mapping, sub, _u32(entry)) for sub, entry in enumerate(self.entries, start=1)),
            SdoWrite(mapping, 0, _u8(len(self.entries))),
            SdoWrite(self._communication, 1, _u32(self.cob_id)),
        ]

    def _timers(self) -> list[SdoWrite]:
        """The period as inhibit time and as event timer: a drive that sends on change sends no more often, and one that
        takes its period from the inhibit time (FESTO CMMP) sends as often."""
        if self.receive or self.every != ON_EVENT:
            return []
        inhibit, timer = round(self.period_s * 10_000), round(self.period_s * 1000)
        return [SdoWrite(self._communication, 3, _u16(inhibit)), SdoWrite(self._communication, 5, _u16(timer))]

    @property
    def name(self) -> str:
        """For people, counted from the first PDO of its axis: RPDO 1."""
        of_axis = "" if self.axis == 1 else f" of axis {self.axis}"
        return f"{'RPDO' if self.receive else 'TPDO'} {self.number}{of_axis}"

    def unlinked(self) -> SdoWrite:
        """The write that takes this PDO off the bus."""
        return SdoWrite(self._communication, 1, _u32(self.cob_id | DISABLED))

    @property
    def _communication(self) -> int:
        return self._record(0x1400 if self.receive else 0x1800)

    def _record(self, first: int) -> int:
        return first + PDO_SPAN * (self.axis - 1) + self.number - 1


@dataclass(frozen=True, slots=True)
class ProcessImage:
    """What one axis exchanges with the gateway."""

    command: Pdo
    status: Pdo
    offset: Pdo | None = None
    """To the drive: feed-forward of velocity, or of velocity and torque."""
    inputs: Pdo | None = None
    """From the drive: its digital inputs, every few SYNCs."""
    outputs: Pdo | None = None
    """To the drive: its digital outputs (60FEh:01), sent when one changes and every now and then."""
    profile: tuple[Pdo, ...] = ()
    """For motions that the drive makes by itself, of type `ON_EVENT`."""
    tells_torque: bool = False
    """The status has the actual torque [per mille of the motor's rated torque]."""

    @property
    def status_layout(self) -> Struct:
        """Statusword, position actual [counts], and torque where it is told, among what else the status carries."""
        read = {STATUSWORD: "H", POSITION_ACTUAL: "i"} | ({TORQUE_ACTUAL: "h"} if self.tells_torque else {})
        parts = [(first_axis_index(entry >> 16), (entry & 0xFF) // 8) for entry in self.status.entries]
        return Struct("<" + "".join(read.get(index, f"{size}x") for index, size in parts))

    @property
    def node_id(self) -> int:
        return self.command.node_id

    @property
    def pdos(self) -> tuple[Pdo, ...]:
        """All of them, in the order in which they are linked."""
        return (*self.profile, *self._cyclic)

    @property
    def bits_per_cycle(self) -> float:
        """On the wire, with worst-case stuffing, when an output changes in every cycle."""
        return sum(frame_bits(pdo.data_bytes) / pdo.every for pdo in self._cyclic)

    @property
    def timed_bits_s(self) -> float:
        """The same per second, of the PDOs that do not belong to the cycle."""
        return sum(frame_bits(pdo.data_bytes) / pdo.period_s for pdo in self.profile)

    @property
    def _cyclic(self) -> tuple[Pdo, ...]:
        pdos = (self.command, self.offset, self.outputs, self.status, self.inputs)
        return tuple(pdo for pdo in pdos if pdo is not None)

    def frames(
        self, controlword: int, target: int, velocity: int = 0, torque: int = 0, target_torque: int = 0
    ) -> list[CanFrame]:
        """The command of one cycle: target [counts], what is fed forward of velocity [counts/s] and torque, and the
        target of mode cyclic torque; torques are per mille of the rated one."""
        with_torque = self.command.data_bytes == COMMAND_WITH_TORQUE.size
        data = (
            COMMAND_WITH_TORQUE.pack(controlword, target, target_torque)
            if with_torque
            else COMMAND.pack(controlword, target)
        )
        command = CanFrame(self.command.cob_id, data)
        if self.offset is None:
            return [command]
        both = self.offset.data_bytes == OFFSETS.size
        offsets = OFFSETS.pack(velocity, torque) if both else OFFSET.pack(velocity)
        return [CanFrame(self.offset.cob_id, offsets), command]


def process_image(
    node_id: int,
    *,
    axis: int = 1,
    interpolated: bool = False,
    velocity_offset: bool = False,
    torque_offset: bool = False,
    torques: bool = False,
    inputs_every: int = 0,
    outputs: bool = False,
    profile: tuple[Pdo, ...] = (),
    own: Mapping[str, OwnPdo] = MappingProxyType({}),
) -> ProcessImage:
    """The image of one axis; its inputs come with each `inputs_every`-th SYNC (1 to 240), or never (0).

    A torque offset goes beside the velocity offset, never alone. `torques`: target and actual torque go with command
    and status. `outputs`: the axis has digital outputs to be switched, in its third RPDO; beside `profile` that one
    must be free. `own`: numbers, identifiers and mapping that are not the usual ones, by what the PDO carries.
    """
    first, second = (4, 3) if profile else (1, 2)
    index, sub = target_object(interpolated)

    def pdo(role: str, number: int, receive: bool, *entries: int, every: int = EVERY_SYNC) -> Pdo:
        said = own.get(role, OwnPdo())
        mapped = entries_of(said.mapping or entries, axis)
        return Pdo(said.number or number, receive, node_id, mapped, every, axis=axis, identifier=said.cob_id)

    offsets = [_entry(VELOCITY_OFFSET, 32)] * velocity_offset + [_entry(TORQUE_OFFSET, 16)] * torque_offset
    command = [_entry(CONTROLWORD, 16), _entry(index, 32) | sub << 8] + [_entry(TARGET_TORQUE, 16)] * torques
    status = [_entry(STATUSWORD, 16), _entry(POSITION_ACTUAL, 32)] + [_entry(TORQUE_ACTUAL, 16)] * torques
    return ProcessImage(
        command=pdo("command", first, True, *command),
        status=pdo("status", first, False, *status),
        offset=pdo("offset", second, True, *offsets) if offsets else None,
        inputs=pdo("inputs", second, False, _entry(DIGITAL_INPUTS, 32), every=inputs_every) if inputs_every else None,
        outputs=pdo("outputs", 3, True, _entry(DIGITAL_OUTPUTS, 32) | 1 << 8) if outputs else None,
        profile=profile,
        tells_torque=torques,
    )


def target_object(interpolated: bool) -> tuple[int, int]:
    """Index and sub-index of the set point, in interpolated and in cyclic synchronous position."""
    return (INTERPOLATION_DATA, 1) if interpolated else (TARGET_POSITION, 0)


def entries_of(entries: Iterable[int], axis: int) -> tuple[int, ...]:
    """Mapping entries of axis 1 as those of `axis`."""
    return tuple(index_of(entry >> 16, axis) << 16 | entry & 0xFFFF for entry in entries)


def unused(node_id: int, linked: tuple[Pdo, ...], axis: int = 1) -> list[Pdo]:
    """Every other PDO of the axis, to be taken off the bus: what it has from its factory may collide with another
    node."""
    used = {(pdo.receive, pdo.number) for pdo in linked}
    return [
        Pdo(number, receive, node_id, (), axis=axis)
        for receive in (True, False)
        for number in PDOS
        if (receive, number) not in used
    ]


def _entry(index: int, bits: int) -> int:
    return index << 16 | bits


def _u8(value: int) -> bytes:
    return value.to_bytes(1, "little")


def _u16(value: int) -> bytes:
    return value.to_bytes(2, "little")


def _u32(value: int) -> bytes:
    return value.to_bytes(4, "little")
