"""What is written to a drive before it may move: interpolation, mode, stops, windows, heartbeats.

Every value is read back and compared: a drive that keeps another value would stop in another way than the cell expects.
"""

from dataclasses import dataclass, replace
from typing import Protocol

from drive_gateway.canopen.axis_objects import index_of
from drive_gateway.canopen.drive_objects import (
    ABORT_CONNECTION_OPTION,
    DIGITAL_OUTPUTS,
    FOLLOWING_TIME,
    FOLLOWING_WINDOW,
    INTERPOLATION_PERIOD,
    INTERPOLATION_SUB_MODE,
    MODE,
    MODE_DISPLAY,
    MOTOR_SPEED,
    POSITION_LIMITS,
    POSITION_RANGE,
    QUICK_STOP_DECELERATION,
    QUICK_STOP_OPTION,
)
from drive_gateway.canopen.sdo import SdoWrite
from drive_gateway.config.settings import INT32_MIN, MOTOR_SPEED_RESERVE, AxisSettings, GatewaySettings

INTERPOLATED_POSITION, CYCLIC_SYNCHRONOUS_POSITION = 7, 8
HEARTBEAT_CONSUMER, HEARTBEAT_PRODUCER, LIFE_TIME_FACTOR = 0x1016, 0x1017, 0x100D


@dataclass(frozen=True, slots=True)
class Preparation:
    """One value, what it is for, and the object that shows it (the mode is set by one object and shown by another)."""

    what: str
    write: SdoWrite
    shown_index: int
    shown_sub: int
    waived: bool = False
    """A drive without the object goes without the value."""
    optional: bool = False
    """A node without the object is as it should be."""
    also: range = range(0)
    """Values that do as well, where the node keeps one of its own."""

    def of_axis(self, axis: int) -> "Preparation":
        """The same for axis 1 to 3 of a node."""
        write = replace(self.write, index=index_of(self.write.index, axis))
        return replace(self, write=write, shown_index=index_of(self.shown_index, axis))


class Supervised(Protocol):
    """What the drives file says of a node's error control."""

    @property
    def guarded(self) -> bool:
        """By node guarding instead of heartbeats."""

    @property
    def waived(self) -> frozenset[int]:
        """Indices of objects that it may lack."""


def supervision(node: Supervised, settings: GatewaySettings) -> list[Preparation]:
    """How this node, or that of this axis, and its master watch each other."""
    return waived(node, _guarding(settings) if node.guarded else _heartbeats(settings))


def preparations(axis: AxisSettings, settings: GatewaySettings) -> list[Preparation]:
    """The values for one axis at its own indices, in the order in which they are written.

    Raises:
        ValueError: the cycle cannot be expressed as an interpolation period (60C2h).
    """
    counts = abs(axis.counts_per_unit)
    braking = max(1, axis.units.ramp(axis.quick_stop * counts))
    period, exponent = interpolation_period(settings.cycle_s)
    sub_mode = [same("interpolation sub mode", INTERPOLATION_SUB_MODE, 0, axis.interpolation, 2)]
    values = [
        same("interpolation period", INTERPOLATION_PERIOD, 1, period, 1),
        same("interpolation period, power of ten", INTERPOLATION_PERIOD, 2, exponent, 1),
        *(sub_mode if axis.interpolated else []),
        *play(axis),
        same("quick-stop deceleration", QUICK_STOP_DECELERATION, 0, braking, 4),
        same("quick-stop option", QUICK_STOP_OPTION, 0, axis.quick_stop_option, 2),
        same("reaction to a lost connection", ABORT_CONNECTION_OPTION, 0, axis.connection_lost, 2),
        same("following-error window", FOLLOWING_WINDOW, 0, round(axis.following_window * counts), 4),
        same("following-error time", FOLLOWING_TIME, 0, _milliseconds(axis.following_time_s), 2),
        *_limits(axis),
        *_range(axis),
    ]
    return [item.of_axis(axis.number) for item in waived(axis, values)]


def digital_outputs(axis: AxisSettings, on: int) -> list[Preparation]:
    """The outputs that blocks can switch: first what is on, then which bits count, so that none is on in between."""
    if not axis.output_mask:
        return []
    values = [
        same("digital outputs", DIGITAL_OUTPUTS, 1, on, 4),
        same("mask of the digital outputs", DIGITAL_OUTPUTS, 2, axis.output_mask, 4),
    ]
    return [item.of_axis(axis.number) for item in values]


