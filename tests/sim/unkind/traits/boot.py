"""Drives that take their time, or start when nobody asked."""

from drive_gateway.canopen.cob_id import ERROR_CONTROL, SDO_FROM_NODE, function_code
from drive_gateway.canopen.frame import CanFrame
from drive_gateway.canopen.nmt import NmtState
from drive_gateway.sim.drives.drive import CONTROLWORD
from drive_gateway.sim.drives.power_state import DriveState
from drive_gateway.sim.nodes.node import SimulatedNode
from drive_gateway.sim.services.abort import Abort, AccessRefused
from tests.sim.unkind.traits.habits import answers_late, refuses, sends
from tests.sim.unkind.traits.trait import Trait

_POWER_ON_S, _RESET_S = 30.0, 2.5
_SLOW_S, _TOO_SLOW_S = 0.1, 0.8
_BUSY_S = 0.6
_CHARGING_S = 4.0
_SAG_S = 0.2
_ENABLE_VOLTAGE, _SWITCH_ON = 0x02, 0x07


def _half_a_minute(node: SimulatedNode) -> None:
    node.boot_s = lambda power_on: _POWER_ON_S if power_on else 0.02


def _slow_reset(node: SimulatedNode) -> None:
    node.boot_s = lambda _power_on: _RESET_S


def _no_boot_up(node: SimulatedNode) -> None:
    def without(frames: list[CanFrame], _now: float) -> list[CanFrame]:
        return [frame for frame in frames if not (function_code(frame.id) == ERROR_CONTROL and frame.data == b"\0")]

    sends(node, without)


def _busy(node: SimulatedNode) -> None:
    """For a while after its boot-up it stores nothing."""
    up_at = 0.0

    def look(frames: list[CanFrame], now: float) -> list[CanFrame]:
        nonlocal up_at
        if node.nmt is NmtState.BOOT_UP or up_at == 0.0:
            up_at = now
        return frames

    sends(node, look)
    refuses(node, 0x1017, 0, Abort.DEVICE_STATE, lambda _value: node.now - up_at < _BUSY_S)


def _first_answer_lost(node: SimulatedNode) -> None:
    """Its first answer is lost."""
    left = 1

    def lossy(frames: list[CanFrame], _now: float) -> list[CanFrame]:
        nonlocal left
        answer = next((frame for frame in frames if function_code(frame.id) == SDO_FROM_NODE), None)
        if answer is None or not left:
            return frames
        left -= 1
        return [frame for frame in frames if frame is not answer]

    sends(node, lossy)


def _slow_dc_link(node: SimulatedNode) -> None:
    """Its DC link is charged from the first shutdown command on, and discharged without voltage."""
    since: float | None = None

    def charged(word: int) -> None:
        nonlocal since
        if not word & _ENABLE_VOLTAGE:
            since = None
        elif since is None:
            since = node.now
        if word & _SWITCH_ON == _SWITCH_ON and (since is None or node.now - since < _CHARGING_S):
            raise AccessRefused(Abort.DEVICE_STATE)

    node.objects.guard(CONTROLWORD, charged)


def _supply_sags(node: SimulatedNode) -> None:
    """Its logic supply fails a moment after its motor got current."""
    since: float | None = None

    def sag(frames: list[CanFrame], now: float) -> list[CanFrame]:
        nonlocal since
        if node.state is not DriveState.OPERATION_ENABLED:
            since = None
        elif since is None:
            since = now
        elif now - since > _SAG_S:
            since = None
            node.power_cycle()
        return frames

    sends(node, sag)


BOOT = (
    Trait(
        "starts_in_half_a_minute",
        "Sends its boot-up 30 s after power-on, and hears nothing before.",
        "CiA 301, NMT state machine: no time is prescribed for Initialisation; ros2_canopen issue 370: boot time-outs "
        "of 20 s were needed",
        _half_a_minute,
    ),
    Trait(
        "slow_reset",
        "Sends its boot-up 2.5 s after a reset of its communication, and hears nothing before.",
        "CiA 301, NMT state machine: no time is prescribed for Reset communication",
        _slow_reset,
    ),
    Trait(
        "no_boot_up",
        "Sends no boot-up message after a reset of its communication.",
        "DS-301 V3.0, which had no boot-up message; it came with V4.0",
        _no_boot_up,
    ),
    Trait(
        "busy_after_boot_up",
        "Refuses to store anything (08000022h) for 0.6 s after its boot-up.",
        "CiA 301, SDO abort codes: 08000022h, cannot be stored because of the present device state",
        _busy,
    ),
    Trait(
        "first_answer_lost",
        "Does not answer the first SDO after its start.",
        "ros_canopen issue 347: the first SDO of a start times out, the second start works",
        _first_answer_lost,
    ),
    Trait(
        "slow_sdo",
        "Answers each SDO after 0.1 s.",
        "CiA 301, SDO: no time is prescribed for the answer; canopen issue 25: 0.3 s were needed",
        lambda node: answers_late(node, _SLOW_S),
    ),
    Trait(
        "very_slow_sdo",
        "Answers each SDO after 0.8 s.",
        "CANopenSTM32 issue 89: answers to writes take close to 1 s",
        lambda node: answers_late(node, _TOO_SLOW_S),
    ),
    Trait(
        "slow_dc_link",
        "Charges its DC link for 4 s before it is Switched On, and discharges it without voltage.",
        "KEB COMBIVERT F6 manual, state machine: Switched On is only reached with voltage at the power unit, and not "
        "while the DC link is charged",
        _slow_dc_link,
    ),
    Trait(
        "restarts_under_load",
        "Starts anew 0.2 s after operation was enabled, because its supply sags.",
        "CiA 301, NMT: after power-on a node sends its boot-up and is Pre-operational, whatever it was before",
        _supply_sags,
    ),
)
"""Habits with starting."""
