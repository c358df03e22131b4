"""What must hold within a drives file beyond its schema."""

import math
from collections.abc import Iterator, Mapping, Sequence
from itertools import chain

from can.interfaces import VALID_INTERFACES

from cell.config.document import Document
from cell.config.problem import KeyPath, Problem, Severity
from cell.config.reading import declared
from drive_gateway.canopen.io_map import IoImage
from drive_gateway.canopen.optional_objects import IO_OPTIONAL_OBJECTS, OPTIONAL_OBJECTS
from drive_gateway.canopen.pdo_map import Pdo, ProcessImage
from drive_gateway.config.axis_entry import AxisEntry
from drive_gateway.config.bus_length import check_length
from drive_gateway.config.bus_load import KEPT_FREE, REFUSE_ABOVE, WARN_ABOVE, bus_load
from drive_gateway.config.drives_file import DrivesFile
from drive_gateway.config.emergency_entry import check_emergencies
from drive_gateway.config.image import image_of, io_image_of
from drive_gateway.config.io_checks import check_io_nodes, check_places
from drive_gateway.config.known_drive_checks import check_known_drives
from drive_gateway.config.node_checks import check_nodes
from drive_gateway.config.object_checks import check_objects
from drive_gateway.config.output_checks import check_outputs
from drive_gateway.config.pdo_entry import Named, check_pdos
from drive_gateway.config.profile_entry import check_profile_pdos
from drive_gateway.config.settings import INT32_MAX, MOTOR_SPEED_RESERVE, SETUP_SHARE

FASTEST_COUNTS = INT32_MAX / 1.02
"""[counts/s] A block may exceed the speed of its axis by the tolerance of its check, 1 % and a little."""
UINT16_MAX = 2**16 - 1
UINT32_MAX = 2**32 - 1
HOMING_AT_LIMIT = {17: -1, 18: 1}
"""Homing methods whose home point is the edge of a limit switch, and the direction of the counts in which it is."""
_NO_REAL_BUS = ("virtual", "udp_multicast")
"""Interfaces of python-can without a wire, and so without real drives."""
_LATEST_S = 0.1
"""A gateway with real drives that may be later than this lets them run on for long."""
_START_CYCLES = 3
"""From the start of a node to the answer of its first SYNC."""
MILLISECOND_FIELDS = ("heartbeat_producer_s", "heartbeat_timeout_s")


def check_drives_file(document: Document, drives: DrivesFile) -> list[Problem]:
    """All contradictions inside the drives file."""
    return [
        *_interface(document, drives),
        *check_length(document, drives.bus.bitrate, drives.bus.lengths()),
        *_empty(document, drives),
        *check_nodes(document, list(axes_of(drives)), drives.gateway_node),
        *check_io_nodes(document, drives, list(axes_of(drives))),
        *check_places(document, drives),
        *_load(document, drives),
        *_times(document, drives),
        *_forgiving(document, drives),
        *_guarded(document, drives),
        *_milliseconds(document, drives),
        *_axes(document, drives),
        *check_profile_pdos(document, drives.profile_pdos, _images(drives)),
        *check_pdos(document, _named_images(drives), _io_pdos(drives)),
        *check_emergencies(
            document,
            drives.emergencies,
            chain(
                ((path, axis.emergencies) for path, _, axis in axes_of(drives)),
                ((("io_nodes", name), io.emergencies) for name, io in drives.io_nodes.items()),
            ),
        ),
        *check_objects(document, list(axes_of(drives)), drives.bus.bitrate),
        *check_known_drives(document, list(axes_of(drives))),
        *check_outputs(document, drives),
        *(
            problem
            for name, io in drives.io_nodes.items()
            for problem in _waived(document, ("io_nodes", name), io.waive, IO_OPTIONAL_OBJECTS, "node")
        ),
    ]


def _interface(document: Document, drives: DrivesFile) -> Iterator[Problem]:
    if drives.bus.interface not in VALID_INTERFACES:
        known = ", ".join(sorted(VALID_INTERFACES))
        yield document.problem(("bus", "interface"), repr(drives.bus.interface), f"one of python-can's: {known}")


