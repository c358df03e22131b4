"""A bus and its drives as the gateway uses them: SI units, every default filled in."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

from drive_gateway.canopen.cob_id import MASTER_NODE_ID
from drive_gateway.canopen.emcy import Meaning
from drive_gateway.canopen.pdo_map import OwnPdo
from drive_gateway.canopen.profile_pdos import ProfilePdos
from drive_gateway.config.drive_units import COUNTS, DriveUnits

INT32_MIN, INT32_MAX = -(2**31), 2**31 - 1
DELAY_CYCLES = 2
"""A sample acts with the SYNC after it, and an axis without lag has reached it at the next one, which shows it."""
BRAKE_S = 0.3
"""Longest overlap of motor and holding brake that is usual."""
SWITCH_ON_S = 1.5
"""A drive takes so long at most to reach a state that it is told."""
REST_WINDOW = 2e-4
"""[rad or m] 2 mrad/s or 2 mm/s over the time in which rest is measured."""
SETUP_SHARE = 0.25
"""Share of an axis' speed and acceleration that motions of the drive's own may use."""
MOTOR_SPEED_RESERVE = 1.2
"""A motor may turn so much faster than set points ask for, to catch up a lag."""


@dataclass(frozen=True, slots=True)
class HomingSettings:
    """How an axis finds its home point. Directions are the drive's own: those of its counts."""

    method: int
    """CiA 402 homing method (6098h)."""
    fast: float
    """[rad/s or m/s] towards the switch (6099h:01)."""
    slow: float
    """[rad/s or m/s] off the switch (6099h:02)."""
    acceleration: float
    """[rad/s^2 or m/s^2] (609Ah)."""
    position: float
    """[rad or m] axis position of the home point (607Ch)."""
    order: int
    """Axes of one number home together, lower numbers first."""


@dataclass(frozen=True, slots=True)
class IdentitySettings:
    """What the identity object (1018h) of the right drive says; `None` is not looked at."""

    vendor: int | None = None
    product: int | None = None
    revision: int | None = None
    serial: int | None = None


@dataclass(frozen=True, slots=True)
class InputSettings:
    """Bits of the drive's digital inputs (60FDh) that must be 1 (closed) before and while the robot has torque."""

    enable: tuple[int, ...] = ()
    door: tuple[int, ...] = ()
    estop: tuple[int, ...] = ()
    """Buttons that stop the whole cell."""


@dataclass(frozen=True, slots=True)
class OutputSettings:
    """A digital output of a drive (60FEh) or of an I/O node (6200h) that blocks can switch."""

    name: str
    axis: str
    """Whose drive has it; empty: an I/O node has it."""
    bit: int
    """Of 60FEh:01; of an I/O node counted on from byte to byte, 8 is bit 0 of 6200h:02."""
    lead_s: float = 0.0
    """It is switched so much before the motion reaches the place, because what hangs on it takes that long."""
    keep: bool = False
    """It stays as it is when its robot is stopped; else it goes off."""
    io: str = ""
    """I/O node that has it; empty: a drive has it."""


@dataclass(frozen=True, slots=True)
class NamedInput:
    """A digital input that has a name: of a drive (60FDh) or of an I/O node (6000h)."""

    name: str
    axis: str
    """Whose drive has it; empty: an I/O node has it."""
    bit: int
    """Of 60FDh; of an I/O node counted on from byte to byte, 8 is bit 0 of 6000h:02."""
    io: str = ""
    """I/O node that has it; empty: a drive has it."""


@dataclass(frozen=True, slots=True)
class IoSettings:
    """An I/O node (CiA 401) with digital inputs and outputs, for the robots that name some of them."""

    name: str
    node_id: int
    input_bytes: int
    """Sub-indices of 6000h that come with its TPDO, 0 to 8."""
    output_bytes: int
    """Sub-indices of 6200h that go with its RPDO, 0 to 8."""
    stops: bool = True
    """Robots that name an input or output of it stop when it falls silent; else that is only told."""
    kept: int = 0
    """Outputs that stay as they are when the node misses the gateway; all others go off."""
    identity: IdentitySettings = IdentitySettings()
    guarded: bool = False
    """The node is watched by node guarding instead of heartbeats, for nodes that have none."""
    waived: frozenset[int] = frozenset()
    """Indices of objects that the node may lack (`IO_OPTIONAL_OBJECTS`)."""
    emergencies: Mapping[int, Meaning] = field(default_factory=dict)
    """Meaning and remedy of the emergency codes of its type of node, over those of CiA 301."""


