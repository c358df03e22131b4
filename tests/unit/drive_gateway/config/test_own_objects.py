"""Objects of a drive's own: from the drives file, from a DCF, and every mistake in either at its place."""

from pathlib import Path

import pytest

from cell.config import ConfigError
from cell.config.problem import Severity
from drive_gateway.canopen.axes_eds import eds_text
from drive_gateway.canopen.eds import Eds
from drive_gateway.config import load_drives
from drive_gateway.config.load import read_drives
from drive_gateway.config.own_objects import TypedValue, own_object
from drive_gateway.config.settings import OwnObject
from drive_gateway.gateway.nodes.program import program
from drive_gateway.gateway.reference.reference import Reference
from tests.unit.config_world import DRIVES, Copy
from tests.unit.gateway_world import axis, gateway_settings

NODE = "{node: 1, gear: 180"
SECTION = "\n[2000]\nParameterName="


def copy_with(folder: Path, keys: str, eds: str | bytes = "", name: str = "my.dcf") -> Copy:
    """J1 of the left arm with more keys, and a file beside the drives file."""
    copy = Copy(folder).change(DRIVES, NODE, f"{{{keys}, {NODE[1:]}")
    (copy.drives.parent / name).write_bytes(eds if isinstance(eds, bytes) else eds.encode())
    return copy


def objects(copy: Copy) -> dict[str, str]:
    """Of J1: address and bytes."""
    found = load_drives(copy.drives, "left_bus").robots["left"].axes[0].objects
    return {f"{item.index:04X}:{item.sub:02X}": item.data.hex() for item in found}


def dcf(*values: tuple[str, str]) -> str:
    """The shipped EDS with values for some objects."""
    text = eds_text()
    for index, value in values:
        text = text.replace(f"[{index}]\n", f"[{index}]\nParameterValue={value}\n", 1)
    return text


def problem(copy: Copy) -> str:
    with pytest.raises(ConfigError) as caught:
        load_drives(copy.drives, "left_bus")
    [line] = [str(line).partition(": robots.left.axes.J1.")[2] for line in caught.value.problems]
    return line


def test_values_have_the_type_of_the_eds_or_the_one_that_is_stated(tmp_path: Path) -> None:
    keys = 'objects: {"2000:00": 10, "606D:00": 0x200, "2f01:02": {value: -5, type: INTEGER16}}'
    found = {"2000:00": "0a", "606D:00": "0002", "2F01:02": "fbff"}
    assert objects(copy_with(tmp_path, f"eds: my.eds, {keys}", eds_text(), "my.eds")) == found


def test_without_an_eds_an_object_of_the_makers_own_needs_its_type(tmp_path: Path) -> None:
    """2000h is the time-out of set points at the simulated drive, and the Node-ID at others."""
    assert problem(copy_with(tmp_path, 'objects: {"2000:00": 4}')) == (
        "objects.2000:00: found 2000h:00 not in plain CiA 402, an object of the maker's own, "
        "allowed the drive's `eds` beside it, or its type: {value: ..., type: UNSIGNED16}"
    )
    typed = copy_with(tmp_path / "typed", 'objects: {"2000:00": {value: 4, type: UNSIGNED8}}')
    assert objects(typed) == {"2000:00": "04"}


def test_a_dcf_says_what_is_written_but_not_what_the_gateway_writes_itself(tmp_path: Path) -> None:
    text = dcf(("2000", "0x0A"), ("6085", "5"), ("1014", "$NODEID+0x80"), ("6041", "7"), ("1400sub1", "$NODEID+0x200"))
    copy = copy_with(tmp_path, "eds: my.dcf", text)
    assert objects(copy) == {"2000:00": "0a"}
    assert objects(copy.change(DRIVES, "eds: my.dcf", 'eds: my.dcf, objects: {"2000:00": 7}')) == {"2000:00": "07"}


def test_the_values_of_a_file_that_is_no_dcf_are_not_written(tmp_path: Path) -> None:
    assert objects(copy_with(tmp_path, "eds: my.eds", dcf(("2000", "10")), "my.eds")) == {}


