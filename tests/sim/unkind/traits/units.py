"""Units in which real drives take velocities and accelerations."""

from collections.abc import Callable

from drive_gateway.canopen.frame import CanFrame
from drive_gateway.sim.drives.drive import Drive
from drive_gateway.sim.nodes.node import SimulatedNode
from drive_gateway.sim.services.dictionary import key_of
from tests.sim.unkind.traits.habits import number, sends
from tests.sim.unkind.traits.trait import Trait

COUNTS_PER_TURN = 10_000
"""Of a motor whose encoder has no index pulse, where nothing says it."""
SI_VELOCITY_RPM = 0x00B44700
"""60A9h: revolutions per minute."""


def _per_turn(drive: Drive) -> float:
    return drive.reference.switches.index or COUNTS_PER_TURN


def _velocity(per_minute: float) -> Callable[[SimulatedNode], None]:
    def give(node: SimulatedNode) -> None:
        for drive in node.drives:
            drive.units.velocity = _per_turn(drive) * per_minute / 60.0

    return give


def _rpm_and_says_so(node: SimulatedNode) -> None:
    _velocity(1.0)(node)
    for drive in node.drives:
        drive.units.acceleration = _per_turn(drive) / 60.0
    node.add_object(0x60A9, "SI unit velocity", SI_VELOCITY_RPM, writable=True)


def _velocity_factor(node: SimulatedNode) -> None:
    numerator, divisor = key_of(0x6096, 1), key_of(0x6096, 2)
    per_turn = round(_per_turn(node.drives[0]))
    node.objects.declare(number(0x6096, 1, "I", 60, "Velocity factor, numerator"))
    node.objects.declare(number(0x6096, 2, "I", per_turn, "Velocity factor, divisor"))
    numbers = node.objects.numbers

    def scaled(frames: list[CanFrame], _now: float) -> list[CanFrame]:
        for drive in node.drives:
            drive.units.velocity = numbers[divisor] / max(1, numbers[numerator])
        return frames

    sends(node, scaled)


def _degrees_per_s2(node: SimulatedNode) -> None:
    for drive in node.drives:
        drive.units.acceleration = _per_turn(drive) / 360.0


def _tenths_of_rpm_per_s(node: SimulatedNode) -> None:
    _velocity(1.0)(node)
    for drive in node.drives:
        drive.units.acceleration = _per_turn(drive) / 600.0


def _turned_velocity(node: SimulatedNode) -> None:
    for drive in node.drives:
        drive.units.velocity_sign = -1.0


UNITS = (
    Trait(
        "speeds in rpm",
        "6081h, 6099h, 60B1h and 60FFh are turns of the motor per minute, and nothing on the bus says so.",
        "Roboteq, CANbus Networking Manual, object 6081h: profile velocity in RPM",
        _velocity(1.0),
    ),
    Trait(
        "speeds in rpm, as 60A9h says",
        "Speeds are in rpm and accelerations in rpm/s; 60A9h shows 00B44700h.",
        "Nanotec, PD6-C CANopen manual, object 60A9h: preset value 00B44700h, rpm; Synapticon, SOMANET object 60A9h: "
        "rpm is the default, accelerations are in rpm/s",
        _rpm_and_says_so,
    ),
    Trait(
        "speeds by a velocity factor",
        "Speeds are counts/s times 6096h:01 / 6096h:02, which is 60 / counts per turn (rpm) from its factory.",
        "Kollmorgen, AKD2G CANopen manual, object 6096h: the factor scales position units per second; 60 and the "
        "increments of a turn for rpm",
        _velocity_factor,
    ),
    Trait(
        "speeds in 0.0001 rpm",
        "6081h, 6099h, 60B1h and 60FFh are ten-thousandths of a turn of the motor per minute.",
        "Beckhoff, AMP8000 and AX8000 object descriptions, 60FFh and 60B1h: default scaling 0.0001 rpm",
        _velocity(1e-4),
    ),
    Trait(
        "accelerations in deg/s^2",
        "6083h, 6084h, 6085h and 609Ah are degrees of the motor per second squared.",
        "CiA 402-2, SI unit acceleration 60AAh, whose numerator may be degrees (41h of CiA 303-2)",
        _degrees_per_s2,
    ),
    Trait(
        "accelerations in 0.1 rpm/s",
        "Speeds are in rpm; 6083h and 6084h are tenths of a turn per minute in each second.",
        "Roboteq, CANbus Networking Manual, objects 6083h and 6084h: (RPM*10)/second",
        _tenths_of_rpm_per_s,
    ),
    Trait(
        "velocities against positions",
        "A positive 60FFh lowers 6064h.",
        "CiA 402-2, polarity 607Eh: bit 6 turns velocities and bit 7 positions, each by itself",
        _turned_velocity,
    ),
)
