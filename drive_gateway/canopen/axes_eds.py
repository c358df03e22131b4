"""The EDS of the simulated drive, CiA 402 with objects of its own, as a node with one to three has it (CiA 306).

Each further axis has its own objects: those of the profile and of the maker 800h on, its PDOs 64 on. The device type
(1000h) of a node with several axes does not say how each is built; 67FFh, 6FFFh and 77FFh do (CiA 301).
"""

from collections.abc import Iterable
from configparser import RawConfigParser
from functools import cache
from importlib.resources import files
from io import StringIO
from re import fullmatch

import canopen

from drive_gateway.canopen.axis_objects import AXIS_SPAN, PDO_SPAN
from drive_gateway.canopen.pdo_map import entries_of

NAME = "cia402_drive.eds"
_OF_AXIS = frozenset((*range(0x2000, 0x2000 + AXIS_SPAN), *range(0x6000, 0x6000 + AXIS_SPAN)))
"""Objects of the maker and of the profile."""
_MAPPING = frozenset((*range(0x1600, 0x1604), *range(0x1A00, 0x1A04)))
_PDO = frozenset((*range(0x1400, 0x1404), *range(0x1800, 0x1804), *_MAPPING))
_SEVERAL = 0xFFFF0000
"""Upper half of 1000h of a node with several axes."""
_DEVICE_TYPE = "1000"
_AXIS_TYPE = "67FF"


class _File(StringIO):
    """Text that `canopen` takes for an open file: it looks at the name's ending."""

    name = NAME


class _Sections(RawConfigParser):
    """Keys as they are written."""

    def optionxform(self, optionstr: str) -> str:
        return optionstr


@cache
def objects_of_axes(axes: int = 1) -> canopen.ObjectDictionary:
    """The objects of `eds_text`; not to be changed, they are read once."""
    return canopen.import_od(_File(eds_text(axes)), node_id=0)


def eds_text(axes: int = 1) -> str:
    """The file that a node with 1 to 3 `axes` keeps."""
    shipped = files("drive_gateway.sim").joinpath(NAME).read_text("ascii")
    if axes == 1:
        return shipped
    sections = _Sections()
    sections.read_string(shipped)
    _tell_types(sections)
    for section in sections.sections():
        for axis in range(2, axes + 1):
            _add(sections, section, axis)
    for kind in ("OptionalObjects", "ManufacturerObjects"):
        listed = _listed(sections, kind)
        _list(sections, kind, [moved for n in range(1, axes + 1) for index in listed if (moved := _moved(index, n))])
    for direction in ("NrOfRXPDO", "NrOfTXPDO"):
        sections["DeviceInfo"][direction] = str(axes * int(sections["DeviceInfo"][direction]))
    written = StringIO()
    sections.write(written, space_around_delimiters=False)
    return written.getvalue()


def _tell_types(sections: _Sections) -> None:
    """The type of one drive stands at 67FFh; that of the node says that there are several, and their profile."""
    node = sections[_DEVICE_TYPE]
    sections[_AXIS_TYPE] = {**node, "ParameterName": "Device type of the axis"}
    _list(sections, "OptionalObjects", [*_listed(sections, "OptionalObjects"), int(_AXIS_TYPE, 16)])
    node["DefaultValue"] = f"0x{_SEVERAL | int(node['DefaultValue'], 16) & 0xFFFF:08X}"


def _listed(sections: _Sections, kind: str) -> list[int]:
    return [int(index, 16) for name, index in sections[kind].items() if name != "SupportedObjects"]


def _list(sections: _Sections, kind: str, indices: Iterable[int]) -> None:
    listed = {str(number): f"0x{index:04X}" for number, index in enumerate(indices, start=1)}
    sections[kind] = {"SupportedObjects": str(len(listed)), **listed}


def _add(sections: _Sections, section: str, axis: int) -> None:
    """The same section for a further axis, if it is about an object that each axis has."""
    found = fullmatch(r"([0-9A-F]{4})((?:sub[0-9A-F]+)?)", section)
    moved = None if found is None else _moved(int(found[1], 16), axis)
    if found is None or moved is None:
        return
    values = dict(sections[section])
    if not found[2]:
        values["ParameterName"] += f", axis {axis}"
    elif found[2] != "sub0" and int(found[1], 16) in _MAPPING:
        values["DefaultValue"] = f"0x{entries_of((int(values['DefaultValue'], 16),), axis)[0]:08X}"
    sections[f"{moved:04X}{found[2]}"] = values


def _moved(index: int, axis: int) -> int | None:
    """Where `axis` has what axis 1 has at `index`; `None` when it has no such object of its own."""
    if axis == 1:
        return index
    if index in _OF_AXIS:
        return index + AXIS_SPAN * (axis - 1)
    return index + PDO_SPAN * (axis - 1) if index in _PDO else None
