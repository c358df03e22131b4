"""Every state of CiA 402 and every event, against tables: the drive's answer, and the master's command."""

from collections.abc import Callable

import pytest

from cell.messages import AxisStatus
from drive_gateway.cia402.state_machine import controlword
from drive_gateway.sim.drives.power_state import DriveState
from tests.unit.sim_drive_world import Bench

S = DriveState
A = AxisStatus
SPEED = 5_000.0
STATES = list(DriveState)
"""Not ready, disabled, ready, switched on, enabled, quick stop, fault reaction, fault: the columns of the tables."""
_N, _D, _R, _O, _E, _Q, _X, _F = STATES

# What follows from each event in each state (CiA 402-2, transitions 2 to 16; 605Ah = 6, 6007h = 3).
EVENTS: dict[str, list[DriveState]] = {
    "disable voltage": [_N, _D, _D, _D, _D, _D, _X, _F],
    "quick stop": [_N, _D, _D, _D, _Q, _Q, _X, _F],
    "shutdown": [_N, _R, _R, _R, _R, _Q, _X, _F],
    "switch on": [_N, _D, _O, _O, _O, _Q, _X, _F],
    "enable operation": [_N, _D, _O, _E, _E, _E, _X, _F],
    "rising edge of fault reset": [_N, _D, _D, _D, _D, _D, _X, _D],
    "fault": [_F, _F, _F, _F, _X, _X, _X, _F],
    "connection lost": [_N, _D, _R, _D, _Q, _Q, _X, _F],
    "standstill": [_N, _D, _R, _O, _E, _Q, _F, _F],
    "power cycle": [_N, _N, _N, _N, _N, _N, _N, _N],
}
WORDS = {
    "disable voltage": 0x00,
    "quick stop": 0x02,
    "shutdown": 0x06,
    "switch on": 0x07,
    "enable operation": 0x0F,
    "rising edge of fault reset": 0x80,
}


def in_state(state: DriveState) -> Bench:
    """A drive that has just come into a state; where it has torque it moves."""
    bench = Bench()
    if state is S.NOT_READY_TO_SWITCH_ON:
        return bench
    bench.prepare()
    bench.write(0x6007, 0, 3, 2)
    path = {S.READY_TO_SWITCH_ON: [6], S.SWITCHED_ON: [6, 7]}.get(state, [])
    if state in (S.OPERATION_ENABLED, S.QUICK_STOP_ACTIVE, S.FAULT_REACTION_ACTIVE):
        bench.enable()
        bench.drive(0.2, SPEED)
    for word in path:
        bench.write(0x6040, 0, word, 2)
    if state is S.QUICK_STOP_ACTIVE:
        bench.write(0x6040, 0, 0x02, 2)
    if state in (S.FAULT_REACTION_ACTIVE, S.FAULT):
        bench.node.raise_emergency(0x4310)
    assert bench.node.state is state
    return bench


def stand_still(bench: Bench) -> None:
    """Let time pass until the axis stands; an enabled one is commanded to hold."""
    if bench.node.state is S.OPERATION_ENABLED:
        bench.drive(0.2, 0.0)
    else:
        bench.wait(0.1)


def happen(bench: Bench, event: str) -> None:
    others: dict[str, Callable[[], None]] = {
        "fault": lambda: bench.node.raise_emergency(0x4310),
        "connection lost": lambda: bench.nmt(0x02),
        "standstill": lambda: stand_still(bench),
        "power cycle": bench.node.power_cycle,
    }
    if event in others:
        others[event]()
    elif bench.node.state is S.NOT_READY_TO_SWITCH_ON:
        bench.send(0x200 + bench.id, WORDS[event].to_bytes(2, "little") + bytes(4))
    else:
        bench.write(0x6040, 0, WORDS[event], 2)


@pytest.mark.parametrize("event", EVENTS)
@pytest.mark.parametrize("state", STATES, ids=lambda state: state.name)
def test_a_drive_goes_where_the_table_says(state: DriveState, event: str) -> None:
    bench = in_state(state)
    if event == "standstill" and state is S.NOT_READY_TO_SWITCH_ON:
        bench.wait(0.005)
    else:
        happen(bench, event)
    assert bench.node.state is EVENTS[event][STATES.index(state)]


@pytest.mark.parametrize("before", [S.NOT_READY_TO_SWITCH_ON, S.SWITCH_ON_DISABLED])
def test_a_fault_found_in_the_self_test_or_later_is_not_left_without_a_reset(before: DriveState) -> None:
    bench = in_state(before)
    bench.node.raise_emergency(0x4310)
    bench.wait(0.1)
    assert bench.node.state is S.FAULT


# What a master says in each state on its way to a target; CiA 402-2, one transition at a time, never 9, never 15.
TARGETS: dict[AxisStatus, dict[AxisStatus, int]] = {
    A.SWITCH_ON_DISABLED: {A.OPERATION_ENABLED: 7, A.SWITCHED_ON: 6, A.READY_TO_SWITCH_ON: 0, A.QUICK_STOP_ACTIVE: 0},
    A.SWITCHED_ON: {A.SWITCH_ON_DISABLED: 6, A.READY_TO_SWITCH_ON: 7, A.SWITCHED_ON: 7, A.OPERATION_ENABLED: 7},
    A.OPERATION_ENABLED: {
        A.SWITCH_ON_DISABLED: 6,
        A.READY_TO_SWITCH_ON: 7,
        A.SWITCHED_ON: 15,
        A.OPERATION_ENABLED: 15,
    },
    A.QUICK_STOP_ACTIVE: {A.OPERATION_ENABLED: 2, A.QUICK_STOP_ACTIVE: 2, A.SILENT: 2},
}


@pytest.mark.parametrize("status", list(AxisStatus), ids=lambda status: status.name)
@pytest.mark.parametrize("target", TARGETS, ids=lambda target: target.name)
def test_a_master_says_what_the_table_says(target: AxisStatus, status: AxisStatus) -> None:
    assert controlword(status, target) == TARGETS[target].get(status, 0)
