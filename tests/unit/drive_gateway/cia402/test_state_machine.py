"""Statuswords, and the one transition that is commanded next."""

import pytest

from cell.messages import AxisStatus
from drive_gateway.cia402.state_machine import controlword, decode
from tests.unit.repository import vectors

S = AxisStatus
VECTORS = vectors("canopen_frames.json")["statuswords"]

# The transitions of CiA 402 by command, as a table of its own.
RESULT_OF = {
    (S.SWITCH_ON_DISABLED, 0x06): S.READY_TO_SWITCH_ON,
    (S.READY_TO_SWITCH_ON, 0x07): S.SWITCHED_ON,
    (S.SWITCHED_ON, 0x0F): S.OPERATION_ENABLED,
    (S.OPERATION_ENABLED, 0x07): S.SWITCHED_ON,
    (S.SWITCHED_ON, 0x06): S.READY_TO_SWITCH_ON,
    (S.READY_TO_SWITCH_ON, 0x00): S.SWITCH_ON_DISABLED,
    (S.OPERATION_ENABLED, 0x00): S.SWITCH_ON_DISABLED,
    (S.SWITCHED_ON, 0x00): S.SWITCH_ON_DISABLED,
    (S.OPERATION_ENABLED, 0x02): S.QUICK_STOP_ACTIVE,
    (S.QUICK_STOP_ACTIVE, 0x00): S.SWITCH_ON_DISABLED,
}
POWER_STATES = (S.SWITCH_ON_DISABLED, S.READY_TO_SWITCH_ON, S.SWITCHED_ON, S.OPERATION_ENABLED, S.QUICK_STOP_ACTIVE)


def path(start: AxisStatus, target: AxisStatus) -> list[AxisStatus]:
    states = [start]
    while states[-1] is not target and len(states) < 8:
        states.append(RESULT_OF.get((states[-1], controlword(states[-1], target)), states[-1]))
    return states


@pytest.mark.parametrize("vector", VECTORS, ids=lambda vector: vector["word"])
def test_printed_statuswords_decode(vector: dict[str, str]) -> None:
    assert decode(int(vector["word"], 16)) is S[vector["state"]]


def test_only_24_of_the_128_low_patterns_are_states() -> None:
    assert sum(decode(bits) is not None for bits in range(128)) == 24


def test_without_voltage_the_ambiguous_fault_pattern_is_the_fault_itself() -> None:
    assert decode(0x020F) is S.FAULT


def test_enabling_goes_through_every_state_one_transition_at_a_time() -> None:
    assert path(S.SWITCH_ON_DISABLED, S.OPERATION_ENABLED) == [
        S.SWITCH_ON_DISABLED,
        S.READY_TO_SWITCH_ON,
        S.SWITCHED_ON,
        S.OPERATION_ENABLED,
    ]


@pytest.mark.parametrize("start", POWER_STATES)
@pytest.mark.parametrize("target", [S.SWITCH_ON_DISABLED, S.SWITCHED_ON, S.OPERATION_ENABLED])
def test_every_power_state_leads_to_every_target(start: AxisStatus, target: AxisStatus) -> None:
    assert path(start, target)[-1] is target


@pytest.mark.parametrize("target", [S.SWITCH_ON_DISABLED, S.SWITCHED_ON, S.QUICK_STOP_ACTIVE])
def test_operation_enabled_is_never_left_by_taking_the_voltage_away(target: AxisStatus) -> None:
    assert controlword(S.OPERATION_ENABLED, target) & 0x02


@pytest.mark.parametrize("status", [S.FAULT, S.FAULT_REACTION_ACTIVE, S.NOT_READY_TO_SWITCH_ON])
@pytest.mark.parametrize("target", POWER_STATES[:1] + POWER_STATES[2:])
def test_a_fault_is_neither_reset_nor_enabled_on_the_way(status: AxisStatus, target: AxisStatus) -> None:
    assert controlword(status, target) == 0x0000


def test_a_silent_drive_is_told_to_stop() -> None:
    assert controlword(S.SILENT, S.QUICK_STOP_ACTIVE) == 0x0002