def _empty(document: Document, drives: DrivesFile) -> Iterator[Problem]:
    mappings: list[KeyPath] = [("robots",), *(("robots", robot, "axes") for robot in drives.robots)]
    for path in mappings:
        if not document.keys(path):
            yield document.problem(path, "an empty mapping", "one or more")


def _images(drives: DrivesFile) -> list[ProcessImage]:
    return [image for _, _, image in _named_images(drives)]


def _named_images(drives: DrivesFile) -> list[Named]:
    return [(path, who, image_of(drives.axis(str(path[1]), str(path[-1])))) for path, who, _ in axes_of(drives)]


def _io_pdos(drives: DrivesFile) -> list[tuple[str, Pdo]]:
    images = {name: io_image_of(io.settings(name, 0, {})) for name, io in drives.io_nodes.items()}
    return [(f"I/O node {name}", pdo) for name, image in images.items() for pdo in image.pdos]


def _load(document: Document, drives: DrivesFile) -> Iterator[Problem]:
    io_nodes = [io_image_of(io.settings(name, 0, {})) for name, io in drives.io_nodes.items()]
    images: list[ProcessImage | IoImage] = [*_images(drives), *io_nodes]
    load = bus_load(images, drives.bus.bitrate, drives.cycle_s, drives.heartbeat_producer_s)
    if not load.high:
        return
    also = f" and {len(io_nodes)} I/O nodes" if io_nodes else ""
    found = (
        f"a bus load of {100 * load.total:.0f} % ({len(images) - len(io_nodes)} axes{also} every "
        f"{1000 * drives.cycle_s:g} ms at {drives.bus.bitrate // 1000} kbit/s: {100 * load.cyclic:.0f} % with "
        f"worst-case stuffing, and {100 * KEPT_FREE:.0f} % kept for SDO and EMCY)"
    )
    if load.refused:
        yield document.problem(("cycle_s",), found, f"up to {100 * REFUSE_ABOVE:.0f} %")
    else:
        allowed = f"up to {100 * REFUSE_ABOVE:.0f} %, advised up to {100 * WARN_ABOVE:.0f} %"
        yield document.problem(("cycle_s",), found, allowed, severity=Severity.WARNING)


def _times(document: Document, drives: DrivesFile) -> Iterator[Problem]:
    heartbeat = drives.heartbeat_producer_s + drives.overrun_limit_s
    boot = max(drives.heartbeat_producer_s + _START_CYCLES * drives.cycle_s, drives.sdo_timeout_s)
    rules = (
        ("overrun_limit_s", drives.overrun_limit_s >= drives.cycle_s, f"cycle_s, {drives.cycle_s:g}, or more"),
        (
            "heartbeat_timeout_s",
            drives.heartbeat_timeout_s > heartbeat,
            f"more than {heartbeat:g}: heartbeat_producer_s, {drives.heartbeat_producer_s:g}, and overrun_limit_s, "
            f"{drives.overrun_limit_s:g}, by which the gateway may be late",
        ),
        (
            "tpdo_timeout_s",
            drives.tpdo_timeout_s >= 2 * drives.cycle_s,
            f"{2 * drives.cycle_s:g} or more, two cycles",
        ),
        (
            "boot_timeout_s",
            drives.boot_timeout_s > boot,
            f"more than {boot:g}: sdo_timeout_s, {drives.sdo_timeout_s:g}, and heartbeat_producer_s, "
            f"{drives.heartbeat_producer_s:g}, with {_START_CYCLES} cycles",
        ),
    )
    for name, holds, allowed in rules:
        if not holds:
            yield document.problem((name,), f"{getattr(drives, name):g}", allowed)


def _forgiving(document: Document, drives: DrivesFile) -> Iterator[Problem]:
    """Simulated drives on a busy computer need a patience that real ones must not have."""
    real = drives.bus.interface not in _NO_REAL_BUS and not drives.bus.channel.startswith("vcan")
    if real and drives.overrun_limit_s > _LATEST_S:
        found = f"{drives.overrun_limit_s:g} on a bus of real drives: the gateway may be late for so long"
        yield document.problem(("overrun_limit_s",), found, "0.02 advised", severity=Severity.WARNING)


