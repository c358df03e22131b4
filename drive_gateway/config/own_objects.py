"""Objects of a drive that the gateway knows nothing of: what the drives file and the drive's DCF say of them."""

from typing import Annotated, Literal

from pydantic import BaseModel, Field

from cell.config.units import STRICT
from drive_gateway.canopen.axis_objects import first_axis_index, index_of
from drive_gateway.canopen.eds import TYPES, Eds, ObjectEntry
from drive_gateway.canopen.eds_file import EdsError, is_dcf
from drive_gateway.config.gateway_objects import CYCLE_PERIOD, said_by
from drive_gateway.config.known_drive import eds_of
from drive_gateway.config.object_address import ObjectAddress, address_of
from drive_gateway.config.settings import OwnObject


class TypedValue(BaseModel):
    """A number for an object that no EDS describes."""

    model_config = STRICT
    value: int = Field(description="the number")
    type: Literal[
        "INTEGER8", "INTEGER16", "INTEGER32", "INTEGER64", "UNSIGNED8", "UNSIGNED16", "UNSIGNED32", "UNSIGNED64"
    ] = Field(description="data type of the object (CiA 301)")


OwnValue = int | str | TypedValue
OwnObjects = Annotated[
    dict[ObjectAddress, OwnValue],
    Field(description="objects of the drive's own, written at each boot and read back: {'2000:00': 10}"),
]


class EdsFiles:
    """Each file read once."""

    def __init__(self) -> None:
        self._read: dict[tuple[str, int, str | None], Eds] = {}

    def get(self, file: str, axis: int, like: str | None = None) -> Eds:
        """As `eds_of`, with at least this axis."""
        key = (file, 0, None) if file else ("", axis, like)
        if key not in self._read:
            self._read[key] = eds_of(file, axis, like)
        return self._read[key]


def own_objects(
    objects: dict[str, OwnValue], axis: int, file: str, files: EdsFiles, like: str | None = None
) -> tuple[OwnObject, ...]:
    """What is written to one axis: the DCF's values with axis 1, and over them those of the drives file.

    Args:
        objects: of the drives file, by address.
        axis: of its node, 1 to 3.
        file: EDS or DCF; empty: none.
        files: where it is read.
        like: known drive, whose objects are known without a file.

    Raises:
        EdsError: a file, an object or a value that `cell check` refuses.
    """
    if not objects and not is_dcf(file):
        return ()
    eds = files.get(file, axis, like)
    found = {(item.index, item.sub): item for item in dcf_objects(eds)} if axis == 1 else {}
    for address, value in objects.items():
        item = own_object(address, value, axis, eds)
        found[item.index, item.sub] = item
    return tuple(found.values())


def own_object(address: str, value: OwnValue, axis: int, eds: Eds) -> OwnObject:
    """One object of the drives file; a type that is stated counts where the EDS has none.

    Raises:
        EdsError: says what is allowed.
    """
    index, sub = address_of(address)
    entry = eds.find(f"{index:04X}:{sub:02X}")
    key = said_by(index, sub)
    if key is not None and index != CYCLE_PERIOD:
        raise EdsError(f"{entry.address} {entry.name}, which the gateway writes itself", f"for it {key}")
    if index_of(first_axis_index(index), axis) != index and first_axis_index(index) in range(0x6000, 0x6800):
        raise EdsError(
            f"{entry.address} {entry.name}, which is not axis {axis}'s", "objects of this axis and of the node"
        )
    if not entry.writable:
        raise EdsError(f"{entry.address} {entry.name}, which is read-only", "objects that can be written")
    return OwnObject(index, sub, entry.name, _data(entry, value), entry.readable)


def _data(entry: ObjectEntry, value: OwnValue) -> bytes:
    match value:
        case TypedValue(value=number, type=kind):
            size, signed = TYPES[kind]
            if entry.size and entry.kind != kind:
                raise EdsError(f"{kind} for {entry.address} {entry.name}", f"its type, {entry.kind}")
            return entry.typed(size, signed).pack_number(number)
        case str():
            if not (entry.text or entry.octets or entry.real):
                raise EdsError(f"a text for {entry.address} {entry.name}", "numbers, unless its EDS says it is a text")
            return entry.pack(value)
        case _ if not entry.described:
            whose = "an object of the maker's own" if entry.makers else "whose type is not known"
            allowed = "the drive's `eds` beside it, or its type: {value: ..., type: UNSIGNED16}"
            raise EdsError(f"{entry.address} {entry.name}, {whose}", allowed)
    return entry.pack_number(value)


def dcf_objects(eds: Eds) -> list[OwnObject]:
    """What a DCF says, without what the gateway writes itself. Raises `EdsError`: an impossible value."""
    values = eds.parameters(lambda index, sub: said_by(index, sub) is None)
    return [OwnObject(entry.index, entry.sub, entry.name, data, entry.readable) for entry, data in values]
