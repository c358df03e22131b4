"""EDS and DCF files as makers' tools write them: nothing of them is lost, and nothing is made up."""

import configparser
import re
from pathlib import Path
from random import Random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drive_gateway.canopen.eds import Eds
from drive_gateway.canopen.eds_file import EdsError, parse_eds, read_eds, whole_number
from tests.unit.repository import ROOT

VECTORS = ROOT / "tests" / "vectors" / "eds"
_BITS = {1: 1, 2: 8, 3: 16, 4: 32, 5: 8, 6: 16, 7: 32, 0x10: 24, 0x15: 64, 0x16: 24, 0x1B: 64}
_SIGNED = (2, 3, 4, 0x10, 0x15)


def independent(path: Path) -> dict[tuple[int, int], dict[str, str]]:
    """Keys in lower case of every (sub-)object, by the standard library alone; compact arrays spelled out."""
    text = path.read_bytes().decode("cp1252" if path.name == "servo.eds" else "utf-8")
    parser = configparser.RawConfigParser(comment_prefixes=(";",))
    parser.read_string("\n".join(line.strip() for line in text.splitlines()))
    sections = {name.upper(): dict(parser[name]) for name in parser.sections()}
    found: dict[tuple[int, int], dict[str, str]] = {}
    for name, keys in sections.items():
        place = re.fullmatch(r"([0-9A-F]{4})(?:SUB([0-9A-F]+))?", name)
        if place is None or int(place[1], 16) < 0x1000:
            continue
        index, sub = int(place[1], 16), int(place[2] or "0", 16)
        if "compactsubobj" in keys:
            count = int(keys["compactsubobj"])
            values = sections.get(f"{name}VALUE", {})
            found[index, 0] = {"datatype": "5", "accesstype": "ro", "defaultvalue": str(count)}
            for number in range(1, count + 1):
                found[index, number] = keys | {"parametervalue": values.get(str(number), "")}
        elif "datatype" in keys or keys.get("objecttype") == "0x2":
            found[index, sub] = keys
    return found


def number(text: str) -> int:
    text = text.partition(";")[0].strip()
    return int(text, 16) if text.lower().startswith("0x") else int(text)


def kind_of(keys: dict[str, str]) -> int:
    kind = number(keys.get("datatype", "0x0F"))
    return 6 if kind == 0xA0 else kind


def limit(keys: dict[str, str], name: str) -> float | None:
    """Signed numbers from their bit patterns; 0 to 0 is no range."""
    text, kind = keys.get(name, ""), kind_of(keys)
    if not text or (keys.get("lowlimit"), keys.get("highlimit")) == ("0", "0"):
        return None
    if kind == 8:
        return float(text)
    value = number(text)
    return value - (1 << _BITS[kind]) if kind in _SIGNED and value >= 1 << _BITS[kind] - 1 else value