@dataclass(frozen=True, slots=True)
class EncoderSettings:
    """How it is checked after each start that an absolute encoder still shows where its axis is."""

    counts_per_turn: int
    """Of the motor."""
    window: int
    """[counts] by which the axis may have moved while its drive was off; less than half a turn of the motor."""
    serial: tuple[int, int] | None = None
    """Index and sub-index of the encoder's serial number; `None`: the drive does not tell it."""
    status: tuple[int, int] | None = None
    """Index and sub-index of the encoder's status."""
    battery_mask: int = 0
    """Bits of the status that are set after the encoder's battery was empty."""


@dataclass(frozen=True, slots=True)
class TemperatureSettings:
    """An object of the maker's own that shows a temperature."""

    address: tuple[int, int]
    """Index and sub-index as the node has them."""
    size: int
    """[bytes]"""
    signed: bool
    unit_c: float
    """[degC] of one unit."""


@dataclass(frozen=True, slots=True)
class TorqueSettings:
    """How torques are told to a drive: in per mille of its motor's rated torque."""

    rated_mnm: int
    """[mNm] the motor's rated torque, as its drive must show it (6076h)."""
    per_mille: float
    """Per mille of that per Nm (or N) of the axis, gear included, negative for a reversed direction."""
    rpm: float
    """[1/min] of the motor per rad/s (or m/s) of the axis."""


@dataclass(frozen=True, slots=True)
class OwnObject:
    """A value that the gateway writes at each boot without knowing what it means."""

    index: int
    """As the node has it, whichever axis it belongs to."""
    sub: int
    name: str
    data: bytes
    readable: bool = True
    """It is read back."""


@dataclass(frozen=True, slots=True)
class AxisSettings:
    """One axis: its node, its units and its limits. Radians or metres are at the axis, behind the gear."""

    name: str
    node_id: int
    counts_per_unit: float
    """Encoder counts per rad (or m) of the axis, gear included, negative for a reversed direction."""
    offset: float
    """Axis position [rad or m] at encoder count zero."""
    speed: float
    """[rad/s or m/s] above this a block is refused."""
    acceleration: float
    """[rad/s^2 or m/s^2] above this a block is refused; at least the agent's `ramp` limit."""
    quick_stop: float
    """[rad/s^2 or m/s^2] deceleration of the drive's own quick stop (6085h); above `acceleration`."""
    following_window: float
    """[rad or m] following error that is a fault (6065h)."""
    following_time_s: float
    """Time for which the following error may be larger (6066h)."""
    delay_cycles: int = DELAY_CYCLES
    """So many cycles after a sample was sent its drive shows where that left the axis: its following error."""
    brake_s: float = BRAKE_S
    """So long after it got torque its brake may still hold it, and after it lost it the brake may still close."""
    switch_on_s: float = SWITCH_ON_S
    """From the order to switch on to Operation Enabled, charging of its DC link and opening of its brake included."""
    units: DriveUnits = COUNTS
    """In which its drive takes velocities and accelerations."""
    try_units: bool = True
    """Its first motion by its drive after each start tries them."""
    rest_window: float = REST_WINDOW
    """[rad or m] an axis that stays within this is at rest, though its loop hunts."""
    number: int = 1
    """Which axis of its node it is, 1 to 3."""
    index_counts: int = 0
    """Encoder counts between two index pulses, one per motor turn; 0: the encoder has none."""
    linear: bool = False
    """The axis slides: its units are metres."""
    incremental: bool = False
    """The encoder counts from zero after each power-on: the axis must home before it may be enabled."""
    absolute: EncoderSettings | None = None
    """`None`: the encoder is incremental, or believed without a check."""
    homing: HomingSettings | None = None
    """`None`: the axis cannot home."""
    modulus: int = 0
    """[counts] of one turn of an endless axis, after which its drive counts from zero again (607Bh); 0: it has ends."""
    limits: tuple[float, float] | None = None
    """[rad or m] what the drive itself keeps its targets within (607Dh); a block or a set-up move beyond is refused."""
    limit_switches: tuple[float, float] | None = None
    """[rad or m] axis positions of its limit switches (60FDh bits 0 and 1); `None`: it has none, or none to look at."""
    inputs: InputSettings | None = None
    """`None`: the drive's inputs are not looked at."""
    output_mask: int = 0
    """Bits of the drive's digital outputs (60FEh) that blocks can switch."""
    input_mask: int = 0
    """Bits of the drive's digital inputs (60FDh) that have a name."""
    interpolated: bool = False
    """Blocks are played in interpolated position mode, for drives that have no cyclic synchronous position."""
    interpolation: int = 0
    """Interpolation sub mode (60C0h) of interpolated position: 0 linear, below 0 the maker's own."""
    velocity_offset: bool = False
    """The drive gets the velocity of each sample as feed-forward (60B1h)."""
    torque: TorqueSettings | None = None
    """`None`: the motor's rated torque is not known."""
    torque_offset: bool = False
    """The drive gets the torque of each sample as feed-forward (60B2h), beside its velocity."""
    temperature: TemperatureSettings | None = None
    """`None`: nobody knows where the drive shows one."""
    identity: IdentitySettings = IdentitySettings()
    guarded: bool = False
    """The node is watched by node guarding instead of heartbeats, for drives that have none."""
    profile_pdos: ProfilePdos | None = None
    """PDOs for motions that the drive makes by itself; `None`: these go by the cyclic image and SDO."""
    own_pdos: Mapping[str, OwnPdo] = field(default_factory=dict)
    """PDOs that are not as usual, by what they carry."""
    eds: str = ""
    """File with the names and types of the node's objects; empty: those of plain CiA 402."""
    like: str | None = None
    """Known drive, whose maker's objects are known without a file."""

    quick_stop_option: int = 6
    """605Ah: brake with `quick_stop` and stay in Quick Stop Active, voltage on (6), or take it off then (2)."""
    connection_lost: int = 3
    """6007h: a lost connection is answered by a quick stop (3), or by a fault (1)."""
    waived: frozenset[int] = frozenset()
    """Indices of objects that the drive may lack, as axis 1 has them (`OPTIONAL_OBJECTS`)."""
    emergencies: Mapping[int, Meaning] = field(default_factory=dict)
    """Meaning and remedy of the emergency codes of its type of drive, over those of CiA 301 and CiA 402."""
    objects: tuple[OwnObject, ...] = ()
    """Of the drive's own, for example how long it waits for set points before it stops."""

    def wrapped(self, counts: int) -> int:
        """Counts as the drive has them: within one turn where the axis is endless."""
        return counts % self.modulus if self.modulus else counts

    def nearest(self, counts: int, to: int) -> int:
        """What the drive shows as `counts`, on the turn nearest to the counts `to`."""
        if not self.modulus:
            return counts
        half = self.modulus // 2
        return to + (counts - to + half) % self.modulus - half

    @property
    def int32_range(self) -> tuple[float, float]:
        """[rad or m] lowest and highest position whose counts fit into an int32; an endless axis has none."""
        if self.modulus:
            return -math.inf, math.inf
        ends = [self.offset + bound / self.counts_per_unit for bound in (INT32_MIN, INT32_MAX)]
        return min(ends), max(ends)


