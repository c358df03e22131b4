"""The SDO server, byte by byte: recorded frames, segmented transfers, and a code for each refusal."""

from dataclasses import replace
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drive_gateway.sim.services.dictionary import Dictionary, key_of, load_dictionary
from drive_gateway.sim.services.objects import Objects
from drive_gateway.sim.services.sdo_server import SdoServer
from tests.unit.repository import vectors

VECTORS = vectors("sdo_frames.json")
NAME = key_of(0x1008)
TARGET = key_of(0x607A)


def server(entries: dict[int, Any] | None = None, lacks: int = 0) -> tuple[SdoServer, Objects]:
    shared = load_dictionary()
    known = {key: entry for key, entry in {**shared.entries, **(entries or {})}.items() if key >> 8 != lacks}
    objects = Objects(Dictionary(known, shared.indices - {lacks}), 1)
    return SdoServer(objects), objects


def ask(sdo: SdoServer, request: str) -> str:
    return "".join(answer.hex(" ").upper() for answer in sdo.answer(bytes.fromhex(request)))


def abort(code: str, address: str = "00 00 00") -> str:
    return f"80 {address} " + bytes.fromhex(code)[::-1].hex(" ").upper()


@pytest.mark.parametrize("vector", VECTORS["transfers"], ids=lambda vector: vector["what"])
def test_recorded_transfer_is_answered_byte_by_byte(vector: dict[str, Any]) -> None:
    name = replace(load_dictionary().entries[NAME], text=vector.get("name", "x").encode())
    sdo, objects = server({NAME: name}, int(vector.get("lacks", "0"), 16))
    for index, value in vector.get("set", {}).items():
        objects.numbers[key_of(int(index, 16))] = value
    for request, answer in vector["frames"]:
        assert ask(sdo, request) == answer


def test_segmented_download_arrives() -> None:
    sdo, objects = server()
    assert ask(sdo, "21 7A 60 00 04 00 00 00") == "60 7A 60 00 00 00 00 00"
    assert ask(sdo, "0A 70 FE 00 00 00 00 00") == "20 00 00 00 00 00 00 00"
    assert ask(sdo, "1B FF FF 00 00 00 00 00") == "30 00 00 00 00 00 00 00"
    assert objects.numbers[TARGET] == -400


def test_expedited_download_without_size_takes_the_objects_length() -> None:
    sdo, objects = server()
    ask(sdo, "22 40 60 00 0F 00 AA BB")
    assert objects.numbers[key_of(0x6040)] == 0x0F


@pytest.mark.parametrize(
    ("requests", "answer"),
    [
        (["40 00 30 00 00 00 00 00"], abort("06020000", "00 30 00")),
        (["40 18 10 09 00 00 00 00"], abort("06090011", "18 10 09")),
        (["2B 41 60 00 00 00 00 00"], abort("06010002", "41 60 00")),
        (["2F 7A 60 00 00 00 00 00"], abort("06070013", "7A 60 00")),
        (["23 40 60 00 00 00 00 00"], abort("06070012", "40 60 00")),
        (["21 7A 60 00 05 00 00 00"], abort("06070012", "7A 60 00")),
        (["2B 07 60 00 04 00 00 00"], abort("06090031", "07 60 00")),
        (["2B 07 60 00 FF FF 00 00"], abort("06090032", "07 60 00")),
        (["40 08 10 00 00 00 00 00", "70 00 00 00 00 00 00 00"], abort("05030000", "08 10 00")),
        (["21 7A 60 00 04 00 00 00", "1F 00 00 00 00 00 00 00"], abort("05030000", "7A 60 00")),
        (["21 7A 60 00 04 00 00 00", "0B 01 02 00 00 00 00 00"], abort("06070010", "7A 60 00")),
        (["20 7A 60 00 00 00 00 00", "0B 01 02 00 00 00 00 00"], abort("06070013", "7A 60 00")),
        (["60 00 00 00 00 00 00 00"], abort("05040001")),
        (["00 00 00 00 00 00 00 00"], abort("05040001")),
        (["E4 08 10 00 7F 00 00 00"], abort("05040001", "08 10 00")),
    ],
)
def test_refusal_has_its_code(requests: list[str], answer: str) -> None:
    sdo, _ = server()
    assert [ask(sdo, request) for request in requests][-1] == answer


def test_write_only_object_is_not_read() -> None:
    sdo, _ = server({TARGET: replace(load_dictionary().entries[TARGET], readable=False)})
    assert ask(sdo, "40 7A 60 00 00 00 00 00") == abort("06010001", "7A 60 00")


def test_abort_of_the_client_ends_the_transfer() -> None:
    sdo, _ = server()
    ask(sdo, "40 08 10 00 00 00 00 00")
    assert ask(sdo, "80 08 10 00 00 00 04 05") == ""
    assert ask(sdo, "60 00 00 00 00 00 00 00") == abort("05040001")


def test_refused_value_leaves_the_object_alone() -> None:
    sdo, objects = server()
    ask(sdo, "2B 07 60 00 04 00 00 00")
    assert objects.numbers[key_of(0x6007)] == 1


@settings(max_examples=150)
@given(st.lists(st.binary(max_size=8), max_size=12))
def test_any_bytes_get_answers_of_eight_bytes_or_none(requests: list[bytes]) -> None:
    sdo, _ = server()
    assert all(len(frame) == 8 for request in requests for frame in sdo.answer(request))
