"""The table of the modes: what leads where, and what must never lead anywhere."""

from itertools import product

import pytest

from cell.messages import Mode
from robot_agent.agent.mode import TABLE, ModeEvent, after, has_torque, stands
from tests.unit.repository import ROOT

MOVING = {Mode.RUNNING, Mode.RETURNING, Mode.JOGGING}
BY_AN_OPERATOR = {ModeEvent.RUN, ModeEvent.CONTINUE, ModeEvent.GO_BACK, ModeEvent.JOG}


def ways_out_of(mode: Mode) -> set[ModeEvent]:
    return {event for event in ModeEvent if after(mode, event) is not mode}


def test_a_fault_ends_by_an_operator_only() -> None:
    assert ways_out_of(Mode.FAULT) == {ModeEvent.ACKNOWLEDGED, ModeEvent.ESTOP}


def test_an_emergency_stop_leads_to_a_robot_that_is_switched_off() -> None:
    assert ways_out_of(Mode.ESTOP) == {ModeEvent.CLEARED, ModeEvent.FAULT, ModeEvent.CLAIM_LOST}
    assert after(Mode.ESTOP, ModeEvent.CLEARED) is Mode.DISABLED


@pytest.mark.parametrize("mode", Mode)
def test_a_stop_is_heard_in_every_mode(mode: Mode) -> None:
    assert after(mode, ModeEvent.ESTOP) is Mode.ESTOP
    assert after(mode, ModeEvent.FAULT) is Mode.FAULT


def test_a_robot_begins_to_move_from_a_standstill_with_torque_and_by_an_operator() -> None:
    begins = {(mode, event) for (mode, event), then in TABLE.items() if mode not in MOVING and then in MOVING}
    assert {event for _, event in begins} == BY_AN_OPERATOR
    assert all(stands(mode) for mode, _ in begins)


def test_only_the_gateway_switches_drives_on() -> None:
    on = {(mode, event) for (mode, event), then in TABLE.items() if has_torque(then) and not has_torque(mode)}
    assert on == set(
        product((Mode.DISABLED, Mode.ENABLING), (ModeEvent.FREE, ModeEvent.ON_PATH, ModeEvent.BESIDE_PATH))
    )


def test_every_event_changes_some_mode_and_every_mode_is_reached() -> None:
    assert {event for _, event in TABLE} == set(ModeEvent)
    assert set(TABLE.values()) == set(Mode)


def test_the_architecture_shows_the_table() -> None:
    rows = [
        f"| {event.value} | {', '.join(mode.value for mode in Mode if (mode, event) in TABLE)} | {then} |"
        for event in ModeEvent
        for then in sorted({TABLE[mode, event].value for mode in Mode if (mode, event) in TABLE})
    ]
    text = (ROOT / "docs" / "architecture.md").read_text()
    assert [row for row in rows if row not in text] == []
