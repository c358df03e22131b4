"""The part of a drives file that maps process data for motions of the drives' own, and what must hold for it."""

from collections.abc import Iterator
from typing import Annotated

from pydantic import BaseModel, Field

from cell.config.document import Document
from cell.config.problem import KeyPath, Problem
from cell.config.units import STRICT, Seconds
from drive_gateway.canopen.pdo_map import ProcessImage
from drive_gateway.canopen.profile_pdos import COMMANDS, MOST_BITS, NEEDED, Entries, ProfilePdos, bits_of, object_of

Mapping = Annotated[
    tuple[Annotated[int, Field(ge=0x10000008, le=0xFFFFFFFF)], ...],
    Field(max_length=8, description="mapping entries as in 1600h and 1A00h: index, sub-index, bits, as 0x60400010"),
]
_RPDOS, _TPDOS = ("rpdo1", "rpdo2", "rpdo3"), ("tpdo1", "tpdo2", "tpdo3")
_LONGEST_S = 6.5
"""Inhibit times are 16 bits of 100 us."""


class ProfilePdosEntry(BaseModel):
    """The first three PDOs of every node on the bus, in each direction; RPDOs act on arrival, TPDOs come by a timer."""

    model_config = STRICT
    period_s: Seconds = Field(description="period of the TPDOs; a whole number of milliseconds")
    rpdo1: Mapping = ()
    rpdo2: Mapping = ()
    rpdo3: Mapping = ()
    tpdo1: Mapping = ()
    tpdo2: Mapping = ()
    tpdo3: Mapping = ()

    def pdos(self) -> ProfilePdos:
        return ProfilePdos(self.period_s, self._used(_RPDOS), self._used(_TPDOS))

    def _used(self, names: tuple[str, ...]) -> tuple[Entries, ...]:
        """Up to the last one that carries something."""
        all_of_them: list[Entries] = [getattr(self, name) for name in names]
        while all_of_them and not all_of_them[-1]:
            all_of_them.pop()
        return tuple(all_of_them)


def check_profile_pdos(
    document: Document, entry: ProfilePdosEntry | None, images: list[ProcessImage]
) -> Iterator[Problem]:
    """Whether a drive can take this mapping beside the cyclic `images`, and a gateway command a motion with it."""
    if entry is None:
        return
    at: KeyPath = ("profile_pdos",)
    if abs(entry.period_s * 1000 - round(entry.period_s * 1000)) > 1e-6 or not 0.001 <= entry.period_s <= _LONGEST_S:
        yield document.problem((*at, "period_s"), f"{entry.period_s:g}", f"0.001 to {_LONGEST_S:g}, whole milliseconds")
    for name in (*_RPDOS, *_TPDOS):
        bits = bits_of(getattr(entry, name))
        if bits > MOST_BITS or bits % 8:
            yield document.problem((*at, name), f"{bits} bits", f"whole bytes, up to {MOST_BITS} bits")
    if entry.rpdo3 and any(image.offset is not None and image.offset.number == 3 for image in images):
        found = "rpdo3 beside the feed-forward of an axis, which needs it"
        yield document.problem((*at, "rpdo3"), found, "rpdo1 and rpdo2 alone, or no feed_forward in this file")
    if entry.tpdo3 and any(image.inputs is not None and image.inputs.number == 3 for image in images):
        found = "tpdo3 beside the digital inputs of an axis, which need it"
        yield document.problem((*at, "tpdo3"), found, "tpdo1 and tpdo2 alone, or no inputs in this file")
    mapped = [(name, code) for name in _RPDOS for code in getattr(entry, name)]
    for name, code in mapped:
        if code not in [index << 16 | bits for index, (bits, _) in COMMANDS.items()]:
            allowed = ", ".join(f"0x{index << 16 | bits:08X}" for index, (bits, _) in COMMANDS.items())
            yield document.problem((*at, name), f"0x{code:08X}", f"one of {allowed}")
    for index in NEEDED:
        times = sum(object_of(code) == index for _, code in mapped)
        if times != 1:
            yield document.problem(at, f"{index:04X}h in {times} RPDOs", "in one of rpdo1, rpdo2 and rpdo3")