def _guarded(document: Document, drives: DrivesFile) -> Iterator[Problem]:
    """A guarded node counts polls (100Dh, 8 bits), and may lose one of them."""
    polls = drives.heartbeat_timeout_s / drives.heartbeat_producer_s
    ways = {axis.error_control for _, _, axis in axes_of(drives)}
    guarded = "guarding" in ways | {io.error_control for io in drives.io_nodes.values()}
    if guarded and not 2 <= round(polls, 6) <= 255:
        allowed = f"2 to 255 times heartbeat_producer_s, {drives.heartbeat_producer_s:g}, for nodes that are guarded"
        yield document.problem(("heartbeat_timeout_s",), f"{drives.heartbeat_timeout_s:g}", allowed)


def _milliseconds(document: Document, drives: DrivesFile) -> Iterator[Problem]:
    """Drives take these times as 16-bit milliseconds."""
    times: list[tuple[KeyPath, float]] = [((name,), getattr(drives, name)) for name in MILLISECOND_FIELDS]
    times += [((*path, "following_time_s"), axis.following_time_s) for path, _, axis in axes_of(drives)]
    for path, value in times:
        if not 1 <= round(value * 1000) <= UINT16_MAX:
            yield document.problem(path, f"{value:g}", f"0.001 to {UINT16_MAX / 1000:g}, 16 bits of milliseconds")


def _axes(document: Document, drives: DrivesFile) -> Iterator[Problem]:
    for path, _, axis in axes_of(drives):
        if axis.linear != (axis.feed is not None):
            feed = "no feed" if axis.feed is None else f"the feed {document.found((*path, 'feed'))}"
            allowed = "a feed for a linear axis, none for a rotary one"
            yield document.problem((*path, "type"), f"{axis.type} and {feed}", allowed)
        if axis.quick_stop <= axis.acceleration:
            found = document.found((*path, "quick_stop"))
            limit = document.found((*path, "acceleration"))
            yield document.problem((*path, "quick_stop"), found, f"more than this axis' acceleration, {limit}")
        counts = abs(axis.counts_per_unit())
        yield from _limits(document, path, axis)
        yield from _limit_switches(document, path, axis)
        yield from _endless(document, path, axis, drives.tpdo_timeout_s)
        yield from _inputs(document, path, axis)
        yield from _homing(document, path, axis)
        yield from _encoder(document, path, axis)
        yield from _torque(document, path, axis)
        if axis.interpolation and axis.mode != "interpolated":
            found = f"{axis.interpolation} beside mode {axis.mode}"
            yield document.problem((*path, "interpolation"), found, "mode: interpolated beside it")
        yield from _waived(document, path, axis.waive, OPTIONAL_OBJECTS)
        yield from _whole_units(document, path, axis)
        for name, bound in (("quick_stop", UINT32_MAX), ("following_window", UINT32_MAX), ("speed", FASTEST_COUNTS)):
            if getattr(axis, name) * counts > bound:
                most = declared(document, bound / counts, axis.linear)
                allowed = f"{most:g} or less, 32 bits of encoder counts"
                yield document.problem((*path, name), document.found((*path, name)), allowed)


def _homing(document: Document, path: KeyPath, axis: AxisEntry) -> Iterator[Problem]:
    if axis.homing is None:
        if axis.encoder == "incremental":
            yield document.problem((*path, "encoder"), "incremental without homing", "homing beside it, or absolute")
        return
    speed, acceleration = SETUP_SHARE * axis.speed, SETUP_SHARE * axis.acceleration
    for name, most, share in (
        ("fast", speed, ", a quarter of this axis' speed"),
        ("slow", axis.homing.fast, ""),
        ("acceleration", acceleration, ", a quarter of this axis' acceleration"),
    ):
        if getattr(axis.homing, name) > most:
            found = document.found((*path, "homing", name))
            allowed = f"{declared(document, most, axis.linear):g} or less{share}"
            yield document.problem((*path, "homing", name), found, allowed)


