"""Names and types of objects as people write and read them."""

from importlib.resources import files
from pathlib import Path

import pytest

from drive_gateway.canopen.eds import Eds, EdsError


@pytest.mark.parametrize("address", ["6041", "6041:00", "0x6041:0", "6041h:00", "statusword"])
def test_an_object_is_found_by_address_and_by_name(address: str) -> None:
    assert Eds().find(address).address == "6041h:00"


def test_a_value_is_shown_with_its_sign_and_its_bytes() -> None:
    assert Eds().find("6064").show((-400).to_bytes(4, "little", signed=True)) == "-400 (FFFFFE70h)"


@pytest.mark.parametrize(("text", "packed"), [("400", "90010000"), ("-99", "9dffffff"), ("0x10", "10000000")])
def test_a_value_is_packed_as_the_object_is_long(text: str, packed: str) -> None:
    assert Eds().find("607A").pack(text).hex() == packed


def test_a_domain_is_shown_by_its_length_and_written_from_a_file_only() -> None:
    memory = Eds(str(files("drive_gateway.sim") / "cia402_drive.eds")).find("User memory")
    assert (memory.address, memory.show(bytes(4000))) == ("2001h:00", "4000 bytes")
    with pytest.raises(EdsError, match=r"2001h:00 User memory is a domain; allowed: @FILE, the name of a file"):
        memory.pack("5")


def test_a_value_outside_the_type_names_what_fits() -> None:
    with pytest.raises(EdsError, match=r"300 does not fit 60C2h:01 .* allowed: 1 to 255"):
        Eds().find("60C2:1").pack("300")


def test_the_limits_of_a_file_hold_unless_they_hold_nothing(tmp_path: Path) -> None:
    with pytest.raises(EdsError, match=r"9 does not fit 605Ah:00 .* allowed: 0 to 7"):
        Eds().find("605A").pack("9")
    file = tmp_path / "none.eds"
    file.write_text("[2F00]\nParameterName=x\nDataType=0x0003\nAccessType=rw\nLowLimit=0\nHighLimit=0\n")
    assert Eds(str(file)).find("2F00").pack("-9").hex() == "f7ff"


def test_a_name_that_is_no_object_says_what_is_allowed() -> None:
    with pytest.raises(EdsError, match="allowed: INDEX:SUB in hex"):
        Eds().find("speedometer")


@pytest.mark.parametrize(
    ("text", "axis", "address"),
    [
        ("Profile velocity", 1, "6081h:00"),
        ("Profile velocity", 3, "7081h:00"),
        ("Profile velocity, axis 2", 1, "6881h:00"),
        ("6081", 3, "6081h:00"),
        ("Error register", 2, "1001h:00"),
    ],
)
def test_a_name_means_the_object_of_the_axis_and_an_address_stays_as_it_is(text: str, axis: int, address: str) -> None:
    name = next(entry.name for entry in Eds() if entry.address == "6081h:00")
    assert Eds(axes=3).find(text.replace("Profile velocity", name), axis).address == address


def test_objects_of_a_further_axis_have_the_types_of_the_first_one_also_where_the_file_leaves_them_out() -> None:
    for eds in (Eds(axes=1), Eds(axes=3)):
        assert eds.find("7064").show((-400).to_bytes(4, "little", signed=True)) == "-400 (FFFFFE70h)"
    assert Eds(axes=2).find("6864").name.endswith(", axis 2")


def test_an_address_outside_the_file_is_read_as_bytes() -> None:
    assert Eds().find("2075").show(b"\x01\x02") == "01 02"


def test_a_file_that_is_no_eds_is_named() -> None:
    with pytest.raises(EdsError, match=r"nowhere\.eds: cannot be read"):
        Eds("nowhere.eds")


_TYPED = "[2F00]\nParameterName=x\nAccessType=rw\nDataType={}\n"


@pytest.mark.parametrize(
    ("kind", "text", "packed", "shown"),
    [
        ("0x0008", "-0.25", "000080be", "-0.25 (BE800000h)"),
        ("0x0008", "0x3F800000", "0000803f", "1 (3F800000h)"),
        ("0x0011", "1e-3", "fca9f1d24d62503f", "0.001 (3F50624DD2F1A9FCh)"),
        ("0x0016", "0x10203", "030201", "66051 (010203h)"),
        ("0x0010", "-2", "feffff", "-2 (FFFFFEh)"),
        ("0x000A", "01 0a FF", "010aff", "01 0a ff"),
        ("0x000B", "Öl", "d6006c00", "'Öl'"),
    ],
    ids=["REAL32", "pattern", "REAL64", "UNSIGNED24", "INTEGER24", "OCTET_STRING", "UNICODE_STRING"],
)
def test_values_of_every_type_are_packed_and_shown(
    tmp_path: Path, kind: str, text: str, packed: str, shown: str
) -> None:
    file = tmp_path / "my.eds"
    file.write_text(_TYPED.format(kind))
    entry = Eds(str(file)).find("2F00")
    assert entry.pack(text).hex() == packed
    assert entry.show(bytes.fromhex(packed)) == shown


@pytest.mark.parametrize(
    ("kind", "text", "allowed"),
    [
        ("0x0008", "1e99", "a REAL32, such as"),
        ("0x0008", "soon", "a REAL32, such as"),
        ("0x0016", "0x1000000", "0 to 16777215"),
        ("0x000A", "xyz", "bytes in hex"),
    ],
)
def test_a_value_that_is_none_of_its_type_says_what_is_allowed(
    tmp_path: Path, kind: str, text: str, allowed: str
) -> None:
    file = tmp_path / "my.eds"
    file.write_text(_TYPED.format(kind))
    with pytest.raises(EdsError, match=f"allowed: {allowed}"):
        Eds(str(file)).find("2F00").pack(text)
