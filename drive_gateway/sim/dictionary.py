"""The object dictionary of a simulated drive, read once from its EDS file and shared by all nodes.

`canopen` parses the file (CiA 306); what the simulation needs of it is kept in small frozen entries, so that no library
object is touched while frames are served.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cache
from importlib.resources import as_file, files
from struct import Struct

import canopen
from canopen.objectdictionary import ODVariable, datatypes

from drive_gateway.canopen.axis_objects import AXIS_SPAN, PDO_SPAN
from drive_gateway.canopen.pdo_map import entries_of

LONGEST_DOMAIN = 4096
"""Bytes that a domain of the drive can keep."""
STORE_EDS = 0x1021

_CODES = {
    datatypes.INTEGER8: "b",
    datatypes.INTEGER16: "h",
    datatypes.INTEGER32: "i",
    datatypes.UNSIGNED8: "B",
    datatypes.UNSIGNED16: "H",
    datatypes.UNSIGNED32: "I",
}


_OF_AXIS = frozenset((*range(0x2000, 0x2000 + AXIS_SPAN), *range(0x6000, 0x6000 + AXIS_SPAN)))
"""Each axis has its own, 800h apart: the maker's objects and those of the profile."""
_COMMUNICATION = frozenset((*range(0x1400, 0x1404), *range(0x1800, 0x1804)))
_MAPPING = frozenset((*range(0x1600, 0x1604), *range(0x1A00, 0x1A04)))


@dataclass(frozen=True, slots=True)
class Entry:
    """One object or sub-object. Numbers have a `layout`; a text or domain has none, and `text` is its content."""

    key: int
    name: str
    code: str
    """Format character of `struct`; empty for a text or domain."""
    readable: bool
    writable: bool
    mappable: bool
    low: int
    high: int
    default: int
    relative: bool
    """The Node-ID is added to the default."""
    text: bytes
    """Content, or power-on content where it can be written."""

    @property
    def longest(self) -> int:
        """Bytes that a write may bring."""
        return self.layout.size if self.code else LONGEST_DOMAIN

    @property
    def layout(self) -> Struct:
        return Struct("<" + self.code)

    @property
    def bits(self) -> int:
        return 8 * self.layout.size


@dataclass(frozen=True, slots=True)
class Dictionary:
    """All entries by key, and the indices that exist."""

    entries: Mapping[int, Entry]
    indices: frozenset[int]


def key_of(index: int, sub: int = 0) -> int:
    """Index and sub-index as one number, as in the upper 24 bits of a mapping entry."""
    return index << 8 | sub


def axis_key(key: int, axis: int) -> int:
    """Where axis 1 to 3 has what axis 1 has at `key`, an object of its own."""
    return key + (AXIS_SPAN << 8) * (axis - 1)


@cache
def load_dictionary(axes: int = 1) -> Dictionary:
    """The dictionary of `cia402_drive.eds`, with the objects of an axis and its PDOs once for each of 1 to 3 `axes`."""
    one = _of_one_axis()
    every = [entry for number in range(1, axes + 1) for entry in _of_axis(one, number)]
    return Dictionary({entry.key: entry for entry in every}, frozenset(entry.key >> 8 for entry in every))


def _of_axis(one: Dictionary, number: int) -> Iterator[Entry]:
    """What the axis has by itself; axis 1 has the objects of the node too."""
    if number == 1:
        yield from one.entries.values()
        return
    for entry in one.entries.values():
        index, sub = entry.key >> 8, entry.key & 0xFF
        if index in _OF_AXIS:
            yield replace(entry, key=axis_key(entry.key, number))
        elif index in _COMMUNICATION:
            yield replace(entry, key=key_of(index + PDO_SPAN * (number - 1), sub))
        elif index in _MAPPING:
            mapped = entries_of((entry.default,), number)[0] if sub else entry.default
            yield replace(entry, key=key_of(index + PDO_SPAN * (number - 1), sub), default=mapped)


def _of_one_axis() -> Dictionary:
    with as_file(files("drive_gateway.sim") / "cia402_drive.eds") as path:
        parsed = canopen.import_od(str(path), node_id=0)
        own_eds = path.read_bytes()
    entries: dict[int, Entry] = {}
    for item in parsed.values():
        for variable in [item] if isinstance(item, ODVariable) else item.values():
            entry = _entry(variable)
            entries[entry.key] = entry
    stored = key_of(STORE_EDS)
    entries[stored] = replace(entries[stored], text=own_eds)
    return Dictionary(entries, frozenset(parsed))


def _entry(variable: ODVariable) -> Entry:
    default: int | str | None = variable.default
    code = _CODES.get(variable.data_type or 0, "")
    low, high = _range(code)
    return Entry(
        key=key_of(variable.index, variable.subindex),
        name=variable.name,
        code=code,
        readable=variable.readable,
        writable=variable.writable,
        mappable=variable.pdo_mappable,
        low=low if variable.min is None else variable.min,
        high=high if variable.max is None else variable.max,
        default=default if isinstance(default, int) else 0,
        relative=variable.relative,
        text=default.encode("ascii") if isinstance(default, str) else b"",
    )


def _range(code: str) -> tuple[int, int]:
    if not code:
        return 0, 0
    bits = 8 * Struct("<" + code).size
    return (-(1 << bits - 1), (1 << bits - 1) - 1) if code.islower() else (0, (1 << bits) - 1)
