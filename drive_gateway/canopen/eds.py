"""Names and types of a node's objects, from its EDS or DCF file (CiA 306)."""

import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cache
from math import inf
from pathlib import Path
from struct import Struct

from canopen.objectdictionary import datatypes

from drive_gateway.canopen.axes_eds import eds_text
from drive_gateway.canopen.axis_objects import first_axis_index, index_of
from drive_gateway.canopen.eds_file import EdsError, FileContent, FileObject, is_dcf, parse_eds, read_eds, whole_number

TYPES = {
    "INTEGER8": (1, True),
    "INTEGER16": (2, True),
    "INTEGER32": (4, True),
    "INTEGER64": (8, True),
    "UNSIGNED8": (1, False),
    "UNSIGNED16": (2, False),
    "UNSIGNED32": (4, False),
    "UNSIGNED64": (8, False),
}
"""Data types of CiA 301 that are numbers: bytes, and whether they have a sign."""
_WIDTHS = (8, 16, 24, 32, 40, 48, 56, 64)
_SIZES = {
    datatypes.BOOLEAN: (1, False),
    **{getattr(datatypes, f"INTEGER{bits}"): (bits // 8, True) for bits in _WIDTHS},
    **{getattr(datatypes, f"UNSIGNED{bits}"): (bits // 8, False) for bits in _WIDTHS},
}
_REALS = {datatypes.REAL32: Struct("<f"), datatypes.REAL64: Struct("<d")}
_REAL_OF_SIZE = {layout.size: layout for layout in _REALS.values()}
PLAIN = "plain CiA 402"
_MAKERS = range(0x2000, 0x6000)
_ADDRESS = re.compile(r"(?:0x)?([0-9A-Fa-f]{4})h?(?::([0-9A-Fa-f]{1,2}))?")


@dataclass(frozen=True, slots=True)
class ObjectEntry:
    """One object or sub-object. Numbers have a `size` in bytes; for texts, domains and unknown types it is 0."""

    index: int
    sub: int
    name: str
    size: int
    signed: bool
    text: bool
    domain: bool
    """Content of any length, such as a file."""
    readable: bool
    writable: bool
    low: float | None = None
    """Lowest value, where the file says it."""
    high: float | None = None
    """Highest value, where the file says it."""
    real: bool = False
    """A number with a fraction, REAL32 or REAL64 (IEEE 754)."""
    octets: bool = False
    """Bytes without a meaning of their own, OCTET_STRING: people write them in hex."""
    wide: bool = False
    """A text of 16-bit characters, UNICODE_STRING."""

    @property
    def described(self) -> bool:
        """Its type is known."""
        return bool(self.size) or self.text or self.domain or self.octets

    @property
    def kind(self) -> str:
        """Its data type for people, where it is a number: UNSIGNED16, REAL32."""
        return f"{'REAL' if self.real else 'INTEGER' if self.signed else 'UNSIGNED'}{8 * self.size}"

    @property
    def makers(self) -> bool:
        """In the area where each maker has objects of its own."""
        return self.index in _MAKERS

    @property
    def address(self) -> str:
        return f"{self.index:04X}h:{self.sub:02X}"

    def show(self, data: bytes) -> str:
        """Bytes for people: a number, decimal and in hex, a text, a domain's length, or the bytes themselves."""
        if self.text:
            text = data.decode("utf-16-le" if self.wide else "ascii", "replace")
            return repr(text.rstrip("\0"))
        if self.domain:
            return f"{len(data)} bytes"
        if not self.size or not 0 < len(data) <= 8:
            return data.hex(" ") or "no bytes"
        if self.real and len(data) in _REAL_OF_SIZE:
            (real,) = _REAL_OF_SIZE[len(data)].unpack(data)
            return f"{real:.9g} ({int.from_bytes(data, 'little'):0{2 * len(data)}X}h)"
        value = int.from_bytes(data, "little", signed=self.signed)
        return f"{value} ({int.from_bytes(data, 'little'):0{2 * len(data)}X}h)"

    def typed(self, size: int, signed: bool) -> "ObjectEntry":
        """The same as a number of `size` bytes."""
        return replace(self, size=size, signed=signed)

    def pack(self, text: str) -> bytes:
        """The bytes of a value as people write it: decimal, 0x..., or ...h; octets in hex. Raises `EdsError`."""
        if self.text:
            return text.encode("utf-16-le" if self.wide else "ascii", "replace")
        if self.octets:
            return self._octets(text)
        if self.domain:
            raise EdsError(f"{self.address} {self.name} is a domain", "@FILE, the name of a file with its bytes")
        if self.real:
            return self._real(text)
        self._known()
        try:
            value = int(text[:-1], 16) if text.lower().endswith("h") else int(text, 0)
        except ValueError as error:
            raise EdsError(f"{text!r} is no whole number", "123, -5, 0x6F, 6Fh") from error
        return self.pack_number(value)

    def _known(self) -> None:
        if not self.size:
            allowed = f"an EDS that describes it, or its type: {', '.join(TYPES)}"
            raise EdsError(f"{self.address} {self.name}, whose type is not known", allowed)

    def _octets(self, text: str) -> bytes:
        try:
            return bytes.fromhex(text.removeprefix("0x"))
        except ValueError as error:
            raise EdsError(f"{text!r} for {self.address} {self.name}", "bytes in hex, such as 01 0A FF") from error

    def _real(self, text: str) -> bytes:
        """As a decimal number, or as its bit pattern."""
        try:
            if text.lower().startswith("0x"):
                data = int(text, 16).to_bytes(self.size, "little")
            else:
                data = _REAL_OF_SIZE[self.size].pack(float(text))
        except (ValueError, OverflowError) as error:
            allowed = f"a {self.kind}, such as -0.25 or 1e-3, or its bit pattern, 0x..."
            raise EdsError(f"{text!r} for {self.address} {self.name}", allowed) from error
        (value,) = _REAL_OF_SIZE[self.size].unpack(data)
        low, high = -inf if self.low is None else self.low, inf if self.high is None else self.high
        if not (low <= value <= high or self.low is self.high is None):
            raise EdsError(f"{text} does not fit {self.address} {self.name}", f"{low:g} to {high:g}")
        return data

    def pack_number(self, value: int) -> bytes:
        """The bytes of a number. Raises `EdsError` with the range."""
        if self.real:
            return self._real(str(value))
        self._known()
        low = -(1 << 8 * self.size - 1) if self.signed else 0
        high = (1 << 8 * self.size - self.signed) - 1
        low = low if self.low is None else max(low, round(self.low))
        high = high if self.high is None else min(high, round(self.high))
        if not low <= value <= high:
            raise EdsError(f"{value} does not fit {self.address} {self.name}", f"{low} to {high}")
        return value.to_bytes(self.size, "little", signed=self.signed)


class Eds:
    """The objects of one kind of node. Without a file those that CiA 402 has, and none of a maker's own."""

    def __init__(self, file: str = "", axes: int = 1, more: Sequence[ObjectEntry] = ()) -> None:
        """`axes`: of the node, 1 to 3; a file says its own. `more`: objects that are known beside those of CiA 402.

        Raises `EdsError`: the file is missing or no EDS.
        """
        self._content = read_eds(file) if file else _plain(axes)
        self._entries = {(item.index, item.sub): _entry(item) for item in self._content.objects}
        if not file:
            self._entries |= {(entry.index, entry.sub): entry for entry in more}
        self._dcf = is_dcf(file)
        self.name = Path(file).name if file else PLAIN
        self.node_id = self._content.node_id if self._dcf else None
        """Of the one device that a DCF is for, if it says it."""
        self.bitrate = self._content.bitrate if self._dcf else None
        """[bit/s] in a DCF, if it says it."""

    def __iter__(self) -> Iterator[ObjectEntry]:
        """All objects in the order of their indices."""
        return iter(self._entries.values())

    def __contains__(self, key: tuple[int, int]) -> bool:
        """It describes the object at this index and sub-index."""
        return key in self._entries

    def parameters(self, wanted: Callable[[int, int], bool]) -> Iterator[tuple[ObjectEntry, bytes]]:
        """What a DCF says to be written: each writable object that has a ParameterValue. An EDS says none.

        Args:
            wanted: whether an object, by index and sub-index, is asked for.

        Raises:
            EdsError: a value does not fit its object.
        """
        for item in self._content.objects if self._dcf else ():
            entry = self._entries[item.index, item.sub]
            if item.value and entry.writable and not entry.domain and wanted(entry.index, entry.sub):
                yield entry, _packed(entry, item.value, self.node_id)

    def find(self, text: str, axis: int = 1) -> ObjectEntry:
        """The object at an address such as 6041, 6041h:00, 0x1018:1, or of that name.

        An address is taken as it is; the name of an object of the profile means that of `axis`. An address that the
        file does not have is an object of unknown type. Raises `EdsError` for anything else.
        """
        address = _ADDRESS.fullmatch(text)
        if address is not None:
            return self._at(int(address[1], 16), int(address[2] or "0", 16))
        named = [entry for entry in self if entry.name.lower() == text.lower()]
        named = [entry for entry in named if index_of(first_axis_index(entry.index), axis) == entry.index] or named
        if len(named) != 1:
            raise EdsError(f"{text!r} is no object of {self.name}", "INDEX:SUB in hex, or one name of it")
        return self._at(index_of(named[0].index, axis), named[0].sub)

    def _at(self, index: int, sub: int) -> ObjectEntry:
        """A file that does not describe the further axes of its node: they have what axis 1 has."""
        found = self._entries.get((index, sub)) or self._entries.get((first_axis_index(index), sub))
        if found is None:
            return ObjectEntry(index, sub, f"not in {self.name}", 0, False, False, False, True, True)
        return replace(found, index=index)


@cache
def _plain(axes: int) -> FileContent:
    """CiA 402 as the simulated drive has it, without what is that drive's own."""
    content = parse_eds(eds_text(axes))
    return replace(content, objects=tuple(item for item in content.objects if item.index not in _MAKERS))


def _entry(item: FileObject) -> ObjectEntry:
    kind = item.kind
    size, signed = (_REALS[kind].size, True) if kind in _REALS else _SIZES.get(kind, (0, False))
    low, high = _limits(item, size, signed)
    return ObjectEntry(
        index=item.index,
        sub=item.sub,
        name=item.name,
        size=size,
        signed=signed,
        text=kind in (datatypes.VISIBLE_STRING, datatypes.UNICODE_STRING),
        domain=kind == datatypes.DOMAIN,
        readable="r" in item.access or item.access == "const",
        writable="w" in item.access,
        low=low,
        high=high,
        real=kind in _REALS,
        octets=kind == datatypes.OCTET_STRING,
        wide=kind == datatypes.UNICODE_STRING,
    )


def _limits(item: FileObject, size: int, signed: bool) -> tuple[float | None, float | None]:
    """Some makers' tools write 0 and 0 where there are none."""
    number = _real if item.kind in _REALS else whole_number
    low, high = number(item.low), number(item.high)
    if signed and item.kind not in _REALS:
        low, high = _signed(low, size), _signed(high, size)
    nothing = low is not None and high is not None and (low > high or low == high == 0)
    return (None, None) if nothing else (low, high)


def _signed(number: float | None, size: int) -> float | None:
    """A negative number may be written as its bit pattern, 0xFFFE for -2."""
    return number if number is None or number < 1 << 8 * size - 1 else number - (1 << 8 * size)


def _real(text: str) -> float | None:
    try:
        return float(text)
    except ValueError:
        return None


def _packed(entry: ObjectEntry, raw: str, node_id: int | None) -> bytes:
    """The bytes of a ParameterValue."""
    if entry.text or entry.octets or entry.real:
        return entry.pack(raw)
    value = whole_number(raw)
    formula = _FORMULA.fullmatch(raw)
    if formula is not None and node_id is not None:
        value = node_id + (whole_number(formula[1] or formula[2] or "0") or 0)
    if value is None:
        allowed = "whole numbers: 123, -5, 0x6F; $NODEID+0x200 where the DCF says its NodeID"
        raise EdsError(f"the ParameterValue {raw!r} of {entry.address} {entry.name}", allowed)
    pattern = entry.signed and raw.lower().startswith("0x")
    return entry.pack_number(round(_signed(value, entry.size) or 0) if pattern else value)


_FORMULA = re.compile(r"(?:(\w+)\s*\+\s*)?\$NODEID(?:\s*\+\s*(\w+))?", re.IGNORECASE)
