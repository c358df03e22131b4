"""Every state and every controlword against the table of transitions of CiA 402."""

import pytest

from drive_gateway.sim.drives.power_state import DriveState, command_of, commanded
from tests.unit.repository import vectors

S = DriveState
VECTORS = vectors("sdo_frames.json")

# Mask and value of bits 3 to 0 as the standard prints them, and what each command does: from -> to.
TABLE: list[tuple[int, int, dict[DriveState, DriveState]]] = [
    (0b0010, 0b0000, {  # disable voltage: 7, 10, 9, 12
        S.READY_TO_SWITCH_ON: S.SWITCH_ON_DISABLED,
        S.SWITCHED_ON: S.SWITCH_ON_DISABLED,
        S.OPERATION_ENABLED: S.SWITCH_ON_DISABLED,
        S.QUICK_STOP_ACTIVE: S.SWITCH_ON_DISABLED,
    }),
    (0b0110, 0b0010, {  # quick stop: 7, 10, 11
        S.READY_TO_SWITCH_ON: S.SWITCH_ON_DISABLED,
        S.SWITCHED_ON: S.SWITCH_ON_DISABLED,
        S.OPERATION_ENABLED: S.QUICK_STOP_ACTIVE,
    }),
    (0b0111, 0b0110, {  # shutdown: 2, 6, 8
        S.SWITCH_ON_DISABLED: S.READY_TO_SWITCH_ON,
        S.SWITCHED_ON: S.READY_TO_SWITCH_ON,
        S.OPERATION_ENABLED: S.READY_TO_SWITCH_ON,
    }),
    (0b1111, 0b0111, {  # switch on, disable operation: 3, 5
        S.READY_TO_SWITCH_ON: S.SWITCHED_ON,
        S.OPERATION_ENABLED: S.SWITCHED_ON,
    }),
    (0b1111, 0b1111, {  # enable operation: 3 (bit 3 does not matter there), 4, 16
        S.READY_TO_SWITCH_ON: S.SWITCHED_ON,
        S.SWITCHED_ON: S.OPERATION_ENABLED,
        S.QUICK_STOP_ACTIVE: S.OPERATION_ENABLED,
    }),
]  # fmt: skip


def expected(state: DriveState, controlword: int, stays: bool) -> DriveState:
    [moves] = [moves for mask, value, moves in TABLE if controlword & mask == value]
    target = moves.get(state, state)
    if state is S.QUICK_STOP_ACTIVE and target is S.OPERATION_ENABLED and not stays:
        return state
    return target


@pytest.mark.parametrize("stays", [False, True])
@pytest.mark.parametrize("state", list(DriveState))
def test_every_controlword_leads_where_the_standard_says(state: DriveState, stays: bool) -> None:
    found = {word: commanded(state, command_of(word), stays) for word in range(0x200)}
    assert found == {word: expected(state, word, stays) for word in range(0x200)}


@pytest.mark.parametrize(("name", "word"), VECTORS["statuswords"].items())
def test_state_shows_itself_in_the_statusword(name: str, word: str) -> None:
    assert int(word, 16) & 0x6F == DriveState[name].value
