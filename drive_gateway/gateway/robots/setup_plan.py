"""From an operator's wish in set-up to orders for the drives, or to the reason why not."""

from collections.abc import Sequence
from math import degrees

from cell.messages import Home, MoveAxes, PressAxis
from drive_gateway.cia402.profile import together
from drive_gateway.cia402.setup_objects import (
    Press,
    SetupOrder,
    homing_order,
    position_order,
    press_order,
    velocity_order,
)
from drive_gateway.config.settings import INT32_MAX, INT32_MIN, SETUP_SHARE, AxisSettings
from drive_gateway.errors import GatewayError
from drive_gateway.gateway.drives.drive import Drive
from drive_gateway.gateway.robots.group import DriveGroup
from drive_gateway.gateway.setup.setup_motion import SetupMotion
from drive_gateway.gateway.watch.limit_switches import limit_switches

LONGEST_PRESS_S = 60.0
FARTHEST_PRESS = 0.2
"""[rad or m] that an axis may give way."""

Plan = tuple[SetupMotion, Sequence[Drive]]
SetupCall = Home | MoveAxes | PressAxis


class SetupRefused(GatewayError):
    """A set-up motion that cannot be; the text says what is allowed."""


def planned(group: DriveGroup, call: SetupCall, now: float) -> Plan:
    """The motion that a call asks for, which has told the drives nothing yet. Raises `SetupRefused`."""
    problem = group.permits.setup()
    if problem:
        raise SetupRefused(problem)
    match call:
        case Home():
            return homing_motion(group, call.axes, now)
        case PressAxis():
            return press_motion(group, call, now)
        case MoveAxes():
            return move_motion(group, call, now)


def homing_motion(group: DriveGroup, names: Sequence[str], now: float) -> Plan:
    """Homing of the named axes (none: all that have a homing), one order number after another.

    Raises:
        SetupRefused: an axis does not exist or cannot home.
    """
    chosen = _nodes(group, names) if names else [node for node in group.nodes if node.axis.homing is not None]
    orders: dict[int, list[tuple[Drive, SetupOrder]]] = {}
    for node in chosen:
        homing = node.axis.homing
        if homing is None:
            raise SetupRefused(f"{node.label} has no homing in the drives file; its absolute encoder needs none")
        orders.setdefault(homing.order, []).append((node, homing_order(node.axis, homing)))
    if not orders:
        raise SetupRefused(f"no axis of {group.robot} has a homing in the drives file; absolute encoders need none")
    groups = [orders[number] for number in sorted(orders)]
    what = f"homing of {group.robot} ({', then '.join(_names([node for node, _ in part]) for part in groups)})"
    return SetupMotion(what, groups, now), chosen


def move_motion(group: DriveGroup, call: MoveAxes, now: float) -> Plan:
    """All axes of the call from rest to rest in the same time.

    Raises:
        SetupRefused: unknown axis, speed outside 0 to 1, an absolute target of an axis that is not referenced, a target
            outside the drive's counts or the limits, or a way into a limit switch.
    """
    nodes = _nodes(group, list(call.targets))
    if not nodes or not 0.0 < call.speed <= 1.0:
        raise SetupRefused(f"{len(nodes)} axes at speed {call.speed:g}; allowed are one or more, above 0 and up to 1")
    lost = [node for node in nodes if not node.reference.known]
    if lost and not call.relative:
        raise SetupRefused(f"{_names(lost)} of {group.robot} not referenced; home first, or move by a distance")
    distances = [
        call.targets[node.axis.name] - (0.0 if call.relative else group.watch.position[group.nodes.index(node)])
        for node in nodes
    ]
    for node, distance in zip(nodes, distances, strict=True):
        _keep_range(node, distance)
    share = SETUP_SHARE * call.speed
    ramps = [SETUP_SHARE * node.axis.acceleration for node in nodes]
    motions = together(distances, [share * node.axis.speed for node in nodes], ramps)
    orders = []
    for node, distance, motion, ramp in zip(nodes, distances, motions, ramps, strict=True):
        target = (node.counts or 0) + round(distance * node.axis.counts_per_unit)
        if node.axis.modulus:
            _keep_turn(node, distance, call.by_velocity)
        elif not INT32_MIN <= target <= INT32_MAX:
            raise SetupRefused(f"{node.label}: {target} counts; allowed are 32 bits")
        _keep_limits(node.axis, node.reference.known, group.watch.position[group.nodes.index(node)] + distance)
        _leave_switches(node, distance * node.axis.counts_per_unit, now)
        if call.by_velocity:
            try:
                orders.append((node, velocity_order(node.axis, motion, ramp)))
            except ValueError as error:
                raise SetupRefused(f"{error}; go faster, or by position") from None
        else:
            orders.append((node, position_order(node.axis, target, motion, ramp)))
    kind = "profile velocity" if call.by_velocity else "profile position"
    return SetupMotion(f"{kind} of {group.robot} ({_names(nodes)})", [orders], now), nodes