def _whole_units(document: Document, path: KeyPath, axis: AxisEntry) -> Iterator[Problem]:
    """A drive takes whole numbers of its units, 32 bits of them."""
    units, counts = axis.units(), abs(axis.counts_per_unit())
    if not axis.try_units:
        allowed = "only for a drive without mode profile velocity: a wrong unit is seen at full speed then, not before"
        yield document.problem(
            (*path, "try_units"), "a drive whose units are not tried", allowed, severity=Severity.WARNING
        )
    stated: list[tuple[KeyPath, float, float, float, str]] = [
        (("quick_stop",), axis.quick_stop, units.acceleration, UINT32_MAX, units.acceleration_name),
        (("speed",), axis.speed, units.velocity, FASTEST_COUNTS, units.velocity_name),
    ]
    if axis.homing is not None:
        stated += [
            (("homing", "fast"), axis.homing.fast, units.velocity, UINT32_MAX, units.velocity_name),
            (("homing", "slow"), axis.homing.slow, units.velocity, UINT32_MAX, units.velocity_name),
            (("homing", "acceleration"), axis.homing.acceleration, units.acceleration, UINT32_MAX,
             units.acceleration_name),
        ]  # fmt: skip
    for key, value, unit, most, name in stated:
        if name.startswith("counts"):
            continue
        if not 1.0 <= value * counts / unit <= most:
            least, highest = (declared(document, bound * unit / counts, axis.linear) for bound in (1.0, most))
            allowed = f"{least:.4g} to {highest:.4g}: the drive takes whole numbers of {name}, 32 bits"
            yield document.problem((*path, *key), document.found((*path, *key)), allowed)


def _torque(document: Document, path: KeyPath, axis: AxisEntry) -> Iterator[Problem]:
    torque = axis.settings(str(path[-1])).torque
    if torque is None:
        if axis.feed_forward == "torque":
            allowed = "rated_torque_nm of the motor beside it, in whose per mille the drive takes torque"
            yield document.problem((*path, "feed_forward"), "torque without a rated torque", allowed)
        return
    fastest = UINT32_MAX / (MOTOR_SPEED_RESERVE * torque.rpm)
    if axis.speed > fastest:
        allowed = f"{declared(document, fastest, axis.linear):g} or less, 32 bits of motor turns per minute (6080h)"
        yield document.problem((*path, "speed"), document.found((*path, "speed")), allowed)


def _waived(
    document: Document,
    path: KeyPath,
    waive: Sequence[str],
    optional: Mapping[int, tuple[str, str]],
    what: str = "drive",
) -> Iterator[Problem]:
    own = document.value((*path, "waive")) is not None
    for number, index in enumerate(waive):
        name, cost = optional[int(index, 16)]
        found = f"a {what} that may lack {index}h ({name}): {cost}"
        allowed = f"only where the {what} has no such object and this is accepted"
        place = (*path, "waive", number) if own else (*path, "like")
        yield document.problem(place, found, allowed, severity=Severity.WARNING)


def _limits(document: Document, path: KeyPath, axis: AxisEntry) -> Iterator[Problem]:
    if axis.limits is None:
        return
    found = " to ".join(f"{declared(document, limit, axis.linear):g}" for limit in axis.limits)
    if axis.limits[0] >= axis.limits[1]:
        yield document.problem((*path, "limits"), found, "the lower one first")
        return
    lowest, highest = axis.settings(str(path[-1])).int32_range
    if axis.limits[0] < lowest or axis.limits[1] > highest:
        fits = " to ".join(f"{declared(document, bound, axis.linear):g}" for bound in (lowest, highest))
        yield document.problem((*path, "limits"), found, f"within {fits}, 32 bits of encoder counts")


