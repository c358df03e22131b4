"""Keys are the table of the architecture page, and lead back to what they carry."""

import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cell.messages import (
    STATES,
    Body,
    CellTime,
    ConveyorCount,
    Correction,
    Estop,
    Event,
    Presence,
    Severity,
    ZoneGeometry,
)
from cell.net.keys import Alive, Keys

KEYS = Keys("two_arms")


@pytest.mark.parametrize(
    ("message", "key"),
    [
        (
            Presence("left", "b", 1, 1, None, "d", Body(False, (0.0, 0.0, 0.0), 1.0), 0.0),
            "cell/two_arms/robot/left/presence",
        ),
        (Estop("e", True, "me", "test"), "cell/two_arms/estop"),
        (Event("gateway/bus", 1, Severity.INFO, "code", "text"), "cell/two_arms/event/gateway/bus"),
        (Event("manager", 1, Severity.INFO, "code", "text"), "cell/two_arms/event/manager"),
        (Correction("left", "seam", CellTime("m", 1.0), (0.0, 0.0, 0.0)), "cell/two_arms/robot/left/correction/seam"),
        (ConveyorCount("belt", CellTime("m", 1.0), 7), "cell/two_arms/conveyor/belt"),
        (ZoneGeometry("middle", 1, (1, 1, 1), (0, 0, 0), (0, 0, 0, 1), ()), "cell/two_arms/zone/middle"),
    ],
)
def test_a_message_has_its_key_and_the_key_its_message(message: object, key: str) -> None:
    assert KEYS.of(message) == key
    assert KEYS.type_of(key) is type(message)


@pytest.mark.parametrize(
    "key",
    [
        "cell/other/estop",
        "cell/two_arms/robot/left",
        "cell/two_arms/robot/left/extra/presence",
        "cell/two_arms/robot//presence",
        "cell/two_arms/robot/left/cmd/run",
        "cell/two_arms/alive/robot/left/b1",
        "cell/two_arms",
        "",
    ],
)
def test_other_keys_carry_no_state(key: str) -> None:
    assert KEYS.type_of(key) is None


@given(st.text())
def test_any_text_may_be_asked_for_its_type(key: str) -> None:
    assert KEYS.type_of(key) is None
    assert KEYS.type_of("cell/two_arms/" + key) in {None, *STATES}


def test_what_is_no_state_has_no_key() -> None:
    with pytest.raises(TypeError, match="str is no state message"):
        KEYS.of("hello")


def test_a_token_names_its_process() -> None:
    key = KEYS.alive("robot", "left", "b1")
    assert key == "cell/two_arms/alive/robot/left/b1"
    assert KEYS.alive_of(key) == Alive("robot", "left", "b1")
    assert KEYS.alive_of(key + "/more") is None
    assert KEYS.alive_of("cell/two_arms/estop") is None


def test_a_call_goes_to_the_verb_of_its_addressee() -> None:
    assert KEYS.command("robot/left", "run") == "cell/two_arms/robot/left/cmd/run"


def test_a_cell_name_that_is_no_key_chunk_is_refused() -> None:
    with pytest.raises(ValueError, match=re.escape("found 'a/b'")):
        Keys("a/b")