def test_a_negative_value_may_be_its_bit_pattern(tmp_path: Path) -> None:
    trim = "[2F00]\nParameterName=Trim\nDataType=0x0003\nAccessType=rw\nParameterValue=0xFFFE\n"
    assert objects(copy_with(tmp_path, "eds: my.dcf", dcf() + trim)) == {"2F00:00": "feff"}


@pytest.mark.parametrize(
    ("kind", "value", "data"),
    [("0x0008", "1.5", "0000c03f"), ("0x0016", "0x010203", "030201"), ("0x000A", "01 02 FF", "0102ff")],
    ids=["REAL32", "UNSIGNED24", "OCTET_STRING"],
)
def test_a_dcf_may_hold_values_of_every_type(tmp_path: Path, kind: str, value: str, data: str) -> None:
    more = f"[2F00]\nParameterName=Trim\nDataType={kind}\nAccessType=rw\nParameterValue={value}\n"
    copy = copy_with(tmp_path, "eds: my.dcf", dcf(("2000", "10")) + more)
    assert objects(copy) == {"2000:00": "0a", "2F00:00": data}


def test_a_file_of_a_windows_tool_is_read(tmp_path: Path) -> None:
    text = eds_text().replace("ParameterName=Statusword", "ParameterName=Zustand in ½° für J1").encode("cp1252")
    assert objects(copy_with(tmp_path, "eds: my.eds", text, "my.eds")) == {}


@pytest.mark.parametrize(
    ("value", "found"),
    [
        ('"6701:00": 5', "objects.6701:00: found 6701h:00 not in plain CiA 402, whose type is not known, allowed the "),
        ('"605D:00": 70000', "objects.605D:00: found 70000 does not fit 605Dh:00 "),
        ('"605D:00": text', "objects.605D:00: found a text for 605Dh:00 "),
        ('"605D:00": {value: 5, type: INTEGER32}', "objects.605D:00: found INTEGER32 for 605Dh:00 "),
        ('"2F01:00": {value: 300, type: UNSIGNED8}', "objects.2F01:00: found 300 does not fit 2F01h:00 "),
        ('"6041:00": 5', "objects.6041:00: found 6041h:00 Statusword, which is read-only, allowed objects that can be"),
        ('"6841:00": 5', "objects.6841:00: found 6841h:00 Statusword, which is not axis 1's, allowed objects of this"),
        ('"6085:00": 5', "objects.6085:00: found 6085h:00 Quick stop deceleration in counts/s^2, which the gateway "
         "writes itself, allowed for it quick_stop"),
        ('"1A00:01": 5', "objects.1A00:01: found 1A00h:01 "),
        ('"2F01:00": {value: 5, type: UNSIGNED8}, "2f01:00": {value: 5, type: UNSIGNED8}',
         "objects.2f01:00: found 2f01:00, which left.J1 says too, allowed each object of a node once"),
    ],
)  # fmt: skip
def test_each_mistake_of_an_object_is_one_line_at_its_place(tmp_path: Path, value: str, found: str) -> None:
    assert problem(copy_with(tmp_path, f"objects: {{{value}}}")).startswith(found)


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("", "no object in it, allowed an EDS or DCF file as CiA 306 describes it"),
        (b"[6041]\nParameterName=\x81", "the byte 0x81 in line 2, allowed text in UTF-8 or Windows-1252"),
        ("hello", "text in line 1 before the first [section], allowed"),
        ("[1000]\nhello\n", "line 2 is neither a [section] nor KEY=VALUE, allowed"),
        (eds_text() + "[6041]\nParameterName=x\n", "a second section [6041] in line "),
        ("[6041]\nParameterName=x\nParameterName=y\n", "a second ParameterName in section [6041], line 3, allowed"),
        ("[6041]\nParameterName=x\nAccessType=ro\n", "section [6041] without DataType, allowed"),
        ("[6041]\nParameterName=x\nDataType=zzz\n", "a value that is no number ("),
        ("[6041sub1]\nParameterName=x\n", "a sub-object without the section of its object: "),
    ],
)
def test_a_broken_file_is_named_with_what_is_wrong_in_it(tmp_path: Path, text: str | bytes, found: str) -> None:
    told = problem(copy_with(tmp_path, "eds: my.dcf", text))
    assert told.startswith(f"eds: found my.dcf: cannot be read: {found}")


