"""Whether a CAN bus is short enough for its bit rate."""

from collections.abc import Iterator
from dataclasses import dataclass

from cell.config.document import Document
from cell.config.problem import Problem


@dataclass(frozen=True, slots=True)
class BusLengths:
    """[m] the bus from end to end, the longest stub, all stubs together."""

    length_m: float
    longest_stub_m: float
    stubs_m: float


LONGEST: dict[int, BusLengths] = {
    1_000_000: BusLengths(25, 1.5, 7.5),
    800_000: BusLengths(50, 2.5, 12.5),
    500_000: BusLengths(100, 5.5, 27.5),
    250_000: BusLengths(250, 11, 55),
    125_000: BusLengths(500, 22, 110),
    50_000: BusLengths(1000, 55, 275),
    20_000: BusLengths(2500, 137.5, 687.5),
    10_000: BusLengths(5000, 275, 1375),
}
"""By bit rate, as a thesis on CANopen control prints it (CiA 303-1 recommends much the same)."""


def check_length(document: Document, bitrate: int, said: BusLengths) -> Iterator[Problem]:
    """What the file says of its bus, 0 where it says nothing, against what the bit rate allows."""
    allowed = LONGEST[bitrate]
    for name in ("length_m", "longest_stub_m", "stubs_m"):
        found, most = getattr(said, name), getattr(allowed, name)
        if found > most:
            rate = _fastest(name, found)
            slower = f", or a bit rate of {rate} bit/s or less" if rate else ""
            yield document.problem(("bus", name), f"{found:g} at {bitrate} bit/s", f"up to {most:g}{slower}")
    if said.stubs_m and said.longest_stub_m > said.stubs_m:
        found = f"a stub of {said.longest_stub_m:g} among stubs of {said.stubs_m:g} in all"
        yield document.problem(("bus", "longest_stub_m"), found, f"up to {said.stubs_m:g}")


def _fastest(name: str, length: float) -> int:
    """The highest bit rate for such a length; 0: none."""
    return max((rate for rate, longest in LONGEST.items() if getattr(longest, name) >= length), default=0)
