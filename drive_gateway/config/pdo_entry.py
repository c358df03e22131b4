"""The part of an axis that says which of its PDOs carry what, and what must hold for them on the whole bus."""

from collections.abc import Iterator, Sequence
from typing import Annotated

from pydantic import AfterValidator, BaseModel, Field

from cell.config.document import Document
from cell.config.problem import KeyPath, Problem
from cell.config.units import STRICT
from drive_gateway.canopen.axis_objects import first_axis_index
from drive_gateway.canopen.drive_objects import POSITION_ACTUAL, STATUSWORD, TORQUE_ACTUAL
from drive_gateway.canopen.pdo_map import OwnPdo, Pdo, ProcessImage
from drive_gateway.canopen.profile_pdos import MOST_BITS, bits_of
from drive_gateway.config.profile_entry import Mapping

_FREE = (range(0x181, 0x580), range(0x680, 0x6E0))
"""CiA 301, restricted CAN-IDs: what is left for PDOs."""
Named = tuple[KeyPath, str, ProcessImage]
"""An axis with its place in the file and its name for people, which begins with its robot's."""


def _free(cob_id: int) -> int:
    if not any(cob_id in some for some in _FREE):
        raise ValueError("0x181 to 0x57F, or 0x680 to 0x6DF: CiA 301 has the others for itself")
    return cob_id


class OwnPdoEntry(BaseModel):
    """One PDO of an axis."""

    model_config = STRICT
    number: Annotated[int, Field(ge=1, le=4)] | None = Field(
        default=None, description="which PDO of the axis it is, 1 to 4; for drives whose mapping is fixed"
    )
    cob_id: Annotated[int, AfterValidator(_free)] | None = Field(
        default=None, description="its identifier (bits 0 to 10 of 14xxh:01, 18xxh:01); without it that of CiA 301"
    )

    def own(self) -> OwnPdo:
        return OwnPdo(self.number, self.cob_id)


class StatusPdoEntry(OwnPdoEntry):
    """The PDO with statusword and position."""

    mapping: Mapping = ()

    def own(self) -> OwnPdo:
        return OwnPdo(self.number, self.cob_id, self.mapping)


class PdosEntry(BaseModel):
    """PDOs of an axis that are not as usual; what is left out is as the gateway has it."""

    model_config = STRICT
    command: OwnPdoEntry | None = Field(default=None, description="RPDO with controlword and set point")
    status: StatusPdoEntry | None = Field(default=None, description="TPDO with statusword and position")
    offset: OwnPdoEntry | None = Field(default=None, description="RPDO of feed-forward")
    inputs: OwnPdoEntry | None = Field(default=None, description="TPDO of the digital inputs")
    outputs: OwnPdoEntry | None = Field(default=None, description="RPDO of the digital outputs")

    def own(self) -> dict[str, OwnPdo]:
        """By what they carry."""
        said = {name: getattr(self, name) for name in type(self).model_fields}
        return {name: entry.own() for name, entry in said.items() if entry is not None}


def check_pdos(document: Document, axes: Sequence[Named], others: Sequence[tuple[str, Pdo]]) -> Iterator[Problem]:
    """Each PDO that is named is there and its own; no identifier is on the bus twice. `others`: those of I/O nodes."""
    taken: dict[int, list[str]] = {pdo.cob_id: [f"{pdo.name} of {who}"] for who, pdo in others}
    for _, who, image in axes:
        for each in image.pdos:
            taken.setdefault(each.cob_id, []).append(f"{each.name} of {who}")
    for path, who, image in axes:
        place = (*path, "pdos")
        for name in document.keys(place):
            pdo = getattr(image, name, None)
            if not isinstance(pdo, Pdo):
                found = f"{name}, which this axis does not have"
                yield document.problem((*place, name), found, "PDOs that carry something", at_key=True)
                continue
            yield from _numbered(document, (*place, name), pdo, image)
            if name == "status":
                yield from _mapped(document, (*place, name, "mapping"), image)
            sharing = [other for other in taken[pdo.cob_id] if other != f"{pdo.name} of {who}"]
            if pdo.identifier is not None and sharing:
                found = f"{pdo.cob_id:03X}h, that of {' and '.join(sharing)} too"
                yield document.problem((*place, name, "cob_id"), found, "an identifier that nobody else has")


def _numbered(document: Document, place: KeyPath, pdo: Pdo, image: ProcessImage) -> Iterator[Problem]:
    same = [each for each in image.pdos if (each.receive, each.number) == (pdo.receive, pdo.number)]
    if len(same) > 1:
        allowed = "a number of its own: each PDO carries one thing, profile_pdos take the first three"
        yield document.problem((*place, "number"), f"{pdo.name} twice", allowed)


def _mapped(document: Document, place: KeyPath, image: ProcessImage) -> Iterator[Problem]:
    """What is needed is in it, in the order in which it is read."""
    entries = image.status.entries
    if document.value(place) is None:
        return
    if bits_of(entries) > MOST_BITS or any(entry & 0x07 for entry in entries):
        yield document.problem(place, f"{bits_of(entries)} bits", f"whole bytes, up to {MOST_BITS} bits")
        return
    needed = [STATUSWORD << 16 | 16, POSITION_ACTUAL << 16 | 32]
    needed += [TORQUE_ACTUAL << 16 | 16] if image.tells_torque else []
    first = [first_axis_index(entry >> 16) << 16 | entry & 0xFFFF for entry in entries]
    if [entry for entry in first if entry in needed] != needed:
        listed = ", ".join(f"0x{entry:08X}" for entry in needed)
        found = ", ".join(f"0x{entry:08X}" for entry in first) or "nothing"
        yield document.problem(place, found, f"each of {listed} once, in this order, others between or after them")
