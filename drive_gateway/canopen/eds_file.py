"""An EDS or DCF file as makers' tools write it, read without loss, with what is wrong in it said for people (CiA 306).

The reader of `canopen` refuses files with an empty VendorNumber, a dummy or a line of comment left out, or a domain
without DataType, and leaves out without a word: sub-objects of [....SUB0], all but the first of a compact array,
limits of which only one is said, and those of INTEGER24 and REAL32.
"""

import configparser
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from drive_gateway.errors import GatewayError

_ENCODINGS = ("utf-8-sig", "cp1252")
"""Files of today, and those that makers' tools write on Windows."""
_ALLOWED = "an EDS or DCF file as CiA 306 describes it"
_KEYS = {
    key.lower(): key
    for key in (
        "ParameterName", "ObjectType", "DataType", "AccessType", "LowLimit", "HighLimit", "DefaultValue",
        "ParameterValue", "CompactSubObj", "NrOfEntries", "NodeID", "Baudrate",
    )
}  # fmt: skip
"""Keys that are read; files write them in any case."""
_HEADER = re.compile(
    r"\[\s*([0-9A-Fa-f]{4})\s*(?:(sub)([0-9A-Fa-f]{1,2})|(value|name))?\s*\]\s*(?:;.*)?", re.IGNORECASE
)
_SUB = re.compile(r"([0-9A-F]{4})sub([0-9A-F]+)")
_LINE_END = re.compile(r"\r\n|\r|\n")
_DOMAIN_OBJECT, _DOMAIN, _UNSIGNED8 = 2, 0x0F, 0x05
_LAST_PLAIN_TYPE = 0x1B
"""Data types above it are of the file's own."""
_FIRST_INDEX = 0x1000
"""Below are data types and dummies, which no node has as objects."""
_MOST_SUBS = 254


class EdsError(GatewayError):
    """An EDS file that cannot be read, an object that it does not have, or a value that does not fit the object."""

    def __init__(self, found: str, allowed: str) -> None:
        super().__init__(f"{found}; allowed: {allowed}")
        self.found = found
        self.allowed = allowed


@dataclass(frozen=True, slots=True)
class FileObject:
    """One object or sub-object as the file says it. Limits and values are its text, empty where it says none."""

    index: int
    sub: int
    name: str
    """With that of its array or record before it."""
    kind: int
    """Data type (CiA 301)."""
    access: str
    """ro, wo, rw, rwr, rww or const."""
    low: str
    high: str
    default: str
    value: str
    """ParameterValue, of one device."""


@dataclass(frozen=True, slots=True)
class FileContent:
    """All objects in the order of their indices, and the one device that a DCF is for, if it says it."""

    objects: tuple[FileObject, ...]
    node_id: int | None = None
    bitrate: int | None = None
    """[bit/s]"""


def read_eds(file: str) -> FileContent:
    """The objects of a file.

    Raises:
        EdsError: it cannot be read; says what is wrong and where.
    """
    name = Path(file).name
    try:
        return parse_eds(_text(file))
    except EdsError as error:
        raise EdsError(f"{name}: cannot be read: {error.found}", error.allowed) from error


def parse_eds(text: str) -> FileContent:
    """The objects of a file's text.

    Raises:
        EdsError: says what is wrong and where.
    """
    sections = _sections(text)
    objects = sorted(_objects(sections), key=lambda item: (item.index, item.sub))
    if not objects:
        raise EdsError("no object in it", _ALLOWED)
    device = next((sections[name] for name in sections if name.lower() in _DEVICE), {})
    node_id, rate = (_number("DeviceComissioning", device, key) for key in ("NodeID", "Baudrate"))
    return FileContent(tuple(objects), node_id or None, 1000 * rate if rate else None)


_DEVICE = ("devicecomissioning", "devicecommissioning")
"""CiA 306 has it with one m."""
_Section = Mapping[str, str]


def is_dcf(file: str) -> bool:
    """It says the values of one device, not those of all of its kind."""
    return Path(file).suffix.lower() == ".dcf"


def whole_number(text: str) -> int | None:
    """A number as CiA 306 writes it: 123, -5, 0x6F; `None`: no number, or one with a leading 0 that may be octal."""
    text = text.strip()
    try:
        return int(text, 0)
    except ValueError:
        octal = re.fullmatch(r"-?0+[0-7]", text)  # 007 is 7 in both ways
        return int(text) if octal else None


class _Parser(configparser.RawConfigParser):
    """Sections in the form [1A00sub1], known keys in that of CiA 306."""

    def __init__(self) -> None:
        super().__init__(delimiters=("=",), comment_prefixes=(";", "#"), empty_lines_in_values=False)

    def optionxform(self, optionstr: str) -> str:
        return _KEYS.get(optionstr.lower(), optionstr)


def _sections(text: str) -> dict[str, _Section]:
    # A line that begins with a blank would go on with the value before it.
    lines = [_header(line.strip()) for line in _LINE_END.split(text)]
    parser = _Parser()
    try:
        parser.read_string("\n".join(lines))
    except configparser.Error as error:
        raise EdsError(_reason(error), _ALLOWED) from error
    return {name: dict(parser[name]) for name in parser.sections()}


