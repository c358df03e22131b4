"""Names and types of a node's objects, from its EDS or DCF file (CiA 306, read by `canopen`)."""

import re
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import canopen
from canopen.objectdictionary import ODVariable, datatypes

from drive_gateway.canopen.axes_eds import NAME, objects_of_axes
from drive_gateway.canopen.axis_objects import first_axis_index, index_of
from drive_gateway.errors import GatewayError

_SIZES = {
    datatypes.BOOLEAN: (1, False),
    datatypes.INTEGER8: (1, True),
    datatypes.INTEGER16: (2, True),
    datatypes.INTEGER32: (4, True),
    datatypes.INTEGER64: (8, True),
    datatypes.UNSIGNED8: (1, False),
    datatypes.UNSIGNED16: (2, False),
    datatypes.UNSIGNED32: (4, False),
    datatypes.UNSIGNED64: (8, False),
}
_ADDRESS = re.compile(r"(?:0x)?([0-9A-Fa-f]{4})h?(?::([0-9A-Fa-f]{1,2}))?")


class EdsError(GatewayError):
    """An EDS file that cannot be read, an object that it does not have, or a value that does not fit the object."""


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

    @property
    def address(self) -> str:
        return f"{self.index:04X}h:{self.sub:02X}"

    def show(self, data: bytes) -> str:
        """Bytes for people: a number, decimal and in hex, a text, a domain's length, or the bytes themselves."""
        if self.text:
            return repr(data.rstrip(b"\0").decode("ascii", "replace"))
        if self.domain:
            return f"{len(data)} bytes"
        if not self.size or len(data) > 8:
            return data.hex(" ")
        value = int.from_bytes(data, "little", signed=self.signed)
        return f"{value} ({int.from_bytes(data, 'little'):0{2 * len(data)}X}h)"

    def pack(self, text: str) -> bytes:
        """The bytes of a value as people write it: decimal, 0x..., or ...h. Raises `EdsError` with the range."""
        if self.text:
            return text.encode("ascii", "replace")
        if self.domain:
            raise EdsError(f"{self.address} {self.name} is a domain; name the file with its bytes as @FILE")
        if not self.size:
            raise EdsError(f"{self.address} {self.name} has a type that this program cannot write")
        low = -(1 << 8 * self.size - 1) if self.signed else 0
        high = (1 << 8 * self.size - self.signed) - 1
        try:
            value = int(text[:-1], 16) if text.lower().endswith("h") else int(text, 0)
        except ValueError as error:
            raise EdsError(f"{text!r} is no whole number; allowed are 123, -5, 0x6F, 6Fh") from error
        if not low <= value <= high:
            raise EdsError(f"{value} does not fit {self.address} {self.name}; allowed are {low} to {high}")
        return value.to_bytes(self.size, "little", signed=self.signed)


class Eds:
    """The objects of one kind of node. Without a file: those of the simulated drive, which are plain CiA 402."""

    def __init__(self, file: str = "", axes: int = 1) -> None:
        """`axes`: of the node, 1 to 3; a file says its own. Raises `EdsError`: the file is missing or no EDS."""
        try:
            self._parsed = canopen.import_od(file, node_id=0) if file else objects_of_axes(axes)
        except (OSError, ValueError, KeyError) as error:
            raise EdsError(f"{file}: cannot be read as EDS or DCF: {error}") from error
        self.name = Path(file).name if file else NAME

    def __iter__(self) -> Iterator[ObjectEntry]:
        """All objects in the order of their indices."""
        for item in self._parsed.values():
            for variable in [item] if isinstance(item, ODVariable) else item.values():
                yield _entry(variable, "" if isinstance(item, ODVariable) else f"{item.name}, ")

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
            raise EdsError(f"{text!r} is no object of {self.name}; allowed are INDEX:SUB in hex, or one name of it")
        return self._at(index_of(named[0].index, axis), named[0].sub)

    def _at(self, index: int, sub: int) -> ObjectEntry:
        """A file that does not describe the further axes of its node: they have what axis 1 has."""
        entries = {(entry.index, entry.sub): entry for entry in self}
        found = entries.get((index, sub)) or entries.get((first_axis_index(index), sub))
        if found is None:
            return ObjectEntry(index, sub, f"not in {self.name}", 0, False, False, False, True, True)
        return replace(found, index=index)


def _entry(variable: ODVariable, group: str) -> ObjectEntry:
    size, signed = _SIZES.get(variable.data_type or 0, (0, False))
    return ObjectEntry(
        index=variable.index,
        sub=variable.subindex,
        name=group + variable.name,
        size=size,
        signed=signed,
        text=variable.data_type == datatypes.VISIBLE_STRING,
        domain=variable.data_type == datatypes.DOMAIN,
        readable=variable.readable,
        writable=variable.writable,
    )