@dataclass(frozen=True, slots=True)
class RobotDrives:
    """The axes of one robot on this bus, in the order of its set-point blocks."""

    robot: str
    axes: tuple[AxisSettings, ...]
    outputs: tuple[OutputSettings, ...] = ()
    """Up to 32, in the order in which a claim names them."""
    inputs: tuple[NamedInput, ...] = ()


@dataclass(frozen=True, slots=True)
class BusSettings:
    """How python-can opens the bus. `options` go to `can.Bus` as they are (port, hop_limit, ...)."""

    interface: str
    channel: str
    bitrate: int
    options: dict[str, str | int | float | bool]


@dataclass(frozen=True, slots=True)
class GatewaySettings:
    """One gateway: its bus, its cycle and its robots."""

    name: str
    bus: BusSettings
    cycle_s: float
    overrun_limit_s: float
    """A cycle that is later than this is a fault: 0.02 s on real drives, 0.2 s on simulated ones."""
    heartbeat_producer_s: float
    """Period of the master's and the nodes' heartbeats (1017h)."""
    heartbeat_timeout_s: float
    """Silence after which master and nodes miss each other (1016h)."""
    tpdo_timeout_s: float
    """Silence of a node's TPDO that stops its robot."""
    boot_timeout_s: float
    """Within this time after NMT reset a node must have sent its boot-up, and then answer each request."""
    robots: dict[str, RobotDrives]
    sdo_timeout_s: float = 0.5
    """A node answers each SDO request within this time."""
    sync_counter: int = 0
    """SYNC counts from 1 to this (1019h); 0: it has no counter."""
    node_id: int = MASTER_NODE_ID
    """The gateway's own, under which it sends its heartbeat."""
    io_nodes: tuple[IoSettings, ...] = ()