def _header(line: str) -> str:
    found = _HEADER.fullmatch(line)
    if found is None:
        return line
    sub = f"sub{int(found[3], 16):X}" if found[2] else (found[4] or "").lower()
    return f"[{found[1].upper()}{sub}]"


def _objects(sections: Mapping[str, _Section]) -> Iterator[FileObject]:
    with_subs = {found[1] for name in sections if (found := _SUB.fullmatch(name))}
    for name, section in sections.items():
        found = _SUB.fullmatch(name)
        index = int(found[1] if found else name, 16) if found or re.fullmatch("[0-9A-F]{4}", name) else 0
        if index < _FIRST_INDEX:
            continue
        if found is not None:
            if found[1] not in sections:
                raise EdsError(f"a sub-object without the section of its object: [{name}]", _ALLOWED)
            group = _said(found[1], sections[found[1]], "ParameterName")
            yield _object(name, section, sections, (index, int(found[2], 16)), f"{group}, ")
        elif compact := _number(name, section, "CompactSubObj"):
            yield from _compact(name, section, sections, compact)
        elif name not in with_subs and ("DataType" in section or _number(name, section, "ObjectType") not in (0, 8, 9)):
            yield _object(name, section, sections, (index, 0))


def _object(
    name: str, section: _Section, sections: Mapping[str, _Section], key: tuple[int, int], group: str = ""
) -> FileObject:
    domain = _number(name, section, "ObjectType") == _DOMAIN_OBJECT
    kind = _DOMAIN if domain and not section.get("DataType") else _kind(name, section, sections)
    access = section.get("AccessType", "") or ("rw" if domain else _said(name, section, "AccessType"))
    return FileObject(
        index=key[0],
        sub=key[1],
        name=group + _said(name, section, "ParameterName"),
        kind=kind,
        access=access.partition(";")[0].strip().lower(),
        low=section.get("LowLimit", ""),
        high=section.get("HighLimit", ""),
        default=section.get("DefaultValue", ""),
        value=section.get("ParameterValue", ""),
    )


def _compact(name: str, section: _Section, sections: Mapping[str, _Section], count: int) -> Iterator[FileObject]:
    """An array of alike sub-objects in one section; [....Name] and [....Value] say names and values of some."""
    first = _object(name, section, sections, (int(name, 16), 1))
    entries = FileObject(first.index, 0, f"{first.name}, number of entries", _UNSIGNED8, "ro", "", "", str(count), "")
    names, values = sections.get(f"{name}name", {}), sections.get(f"{name}value", {})
    for sub in range(min(count, _MOST_SUBS) + 1):
        if f"{name}sub{sub:X}" in sections:
            continue
        sub_name, value = names.get(str(sub), str(sub)), values.get(str(sub), first.value)
        yield replace(first, sub=sub, name=f"{first.name}, {sub_name}", value=value) if sub else entries


def _kind(name: str, section: _Section, sections: Mapping[str, _Section]) -> int:
    """Its data type; one of the file's own is a section whose sub-object 1 says the type (CANFestival)."""
    _said(name, section, "DataType")
    kind = _number(name, section, "DataType") or 0
    if kind <= _LAST_PLAIN_TYPE:
        return kind
    for own in (f"{kind:X}sub1", f"{kind:04X}sub1"):
        if own in sections:
            return _number(own, sections[own], "DefaultValue") or 0
    return kind


def _said(name: str, section: _Section, key: str) -> str:
    if not section.get(key):
        raise EdsError(f"section [{name}] without {key}", _ALLOWED)
    return section[key]


def _number(name: str, section: _Section, key: str) -> int | None:
    """Text behind a semicolon is a comment; nothing is no number."""
    text = section.get(key, "").partition(";")[0].strip()
    number = whole_number(text)
    if number is None and text:
        raise EdsError(f"a value that is no number ([{name}] {key}={text})", "whole numbers: 123, -5, 0x6F")
    return number


def _text(file: str) -> str:
    try:
        data = Path(file).read_bytes()
    except OSError as error:
        raise EdsError(error.strerror or str(error), _ALLOWED) from error
    for encoding in _ENCODINGS:
        try:
            return data.decode(encoding)
        except UnicodeDecodeError as error:
            place = data.count(b"\n", 0, error.start) + 1
            found = f"the byte {data[error.start]:#04x} in line {place}"
    raise EdsError(found, "text in UTF-8 or Windows-1252")


def _reason(error: configparser.Error) -> str:
    """What is wrong, and where as far as it is known."""
    match error:
        case configparser.MissingSectionHeaderError(lineno=line):
            return f"text in line {line} before the first [section]"
        case configparser.DuplicateSectionError(section=section, lineno=line):
            return f"a second section [{section}] in line {line}"
        case configparser.DuplicateOptionError(section=section, option=option, lineno=line):
            return f"a second {option} in section [{section}], line {line}"
        case configparser.ParsingError(errors=errors) if errors:
            return f"line {errors[0][0]} is neither a [section] nor KEY=VALUE"
    return str(error)
