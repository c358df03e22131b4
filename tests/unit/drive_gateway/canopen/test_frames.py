"""Bytes of NMT, error control, EMCY and PDO mapping against printed frames."""

from typing import Any

import pytest

from drive_gateway.canopen import cob_id
from drive_gateway.canopen.bus_load import cyclic_load
from drive_gateway.canopen.emcy import Meaning, decode_emergency, meaning_of
from drive_gateway.canopen.nmt import NmtCommand, NmtState, decode_heartbeat, heartbeat_frame, nmt_frame
from drive_gateway.canopen.pdo_map import COMMAND, process_image
from drive_gateway.canopen.sdo import SdoWrite
from tests.unit.repository import vectors

VECTORS: dict[str, Any] = vectors("canopen_frames.json")


def by_what(name: str) -> Any:
    return pytest.mark.parametrize("vector", VECTORS[name], ids=lambda vector: vector["what"])


@by_what("nmt")
def test_nmt_commands_are_the_printed_bytes(vector: dict[str, Any]) -> None:
    frame = nmt_frame(NmtCommand[vector["command"]], vector["node"])
    assert (frame.id, frame.data) == (0x000, bytes.fromhex(vector["data"]))


@by_what("error_control")
def test_heartbeats_name_their_state(vector: dict[str, Any]) -> None:
    assert decode_heartbeat(bytes.fromhex(vector["data"])) is NmtState[vector["state"]]


def test_a_byte_that_is_no_state_is_no_heartbeat() -> None:
    assert decode_heartbeat(b"\x11") is None
    assert decode_heartbeat(b"") is None


def test_the_masters_heartbeat_has_its_own_node_id() -> None:
    assert heartbeat_frame(NmtState.OPERATIONAL).id == 0x77F


@by_what("emergency")
def test_an_emergency_has_code_register_and_meaning(vector: dict[str, Any]) -> None:
    emergency = decode_emergency(bytes.fromhex(vector["data"]))
    assert emergency is not None
    assert (emergency.code, emergency.register) == (int(vector["code"], 16), int(vector["register"], 16))
    assert "following error" in emergency.meaning


@pytest.mark.parametrize(
    ("code", "group"), [(0x4211, "temperature"), (0x8199, "communication"), (0xFF01, "manufacturer")]
)
def test_an_unknown_emergency_is_named_by_its_group(code: int, group: str) -> None:
    assert group in meaning_of(code)[0]


@pytest.mark.parametrize(
    ("code", "meaning"),
    [(0x4280, "over-temperature"), (0x5115, "supply"), (0x5116, "supply"), (0x0010, "no error")],
)
def test_a_known_emergency_has_its_meaning(code: int, meaning: str) -> None:
    assert meaning in meaning_of(code)[0]
    assert "not in the table" not in meaning_of(code)[0]


def test_a_table_of_the_drives_own_goes_before_the_common_one() -> None:
    own = {0x4310: Meaning("motor cable torn", "replace it")}
    told = [decode_emergency(bytes.fromhex(data), own) for data in ("1043080000000000", "8042080000000000")]
    assert [emergency.meaning for emergency in told if emergency] == [
        "motor cable torn",
        "over-temperature of the device",
    ]


def test_errors_are_gone_when_the_error_register_says_so_too() -> None:
    told = [decode_emergency(bytes.fromhex(data)) for data in ("0000000000000000", "0000110000000000")]
    assert [(each.reset, each.gone) for each in told if each] == [(True, True), (True, False)]


@by_what("tpdo1")
def test_tpdo1_is_statusword_and_position(vector: dict[str, Any]) -> None:
    assert process_image(1).status_layout.unpack(bytes.fromhex(vector["data"])) == (
        int(vector["statusword"], 16),
        vector["position"],
    )
    assert COMMAND.size == process_image(1).status_layout.size == 6


def test_a_pdo_is_linked_in_the_prescribed_order() -> None:
    expected = [
        SdoWrite(int(write["index"], 16), write["sub"], bytes.fromhex(write["data"]))
        for write in VECTORS["linking_tpdo1_node_1"]
    ]
    assert process_image(1).status.writes() == expected


def test_torques_fill_the_pdos_of_an_axis_and_each_axis_of_a_node_has_its_own_objects() -> None:
    image = process_image(5, axis=2, velocity_offset=True, torque_offset=True, torques=True)
    assert image.command.entries == (0x68400010, 0x687A0020, 0x68710010)
    assert image.status.entries == (0x68410010, 0x68640020, 0x68770010)
    assert image.offset is not None
    assert image.offset.entries == (0x68B10020, 0x68B20010)
    offsets, command = image.frames(0x0F, -2, 300, -40, 7)
    assert offsets.data == bytes.fromhex("2c010000d8ff")
    assert command.data == bytes.fromhex("0f00feffffff0700")


def test_identifiers_split_into_function_and_node() -> None:
    assert (cob_id.function_code(0x5FF), cob_id.node_id(0x5FF)) == (cob_id.SDO_FROM_NODE, 127)


def test_twelve_pdos_at_250_hz_and_1_mbit_load_the_wire_by_36_percent() -> None:
    assert cyclic_load(6, 1_000_000, 0.004, 1e9, 6 * process_image(1).bits_per_cycle) == pytest.approx(0.36, abs=0.01)