def waived(node: Supervised, items: list[Preparation]) -> list[Preparation]:
    """The same, marked where the node may lack the object."""
    return [replace(item, waived=item.write.index in node.waived) for item in items]


def play(axis: AxisSettings) -> list[Preparation]:
    """What plays blocks, at the indices of axis 1: the mode, and a motor that may turn as fast as they ask for."""
    mode = Preparation("mode of operation", SdoWrite(MODE, 0, played_mode(axis)), MODE_DISPLAY, 0)
    if axis.torque is None:
        return [mode]
    return [
        same("highest motor speed", MOTOR_SPEED, 0, round(MOTOR_SPEED_RESERVE * axis.speed * axis.torque.rpm), 4),
        mode,
    ]


def _range(axis: AxisSettings) -> list[Preparation]:
    """An endless axis counts from 0 to the last count of one turn, and then from 0 again."""
    if not axis.modulus:
        return []
    return [
        same("lowest count of a turn", POSITION_RANGE, 1, 0, 4),
        same("highest count of a turn", POSITION_RANGE, 2, axis.modulus - 1, 4),
    ]


def _limits(axis: AxisSettings) -> list[Preparation]:
    """In the drive's own direction: what is low for the axis may be high for its counts.

    A drive may refuse limits that cross those it has from before, so the lower one is taken out of the way first.
    """
    if axis.limits is None:
        return []
    low, high = sorted(round((limit - axis.offset) * axis.counts_per_unit) for limit in axis.limits)
    return [
        same("lowest position of all", POSITION_LIMITS, 1, INT32_MIN, 4),
        same("highest position", POSITION_LIMITS, 2, high, 4),
        same("lowest position", POSITION_LIMITS, 1, low, 4),
    ]


def played_mode(axis: AxisSettings) -> bytes:
    """The mode in which blocks are played, as 6060h and 6061h hold it."""
    mode = INTERPOLATED_POSITION if axis.interpolated else CYCLIC_SYNCHRONOUS_POSITION
    return mode.to_bytes(1, "little", signed=True)


def life_time_factor(settings: GatewaySettings) -> int:
    """100Dh: after so many guard times without a poll a node misses its gateway."""
    return max(2, min(255, round(settings.heartbeat_timeout_s / settings.heartbeat_producer_s)))


def _heartbeats(settings: GatewaySettings) -> list[Preparation]:
    """A drive may round its own period: to half of it at least, and as long as its silence is told from a loss."""
    consumer = settings.node_id << 16 | _milliseconds(settings.heartbeat_timeout_s)
    producer = _milliseconds(settings.heartbeat_producer_s)
    also = range(-(-producer // 2), _milliseconds(settings.heartbeat_timeout_s - settings.overrun_limit_s))
    return [
        replace(same("heartbeat of the node", HEARTBEAT_PRODUCER, 0, producer, 2), also=also),
        same("heartbeat of the gateway", HEARTBEAT_CONSUMER, 1, consumer, 4),
    ]


def _guarding(settings: GatewaySettings) -> list[Preparation]:
    """Guarding and heartbeat share an identifier, so a node has one of them: the heartbeat goes first."""
    return [
        replace(same("no heartbeat of the node", HEARTBEAT_PRODUCER, 0, 0, 2), optional=True),
        same("guard time", 0x100C, 0, _milliseconds(settings.heartbeat_producer_s), 2),
        same("life time factor", LIFE_TIME_FACTOR, 0, life_time_factor(settings), 1),
    ]


def interpolation_period(cycle_s: float) -> tuple[int, int]:
    """The cycle as value (1 to 255) and power of ten of 60C2h, for example 4 and -3.

    Raises:
        ValueError: no value of 1 to 255 at 10^-3 to 10^-6 s is this cycle.
    """
    for exponent in (-3, -4, -5, -6):
        value = round(cycle_s * 10**-exponent)
        if 1 <= value <= 255 and abs(value * 10.0**exponent - cycle_s) < 1e-9:
            return value, exponent
    allowed = "1 to 255 times 1 ms, 0.1 ms, 10 us or 1 us"
    raise ValueError(f"cycle {cycle_s} s is no interpolation period of a drive: allowed are {allowed}")


def same(what: str, index: int, sub: int, value: int, size: int) -> Preparation:
    """A value of `size` bytes that the object which it is written to shows."""
    data = value.to_bytes(size, "little", signed=value < 0)
    return Preparation(what, SdoWrite(index, sub, data), index, sub)


def _milliseconds(seconds: float) -> int:
    return round(seconds * 1000)
