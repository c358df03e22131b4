"""Habits of real drives in homing, in moves of their own, at rest and in a fault."""

from drive_gateway.sim.nodes.node import SimulatedNode
from tests.sim.unkind.traits.trait import Trait

LATE_S = 0.02
REACHED_LASTS_S = 0.06
HUNTS_BY = 26
"""[counts]"""


def _keep_homing_bits(node: SimulatedNode) -> None:
    for drive in node.drives:
        drive.setup.homing.keeps_result = True


def _send_late(node: SimulatedNode) -> None:
    node.delay_tpdos(LATE_S)


def _keep_target_reached(node: SimulatedNode) -> None:
    for drive in node.drives:
        drive.setup.reached_lasts_s = REACHED_LASTS_S


def _coast(node: SimulatedNode) -> None:
    for drive in node.drives:
        drive.obeys_in_reaction = True


def _hunt(node: SimulatedNode) -> None:
    for drive in node.drives:
        drive.shown.hunts_by = HUNTS_BY


HOMING = (
    Trait(
        "homing bits stay",
        "Statusword bits 12 (homing attained) and 13 (homing error) keep the outcome of the last homing, until the "
        "next one begins.",
        "python canopen, pull request 248: is_homed() switches to homing mode only to read the bits of an earlier "
        "homing, which drives keep; CiA 402-2, homing mode, clears them when the start bit rises",
        _keep_homing_bits,
    ),
    Trait(
        "late statusword",
        "What a SYNC asks for is sent 20 ms after it.",
        "python canopen, pull request 252: a statusword that is looked at right after homing was started is an old "
        "one, because of the time until the TPDO is sent; the library waits 100 ms",
        _send_late,
    ),
    Trait(
        "target reached stays",
        "In profile position bit 10 (target reached) still says of the set point before that it was reached, for "
        "60 ms after a new one was acknowledged.",
        "CiA 402-2, profile position mode: bit 10 is judged by position window and window time (6067h, 6068h), and "
        "the handshake of bit 12 does not wait for it",
        _keep_target_reached,
    ),
    Trait(
        "coasts at disable voltage in its reaction to a fault",
        "It takes its voltage off when it is told 0000h while it brakes in Fault Reaction Active.",
        "CiA 402-2, power drive state machine: disable voltage switches the power stage off; that a drive in Fault "
        "Reaction Active goes on braking is said of its own reaction (605Eh), not of commands that come meanwhile",
        _coast,
    ),
    Trait(
        "hunts at rest",
        "While it is controlled its position goes up and down by 26 counts every 80 ms.",
        "limit cycle of a position loop with integral action and static friction: Armstrong-Helouvry, Dupont and "
        "Canudas de Wit, Automatica 30 (1994), survey of the control of machines with friction",
        _hunt,
    ),
)
