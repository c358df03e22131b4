"""The object dictionary of a simulated drive or I/O node, read once from its EDS file and shared by all nodes.

`canopen` parses the file (CiA 306); what the simulation needs of it is kept in small frozen entries, so that no library
object is touched while frames are served.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache
from importlib.resources import files
from io import StringIO
from struct import Struct

import canopen
from canopen.objectdictionary import ODVariable, datatypes

from drive_gateway.canopen.axes_eds import eds_text, objects_of_axes
from drive_gateway.canopen.axis_objects import AXIS_SPAN
from drive_gateway.canopen.io_map import DIGITAL_INPUTS, DIGITAL_OUTPUTS, ERROR_MODE, ERROR_VALUE, IO_EDS

LONGEST_DOMAIN = 4096
"""Bytes that a domain of the drive can keep."""
STORE_EDS = 0x1021
RPDO1_MAPPING, TPDO1_MAPPING = 0x1600, 0x1A00

_CODES = {
    datatypes.INTEGER8: "b",
    datatypes.INTEGER16: "h",
    datatypes.INTEGER32: "i",
    datatypes.UNSIGNED8: "B",
    datatypes.UNSIGNED16: "H",
    datatypes.UNSIGNED32: "I",
}


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
    """The dictionary of a node with 1 to 3 `axes`: `cia402_drive.eds`, with the objects of an axis once for each."""
    parsed = objects_of_axes(axes)
    entries: dict[int, Entry] = {}
    for item in parsed.values():
        for variable in [item] if isinstance(item, ODVariable) else item.values():
            entry = _entry(variable)
            entries[entry.key] = entry
    stored = key_of(STORE_EDS)
    entries[stored] = replace(entries[stored], text=eds_text(axes).encode("ascii"))
    return Dictionary(entries, frozenset(parsed))


@cache
def load_io_dictionary(input_bytes: int, output_bytes: int) -> Dictionary:
    """That of an I/O node with so many bytes each way, 0 to 8: `cia401_io.eds` without what it has not got."""
    text = files("drive_gateway.sim").joinpath(IO_EDS).read_text("ascii")
    parsed = canopen.import_od(_File(text), node_id=0)
    lengths = dict.fromkeys((DIGITAL_INPUTS, TPDO1_MAPPING), input_bytes)
    lengths |= dict.fromkeys((DIGITAL_OUTPUTS, ERROR_MODE, ERROR_VALUE, RPDO1_MAPPING), output_bytes)
    entries: dict[int, Entry] = {}
    for item in parsed.values():
        most = lengths.get(item.index)
        mapping = item.index in (TPDO1_MAPPING, RPDO1_MAPPING)
        if most == 0 and not mapping:
            continue
        for variable in [item] if isinstance(item, ODVariable) else item.values():
            entry = _entry(variable)
            if most is not None and variable.subindex == 0:
                entry = replace(entry, default=most)
            elif most is not None and variable.subindex > most:
                if not mapping:
                    continue
                entry = replace(entry, default=0)
            entries[entry.key] = entry
    stored = key_of(STORE_EDS)
    entries[stored] = replace(entries[stored], text=text.encode("ascii"))
    return Dictionary(entries, frozenset(key >> 8 for key in entries))


class _File(StringIO):
    """Text that `canopen` takes for an open file: it looks at the name's ending."""

    name = "io.eds"


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