@pytest.mark.parametrize("name", ["servo.eds", "editor.eds", "device.dcf"])
def test_nothing_of_a_file_is_lost(name: str) -> None:
    wanted = independent(VECTORS / name)
    objects = {(item.index, item.sub): item for item in read_eds(str(VECTORS / name)).objects}
    entries = {(entry.index, entry.sub): entry for entry in Eds(str(VECTORS / name))}
    assert list(objects) == sorted(wanted) == list(entries)
    for key, keys in wanted.items():
        item, entry = objects[key], entries[key]
        access = keys.get("accesstype", "rw").lower()
        assert (item.kind, item.access) == (kind_of(keys), access), key
        assert (entry.readable, entry.writable) == (access != "wo", access in ("rw", "rww", "rwr", "wo")), key
        assert (entry.low, entry.high) == (limit(keys, "lowlimit"), limit(keys, "highlimit")), key
        assert (item.default, item.value) == (keys.get("defaultvalue", ""), keys.get("parametervalue", "")), key
        if kind_of(keys) in _BITS:
            assert (entry.size, entry.signed) == ((_BITS[kind_of(keys)] + 7) // 8, kind_of(keys) in _SIGNED), key


def test_names_say_their_array_and_keep_every_character() -> None:
    names = {entry.address: entry.name for name in ("servo.eds", "editor.eds") for entry in Eds(str(VECTORS / name))}
    assert names["6085h:00"] == "Quick stop deceleration in °/s²"
    assert names["1003h:10"] == "Error history, Error 16"
    assert names["1016h:01"] == "Consumer heartbeat time, 1"
    assert names["1016h:02"] == "Consumer heartbeat time, Of the gateway"
    assert names["2100h:00"] == "Gain 100 % of rated"


def test_a_dcf_gives_every_value_of_its_device() -> None:
    eds = Eds(str(VECTORS / "device.dcf"))
    assert (eds.node_id, eds.bitrate) == (5, 500_000)
    assert {entry.address: data.hex() for entry, data in eds.parameters(lambda *_: True)} == {
        "1400h:01": "05040000",
        "2200h:01": "f9ff",
        "2200h:03": "feff",
        "2201h:00": "05000000",
        "2202h:00": "9cff",
        "2203h:00": "0000c03f",
        "2204h:00": b"cell; left".hex(),
        "2205h:00": "2c01",
    }


def test_a_limit_of_one_side_and_one_of_a_single_value_hold() -> None:
    eds = Eds(str(VECTORS / "servo.eds"))
    for address, text, allowed in [
        ("6085", "0", "1 to 4294967295"),
        ("60AA", "0xC00302", "12583680 to 12583680"),
        ("605A", "8", "-32768 to 7"),
    ]:
        with pytest.raises(EdsError, match=f"allowed: {allowed}"):
            eds.find(address).pack(text)
    with pytest.raises(EdsError, match=r"2\.5 does not fit 2100h:00 .* allowed: -1\.5 to 2\.25"):
        Eds(str(VECTORS / "editor.eds")).find("2100").pack("2.5")


def test_a_type_that_nobody_knows_is_neither_a_number_nor_a_domain() -> None:
    entry = Eds(str(VECTORS / "editor.eds")).find("2103")
    assert (entry.described, entry.domain, entry.show(b"\1\2\3\4\5\6")) == (False, False, "01 02 03 04 05 06")


@pytest.mark.parametrize(
    ("text", "value"),
    [("007", 7), ("00", 0), ("0X1f", 31), ("-0x80", -128), (" 12 ", 12), ("010", None), ("08", None), ("", None)],
)
def test_a_number_is_read_where_it_means_one_thing(text: str, value: int | None) -> None:
    """A leading 0 makes it octal for some tools and nothing for others."""
    assert whole_number(text) == value


def test_a_type_that_may_be_octal_is_named_with_its_place() -> None:
    with pytest.raises(EdsError, match=r"a value that is no number \(\[2F00\] DataType=010\)"):
        parse_eds("[2F00]\nParameterName=x\nAccessType=rw\nDataType=010\n")


def test_plain_cia_402_has_nothing_of_a_makers_own() -> None:
    """What stands at 2000h of one drive is a Node-ID at another."""
    assert all(entry.index < 0x2000 or entry.index >= 0x6000 for axes in (1, 2, 3) for entry in Eds(axes=axes))
    assert not Eds().find("2000").described


_TYPES = st.sampled_from([(0x02, 8), (0x03, 16), (0x04, 32), (0x05, 8), (0x06, 16), (0x07, 32), (0x10, 24), (0x1B, 64)])


@st.composite
def _objects(draw: st.DrawFn) -> list[dict[str, int | str]]:
    keys = draw(st.lists(st.tuples(st.integers(0x1000, 0x9FFF), st.integers(0, 0xFE)), unique=True, max_size=6))
    return [
        {
            "index": index,
            "sub": sub,
            "name": draw(st.text("abcÄ 0;%=:[]", min_size=1).map(lambda text: f"x{text.strip()}")),
            "kind": draw(_TYPES)[0],
            "access": draw(st.sampled_from(["ro", "rw", "rww", "rwr", "wo", "const"])),
            "default": draw(st.sampled_from(["", "0", "0xFF", "$NODEID+0x80"])),
        }
        for index, sub in keys
    ]


@settings(max_examples=60, deadline=None)
@given(_objects(), st.randoms(use_true_random=False))
def test_however_a_tool_writes_a_file_its_objects_are_the_same(
    objects: list[dict[str, int | str]], any_of: Random
) -> None:
    """Order of the sections and keys, their case, blanks, line ends and comments do not matter."""

    def word(text: str) -> str:
        return any_of.choice([text, text.lower(), text.upper()])

    blocks = [
        [f"[{word(f'{index:04X}')}]", f"{word('ParameterName')}=Group", f"{word('ObjectType')}=0x9"]
        for index in {item["index"] for item in objects}
    ]
    for item in objects:
        said = [
            f"{word('ParameterName')}={item['name']}",
            f"{word('DataType')}={any_of.choice(['0x%04X', '0x%X', '%d']) % item['kind']}",
            f"{word('AccessType')}={word(str(item['access']))}",
            f"{word('DefaultValue')}={item['default']}",
        ]
        any_of.shuffle(said)
        blocks.append([f"[{item['index']:04X}{word('sub')}{word(format(item['sub'], 'X'))}]", *said, "; a comment"])
    any_of.shuffle(blocks)
    end = any_of.choice(["\n", "\r\n", "\r"])
    text = end.join(any_of.choice(["", "  ", "\t"]) + line for block in blocks for line in [*block, ""])
    if not objects:
        with pytest.raises(EdsError, match="no object in it"):
            parse_eds(text)
        return
    wanted = sorted(
        (i["index"], i["sub"], f"Group, {i['name']}", i["kind"], i["access"], i["default"]) for i in objects
    )
    found = [(i.index, i.sub, i.name, i.kind, i.access, i.default) for i in parse_eds(text).objects]
    assert found == wanted