def press_motion(group: DriveGroup, call: PressAxis, now: float) -> Plan:
    """One axis gives a torque, and is switched off afterwards.

    Raises:
        SetupRefused: unknown axis, one whose motor's rated torque nobody knows, a robot that is not referenced, a
            torque, time or way out of range, or a torque towards an active limit switch.
    """
    (node,) = _nodes(group, [call.axis])
    torque = node.axis.torque
    if torque is None:
        raise SetupRefused(f"{node.label} has no rated_torque_nm in the drives file, and so takes no torque")
    lost = [other for other in group.nodes if not other.reference.known]
    if lost:
        raise SetupRefused(
            f"{_names(lost)} of {group.robot} not referenced; home first: what carries the robot depends on where it is"
        )
    unit, factor = _unit(node.axis)
    most = 1000.0 / abs(torque.per_mille)
    if not 0.0 < abs(call.torque) <= most:
        found = f"{call.torque:g} {'N' if node.axis.linear else 'Nm'}"
        raise SetupRefused(
            f"{node.axis.name} with {found}; allowed is up to {most:.4g}, its motor's rated torque, not 0"
        )
    if not (0.0 < call.seconds <= LONGEST_PRESS_S and 0.0 < call.within <= FARTHEST_PRESS):
        found = f"{call.seconds:g} s within {factor * call.within:.4g} {unit}"
        allowed = f"above 0, up to {LONGEST_PRESS_S:g} s and {factor * FARTHEST_PRESS:.4g} {unit}"
        raise SetupRefused(f"{node.axis.name} for {found}; allowed are {allowed}")
    press = Press(
        per_mille=round(call.torque * torque.per_mille),
        hold_s=call.seconds,
        within=call.within * abs(node.axis.counts_per_unit),
        allowed=f"{factor * call.within:.4g} {unit}",
    )
    _leave_switches(node, press.per_mille, now)
    order = press_order(torque, SETUP_SHARE * node.axis.speed, press)
    return SetupMotion(f"torque of {group.robot} ({node.axis.name})", [[(node, order)]], now), [node]


def _keep_range(node: Drive, distance: float) -> None:
    """A way is judged before anything is computed with it."""
    unit, factor = _unit(node.axis)
    most = (INT32_MAX - INT32_MIN) / abs(node.axis.counts_per_unit)
    if not abs(distance) <= most:
        found = f"{factor * distance:.6g} {unit}"
        raise SetupRefused(f"{node.axis.name} would go by {found}; allowed are {factor * most:.6g}, 32 bits of counts")


def _unit(axis: AxisSettings) -> tuple[str, float]:
    """For people, and what it is of SI."""
    return ("mm", 1000.0) if axis.linear else ("deg", degrees(1.0))


def _keep_limits(axis: AxisSettings, referenced: bool, position: float) -> None:
    """An axis that is not referenced has no limits yet."""
    if axis.limits is None or not referenced or axis.limits[0] <= position <= axis.limits[1]:
        return
    unit, factor = _unit(axis)
    low, high = (f"{factor * limit:.6g}" for limit in axis.limits)
    raise SetupRefused(f"{axis.name} would go to {factor * position:.6g} {unit}; allowed are {low} to {high}")


def _keep_turn(node: Drive, distance: float, by_velocity: bool) -> None:
    """An endless axis goes to a position the shorter way round."""
    half = node.axis.modulus / 2 / abs(node.axis.counts_per_unit)
    if not by_velocity and abs(distance) >= half:
        allowed = (
            "less than half a turn of an endless axis, which goes the shorter way; move in steps, or by --velocity"
        )
        raise SetupRefused(f"{node.axis.name} would turn by {degrees(distance):.6g} deg; allowed is {allowed}")


def _leave_switches(node: Drive, way: float, now: float) -> None:
    """An axis at a limit switch may only go away from it."""
    for switch in limit_switches([node], now):
        if switch.forbids(way):
            raise SetupRefused(f"{switch.text}; {switch.remedy}")


def _nodes(group: DriveGroup, names: Sequence[str]) -> list[Drive]:
    by_name = {node.axis.name: node for node in group.nodes}
    unknown = [name for name in names if name not in by_name]
    if unknown:
        raise SetupRefused(f"{group.robot} has no axis {unknown[0]}; its axes are {', '.join(by_name)}")
    return [by_name[name] for name in names]


def _names(nodes: Sequence[Drive]) -> str:
    return ", ".join(node.axis.name for node in nodes)