def _endless(document: Document, path: KeyPath, axis: AxisEntry, unheard_s: float) -> Iterator[Problem]:
    """Its turn is a whole number of counts, or it would drift; it has no ends, and no turn passes unseen."""
    if not axis.endless:
        return
    place = (*path, "endless")
    ends = [name for name in ("limits", "limit_switches") if getattr(axis, name) is not None]
    if ends or axis.linear:
        found = f"an endless axis with {ends[0]}" if ends else "an endless axis that slides"
        yield document.problem(place, found, "a rotary axis without limits and limit_switches", at_key=True)
    turn = axis.counts_per_turn * axis.gear
    if abs(turn - round(turn)) > 1e-9 * turn or turn > INT32_MAX:
        found = f"{axis.counts_per_turn} counts times a gear of {axis.gear:g} in a turn"
        yield document.problem(place, found, f"a whole number of counts up to {INT32_MAX}", at_key=True)
    if axis.speed * unheard_s >= math.pi:
        allowed = f"{declared(document, math.pi / unheard_s):g} or less, half a turn within tpdo_timeout_s"
        yield document.problem((*path, "speed"), document.found((*path, "speed")), allowed)


def _limit_switches(document: Document, path: KeyPath, axis: AxisEntry) -> Iterator[Problem]:
    """Software limits do not go beyond the switches, and an axis that homes at a switch is told its place."""
    if axis.limit_switches is None:
        return
    place = (*path, "limit_switches")
    ends = axis.limit_switches
    found = " to ".join(f"{declared(document, end, axis.linear):g}" for end in ends)
    if ends[0] >= ends[1]:
        yield document.problem(place, found, "the lower one first")
        return
    if axis.limits is not None and not ends[0] <= axis.limits[0] < axis.limits[1] <= ends[1]:
        limits = " to ".join(f"{declared(document, limit, axis.linear):g}" for limit in axis.limits)
        yield document.problem(place, found, f"none within the limits, {limits}")
    if axis.homing is not None and axis.homing.method in HOMING_AT_LIMIT:
        home = ends[HOMING_AT_LIMIT[axis.homing.method] * axis.direction > 0]
        if not math.isclose(axis.homing.position, home):
            stated = document.found((*path, "homing", "position"))
            allowed = f"{declared(document, home, axis.linear):g}, where the limit switch is that homing finds"
            yield document.problem((*path, "homing", "position"), stated, allowed)
    if axis.inputs is not None and {0, 1} & {*axis.inputs.enable, *axis.inputs.door, *axis.inputs.estop}:
        yield document.problem((*path, "inputs"), "bit 0 or 1", "other bits: these are the limit switches", at_key=True)


def _inputs(document: Document, path: KeyPath, axis: AxisEntry) -> Iterator[Problem]:
    if axis.inputs is None:
        return
    bits = [*axis.inputs.enable, *axis.inputs.door, *axis.inputs.estop]
    twice = sorted({bit for bit in bits if bits.count(bit) > 1})
    if twice or not bits:
        found = f"bit {twice[0]} twice" if twice else "no bit"
        yield document.problem((*path, "inputs"), found, "one or more bits, each of them once", at_key=True)


def _encoder(document: Document, path: KeyPath, axis: AxisEntry) -> Iterator[Problem]:
    check, place = axis.encoder_check, (*path, "encoder_check")
    if axis.encoder == "incremental" and "encoder_check" in axis.model_fields_set:
        yield document.problem(place, "a check of an incremental encoder", "encoder: absolute", at_key=True)
    if check.window is not None:
        half_turn = 0.5 * axis.counts_per_turn / abs(axis.counts_per_unit())
        if check.window >= half_turn:
            allowed = f"less than {declared(document, half_turn, axis.linear):g}, half a turn of the motor"
            yield document.problem((*place, "window"), document.found((*place, "window")), allowed)
    if (check.status is None) != (check.battery_mask == 0):
        found = "no status" if check.status is None else "no battery_mask"
        yield document.problem(place, found, "both status and battery_mask, or none", at_key=True)


def axes_of(drives: DrivesFile) -> Iterator[tuple[KeyPath, str, AxisEntry]]:
    """Every axis of the file with its place and its name for people."""
    for robot, entry in drives.robots.items():
        for name, axis in entry.axes.items():
            yield ("robots", robot, "axes", name), f"{robot}.{name}", axis