@pytest.mark.parametrize(
    ("text", "found"),
    [
        (dcf(("2000", "soon")), "eds: found the ParameterValue 'soon' of 2000h:00 "),
        (dcf(("2000", "300")), "eds: found 300 does not fit 2000h:00 "),
        (dcf() + "[DeviceComissioning]\nNodeID=5\n", "eds: found my.dcf for Node-ID 5, allowed one for Node-ID 1"),
        (
            dcf() + "[DeviceComissioning]\nBaudrate=500\n",
            "eds: found my.dcf for 500000 bit/s, allowed one for this bus",
        ),
    ],
)
def test_a_dcf_of_another_device_or_with_an_impossible_value_is_refused(tmp_path: Path, text: str, found: str) -> None:
    assert problem(copy_with(tmp_path, "eds: my.dcf", text)).startswith(found)


def test_an_object_is_said_once_for_all_axes_of_a_node(tmp_path: Path) -> None:
    copy = copy_with(tmp_path, 'objects: {"1029:01": 1}')
    copy.change(DRIVES, "{node: 2,", '{objects: {"1029:01": 0}, node: 1, axis: 2,')
    with pytest.raises(
        ConfigError, match=r"J2\.objects\.1029:01: found 1029:01, which left\.J1 says too, allowed each"
    ):
        load_drives(copy.drives, "left_bus")


def test_each_object_comes_with_its_name(tmp_path: Path) -> None:
    copy = copy_with(tmp_path, 'eds: my.eds, objects: {"2000:00": 5}', eds_text(), "my.eds")
    first = load_drives(copy.drives, "left_bus").robots["left"].axes[0]
    assert first.objects == (OwnObject(0x2000, 0, "Set-point time-out in interpolation periods", b"\5"),)


def test_a_waived_object_is_a_warning_that_says_what_it_costs(tmp_path: Path) -> None:
    copy = copy_with(tmp_path, 'waive: ["6007", "605A"], quick_stop_option: 2, connection_lost: 1')
    reading = read_drives(copy.drives)
    assert [problem.severity for problem in reading.problems] == [Severity.WARNING] * 2
    assert "waive[0]: found a drive that may lack 6007h (reaction to a lost connection): whether it stops" in str(
        reading.problems[0]
    )
    axis = load_drives(copy.drives, "left_bus").robots["left"].axes[0]
    assert (axis.waived, axis.quick_stop_option, axis.connection_lost) == ({0x6007, 0x605A}, 2, 1)


@pytest.mark.parametrize(
    ("keys", "found"),
    [
        ('waive: ["6085"]', "waive[0]: found '6085', allowed "),
        ("quick_stop_option: 0", "quick_stop_option: found 0, allowed 2 or 6"),
        ("interpolation: -2", "interpolation: found -2 beside mode cyclic, allowed mode: interpolated beside it"),
        ("connection_lost: 0", "connection_lost: found 0, allowed 1 or 3"),
    ],
)
def test_a_way_to_stop_that_the_gateway_does_not_know_is_refused(tmp_path: Path, keys: str, found: str) -> None:
    assert problem(copy_with(tmp_path, keys)).startswith(found)


def test_what_the_interpolation_data_hold_besides_the_set_point_is_the_makers(tmp_path: Path) -> None:
    assert objects(copy_with(tmp_path, 'objects: {"60C1:02": {value: 1, type: INTEGER32}}')) == {"60C1:02": "01000000"}


def test_the_period_of_sync_may_be_said_for_a_drive_that_wants_another_one() -> None:
    """Without it the gateway writes its cycle; a DCF, which holds all values of a device, does not count."""
    item = own_object("1006:00", TypedValue(value=8000, type="UNSIGNED32"), 1, Eds())
    assert (item.index, item.data) == (0x1006, bytes.fromhex("401f0000"))
    axis_settings = axis("J1", 1, objects=(item,))
    steps = program([axis_settings], gateway_settings(), [Reference(axis_settings, None)])
    assert [step.data.hex() for step in steps if step.index == 0x1006 and step.data is not None] == [
        "00000000",  # while the counter changes, where it does
        "401f0000",
    ]
